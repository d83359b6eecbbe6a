// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"
#include "takt/time/instant.h"

/// What alignment compares: how a sensor turned between two of its stamps.
namespace takt {

/// One feature seen in two frames. Bearings are unit vectors in the camera frame; rows are counted from the frame's
/// reference row, in fractions of the image height, so that with a readout r the feature was seen at
/// stamp + row·r.
struct BearingMatch {
  Eigen::Vector3f from, to;
  float row_from = 0, row_to = 0;
  float sigma_rad = 0;  ///< of one bearing, one axis
  std::int64_t id = 0;  ///< of the feature, where it is seen in more than two frames
};

/// R_from_to (takes vectors from the sensor's frame at `to` to its frame at `from`) as a rotation vector, and the
/// inverse covariance of its error in the frame at `to`: R_true = R·exp(error).
struct RotationIncrement {
  Stamp from, to;
  Vec3 rotation = Vec3::Zero();         ///< rad
  Mat3 information = Mat3::Identity();  ///< 1/rad²; zero where the increment could not be measured
  /// From bearings: the rotation alone that explains them best, biased by the translation but with far less noise than
  /// one that has to tell the two apart. For a search, never for an answer. Equal to `rotation` where there is no such
  /// thing.
  Vec3 apparent = rotation;
};

/// What a camera saw in common in two of its frames.
struct BearingPair {
  Stamp from, to;
  std::vector<BearingMatch> matches;
};

/// Rotation increments in order of time; `from` of one is usually `to` of the one before, unless there was a gap.
///
/// A camera also has `pairs`: its bearings over longer steps (some tenths of a second), in which it turned further
/// while the bearings are no worse. Chain by chain: a chain runs from each pair's `to` to the next one's `from`, and
/// several chains interleave so that every frame is used once; their noise is then independent from chain to chain.
struct RotationSignal {
  std::string name;
  std::string clock;
  std::string source;  ///< "images", "tracks", "attitude", "gyro": for words and for the noise model
  std::vector<RotationIncrement> increments;
  std::vector<BearingPair> pairs;
  FrameTiming timing;
  double apparent_row = 0;  ///< mean row of the bearings behind the apparent rotations, as BearingMatch counts rows
  std::optional<CameraModel> model;
  bool focal_assumed = false;  ///< the field of view is a stated default, so rotations may be off by a scale
  std::optional<Mat3> R_body_sensor;
  std::vector<std::string> notes;   ///< what the front end has to say ("17 of 300 frames had too few features")
  double unexplained_fraction = 0;  ///< share of frames whose motion no rigid rotation + translation explains
};

}  // namespace takt
