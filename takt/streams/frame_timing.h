// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/time/instant.h"

namespace takt {

/// Which instant of the exposure a frame's stamp means, and of which row.
enum class ExposureInstant { start, middle, end };
enum class RowReference { first, middle };
enum class Shutter { unknown, global, rolling };

/// What a frame's stamp means. Exposure and readout live here, never inside the offset.
struct FrameTiming {
  ExposureInstant instant = ExposureInstant::middle;
  RowReference row = RowReference::first;
  Shutter shutter = Shutter::unknown;
  double exposure_s = 0;  ///< 0 where unknown; a frame's own exposure takes precedence
  double readout_s = 0;   ///< from the first row's instant to the last row's + one line; 0 for a global shutter
  int rows = 0;

  [[nodiscard]] double line_delay_s() const { return rows > 0 ? readout_s / rows : 0; }
  /// What is added to a frame's stamp to get the middle of the exposure of its reference row (s).
  [[nodiscard]] double to_exposure_middle_s(double frame_exposure_s) const {
    switch (instant) {
      case ExposureInstant::start:
        return 0.5 * frame_exposure_s;
      case ExposureInstant::end:
        return -0.5 * frame_exposure_s;
      case ExposureInstant::middle:
        break;
    }
    return 0;
  }
};

}  // namespace takt
