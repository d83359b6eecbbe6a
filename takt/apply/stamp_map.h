// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/streams/frame_timing.h"

/// What a result does to a stamp.
namespace takt {

enum class Moved { sensor, reference };

/// The sensor's stamps as the reference's clock would have given them (offset, drift and pieces), or the reference's
/// on the sensor's clock. Throws std::logic_error where the result has no answer.
[[nodiscard]] std::function<Stamp(Stamp)> stamp_map(const Estimate& result, Moved moved);

/// What a frame's stamp is to mean after it was moved; nothing: what it meant before.
struct FrameMeaning {
  std::optional<ExposureInstant> instant;
  std::optional<RowReference> row;

  [[nodiscard]] bool asks_anything() const { return instant || row; }
};
/// What is to be added to a stamp so that it means `wanted` instead of what `timing` says. `exposure_s` is the frame's
/// own, `line_delay_s` from one row's instant to the next one's.
[[nodiscard]] Duration meaning_shift(const FrameTiming& timing, double exposure_s, double line_delay_s,
                                     const FrameMeaning& wanted);

/// "the middle of the exposure of the first row"
[[nodiscard]] std::string in_words(ExposureInstant instant, RowReference row);

}  // namespace takt
