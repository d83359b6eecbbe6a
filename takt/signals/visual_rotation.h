// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>
#include <optional>

#include "takt/signals/feature_tracker.h"
#include "takt/signals/pair_rotation.h"
#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

namespace takt {

struct VisualRotationOptions {
  FeatureTrackerOptions tracker;
  PairRotationOptions pair;
  std::optional<Stamp> from, to;  ///< frames outside are not tracked
  double longest_step_s = 0.5;    ///< no increment over a longer gap between frames
  std::size_t decode_ahead = 4;   ///< frames that a second thread decodes ahead; 0: one thread does all
  std::function<void(std::size_t done, std::size_t total)> progress;
};

/// How a camera turned from frame to frame, from its pictures: corners are tracked and the rotation between two frames
/// is estimated robustly from their bearings, whatever the camera's translation.
///
/// Stamps of the increments are exposure middles of the frames' reference row (CameraStream::timing and each frame's
/// exposure; the returned timing says `middle`). Frames that repeat the picture before them are taken as not there.
/// Frames that cannot be followed (blank, blurred, a cut) leave a gap between increments, and a note.
///
/// Throws std::invalid_argument when the model is for another image size, and what the reader throws.
[[nodiscard]] RotationSignal visual_rotation(const CameraStream& stream, const CameraModel& model,
                                             const VisualRotationOptions& options = {});

/// With the stream's own model, or where it has none an undistorted pinhole of the stated horizontal field of view, and
/// then `focal_assumed` is set.
[[nodiscard]] RotationSignal visual_rotation(const CameraStream& stream, double assumed_horizontal_fov_rad,
                                             const VisualRotationOptions& options = {});

}  // namespace takt
