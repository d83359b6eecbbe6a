// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/calibration/evidence.h"
#include "takt/estimators/batch/board_pose.h"
#include "takt/streams/corners.h"

/// Cameras from pictures of a board alone: their lenses, and how they stand to each other (docs/methods/intrinsics.md).
namespace takt::batch {

struct IntrinsicsOptions {
  Projection projection = Projection::pinhole;
  Distortion distortion = Distortion::radtan;
  std::size_t most_frames = 300;  ///< more are thinned out evenly
  int threads = 0;
};

struct CalibratedCamera {
  CameraModel model;
  std::optional<CameraModel> twin;  ///< another lens of the kind that explains the pictures as well, far off in numbers
  Intrinsics sigma;                 ///< of each intrinsic, in the model's order: corners' scatter, and what they share
  Eigen::MatrixXd covariance;       ///< of the intrinsics
  double rms_px = 0;                ///< of the corners kept, per coordinate
  double corner_sigma_px = 0;       ///< their noise, with the fitted unknowns taken into account
  double systematic_px = 0;         ///< what corners miss by in the same way in one part of the picture; in σ too
  std::size_t frames = 0, corners = 0, strays = 0;
  double covered_width = 0, covered_height = 0;  ///< share of the picture that the corners span
  double largest_tilt_rad = 0;                   ///< of the board against the picture's plane
  std::vector<BoardView> views;                  ///< the frames used, at the answer
  std::vector<Panel> panels;                     ///< residuals and coverage, for the report
  Verdict verdict = Verdict::refused;
  std::vector<std::string> reasons;
};

/// The lens of a camera of `width` × `height` px from what it saw of a board, without any first guess: a grid of focal
/// lengths, each with poses from homographies [Zhang2000] and a few steps on some frames; then all frames to the end,
/// corners at odds left out. Refuses where no start leads anywhere, or the data leave an intrinsic free.
[[nodiscard]] CalibratedCamera calibrate_intrinsics(const CornerStream& stream, int width, int height,
                                                    const IntrinsicsOptions& options = {});

/// How a camera stands to the one before it in a chain.
struct CameraPair {
  Rigid T_cn_cnm1;  ///< takes points from the camera before to this one
  Vec6 sigma;       ///< of ξ = (ρ, φ) on the left of T (m, rad); both lenses' uncertainty is in it
  std::size_t frames = 0;
};
/// From frames that both took at the same time (`tolerance_s`), each camera's lens and poses as found; nothing where
/// there are fewer than three.
[[nodiscard]] std::optional<CameraPair> relate_cameras(const CornerStream& before, const CalibratedCamera& before_found,
                                                       const CornerStream& stream, const CalibratedCamera& found,
                                                       double tolerance_s = 1e-4);

}  // namespace takt::batch
