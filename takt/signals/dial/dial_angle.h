// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/dial.h"
#include "takt/streams/streams.h"

namespace takt {

/// How frames become angles.
///   neighbours  each frame against the one before, the shifts added up [Fu2021 §2.2]; errors add up as well
///   keyframes   each frame against a few kept ones, then against what all frames together show: no drift
///   coded       against the known print, then against what all frames together show: absolute, no drift
enum class DialMethod { neighbours, keyframes, coded };

struct DialOptions {
  DialMethod method = DialMethod::coded;
  /// The dial at rest, for methods that only see changes: the swings are centred on it. Good to 2° it is enough to tell
  /// one graduation of a plain dial from the next. Empty: the first frame reads 0.
  std::optional<double> rest_reading_rad;
  bool rows = false;  ///< two readings a frame, from upper and lower rows; a rolling shutter has them anyway
  int threads = 0;    ///< 0: as many as there are cores
  std::function<void(std::size_t done, std::size_t total)> progress;
};

struct DialAngles {
  AngleStream angles;              ///< dial readings (rad); rows are counted from the reference row
  std::vector<double> sigma_rad;   ///< of each reading, from its residuals
  std::vector<std::size_t> frame;  ///< each reading's frame
  std::size_t left_out = 0;        ///< frames without a reading
  double pixel_rad = 0;            ///< what a pixel sees in the middle of the picture
  double scale = 1;                ///< by which the view's angles had to be stretched to fit the dial's graduations
  std::vector<std::string> notes;  ///< what was left out and why, what was corrected
};

/// The dial's reading on the radius through the camera, frame by frame.
///
/// Each frame is reduced to grey means along the dial (no pixel is interpolated), perspective and mounting from `view`;
/// what `view` has wrong in scale, yaw, roll and lens is corrected by the graduations (not for `neighbours`).
/// Frames that do not show the dial (glare, blur, hidden, repeated) are left out and counted in the notes.
/// Throws std::invalid_argument for a view that does not see the dial, and what the reader throws.
[[nodiscard]] DialAngles dial_angles(const CameraStream& camera, const Dial& dial, const DialView& view,
                                     const DialOptions& options = {});

}  // namespace takt
