// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/batch/board_pose.h"

namespace takt::batch {

/// A lens and the poses from which it saw the board, fitted together.
struct LensFit {
  CameraModel model;
  std::vector<BoardView> views;
  double cost = 0;              ///< Σ of Huber's loss, px²
  Eigen::MatrixXd information;  ///< of the intrinsics alone, the poses eliminated, per px² of corner variance
  int rounds = 0;
  bool converged = false;
};

/// Levenberg–Marquardt on all corners; poses are eliminated frame by frame, so a round is linear in their number.
/// `huber_px`: beyond it a corner's distance counts linearly.
[[nodiscard]] LensFit fit_lens(const CameraModel& start, std::vector<BoardView> views, const std::vector<Vec3>& board,
                               double huber_px, int most_rounds, int threads);

/// Whether a model's numbers can belong to a lens at all.
[[nodiscard]] bool is_lens(const CameraModel& model);

}  // namespace takt::batch
