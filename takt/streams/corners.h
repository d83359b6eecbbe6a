// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"
#include "takt/time/instant.h"

/// A calibration board as a camera saw it: which of its corners, and where.
namespace takt {

/// One corner in one frame.
struct CornerObservation {
  std::int32_t corner = 0;  ///< index into the board's points
  Vec2 pixel = Vec2::Zero();
};

/// Corners of one board, frame by frame: what a detector finds in pictures, and what a simulator can give without any.
struct CornerStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;                            ///< of every frame, those without the board too
  std::vector<double> exposures_s;                      ///< empty or one a frame
  std::vector<std::vector<CornerObservation>> corners;  ///< one list a frame, by ascending corner; empty: not seen
  std::vector<Vec3> board;                              ///< the corners' places on the board (m), z = 0
  FrameTiming timing;
  std::optional<CameraModel> model;
  std::optional<Mat4> T_body_cam;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

struct CameraStream;

/// What corners have from the pictures in which they are seen: everything but the corners themselves, one empty list a
/// frame.
[[nodiscard]] CornerStream without_corners(const CameraStream& camera, std::vector<Vec3> board);

}  // namespace takt
