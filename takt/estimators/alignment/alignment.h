// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

/// Angular-rate alignment: the offset between a sensor that turns and a gyro, from their motion alone.
/// docs/methods/alignment.md has the derivation.
namespace takt {

struct AlignmentOptions {
  std::string method = "auto";  ///< auto (the best that answers), correlation, phase, tdicp or ml
  /// Half-width of the search (s) around equal stamps; nothing: every offset at which the streams overlap.
  std::optional<double> search_s;
  /// Let the offset drift even where the data do not ask for it.
  bool drift = false;
  /// Estimate the line delay even where the shutter is said to be global.
  bool line_delay = false;
};

template <class Visitor>
void describe(AlignmentOptions& o, Visitor& v) {
  v("method", o.method, "auto, correlation, phase, tdicp or ml");
  v("search_s", o.search_s, "half-width of the search around equal stamps; as far as the data overlap when left out");
  v("drift", o.drift, "let the offset drift even where the data do not ask for it");
  v("line_delay", o.line_delay, "estimate the line delay even where the shutter is said to be global");
}

/// Finds t_reference = t_sensor + offset (+ drift). The result's `estimates` holds every method that ran.
/// Data that cannot answer give a refusal; malformed input (stamps out of order) is a std::invalid_argument.
[[nodiscard]] Estimate align_rotation(const RotationSignal& sensor, const ImuStream& reference,
                                      const AlignmentOptions& options = {});

}  // namespace takt
