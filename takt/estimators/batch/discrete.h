// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/estimators/batch/calibration.h"
#include "takt/estimators/batch/chain.h"
#include "takt/estimators/batch/start.h"

/// The fast model: pose and velocity at the frames' instants, the IMU between them pre-integrated. The offset moves
/// both ends of every integration interval [Song2025].
namespace takt::batch {

/// Pose and velocity of the IMU in the board's frame.
struct BodyState {
  Quat R_board_imu = Quat::Identity();
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero();
};

struct DiscreteFit {
  bool converged = false;
  std::string failure;  ///< what was not determined, or did not settle
  Calibration calibration;
  BorderLayout layout;
  Eigen::MatrixXd covariance;  ///< of the border
  Noise noise;
  std::vector<ChainFrame> chain;
  std::vector<BodyState> states;  ///< one a frame of the chain
  int iterations = 0;
  std::size_t strangers = 0;                      ///< frames whose pose no motion of the IMU explains
  double row_slope_s = 0, row_slope_sigma_s = 0;  ///< what is left along the rows: a line delay that is not modelled
};

/// Threads: 0 is as many as there are cores; the result is the same for any number.
[[nodiscard]] DiscreteFit fit_discrete(const CameraSession& camera, const ImuSession& imu, const Start& start,
                                       int threads = 0);

}  // namespace takt::batch
