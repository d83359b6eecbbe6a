// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/batch/calibration.h"
#include "takt/estimators/batch/session.h"

namespace takt::batch {

/// A frame that is used: one that saw the board and that the IMU joins to a neighbour.
struct ChainFrame {
  const BoardView* view = nullptr;
  double time_s = 0;    ///< camera seconds of the reference row
  double mean_row = 0;  ///< of its corners, counted from the reference row
  bool joined = false;  ///< the IMU covers the way to the next frame, and it is not far
};

/// Frames further apart than this (s) are not joined: a position integrated so long says nothing.
inline constexpr double longest_join_s = 1;

/// Frames in order of time; those with no join on either side are left out.
[[nodiscard]] std::vector<ChainFrame> make_chain(const CameraSession& camera, const ImuCurve& imu,
                                                 const CameraLink& link);

}  // namespace takt::batch
