// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "takt/motion/rigid.h"
#include "takt/streams/corners.h"

/// Where the camera stood when it saw the board, frame by frame.
namespace takt::batch {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// A small move ξ = (ρ, φ) of the board in the camera's frame: p_cam ← p_cam + ρ + φ × p_cam.
[[nodiscard]] Rigid moved(const Rigid& T_cam_board, const Vec6& xi);

/// Corners' squared distances from where a pose puts them, as a quadratic in ξ: Σ|r + J·ξ|². Unit weight a pixel.
struct PoseNormals {
  Mat6 information = Mat6::Zero();  ///< Σ Jᵀ·J
  Vec6 gradient = Vec6::Zero();     ///< Σ Jᵀ·r, r = predicted − seen
  double squares = 0;               ///< Σ r², px²
  int corners = 0;
};

/// What one frame saw.
struct BoardView {
  std::size_t frame = 0;                   ///< index into the stream
  std::vector<CornerObservation> corners;  ///< those that fit a rigid board
  int stray = 0;                           ///< those that do not
  Rigid T_cam_board;
  Mat6 information = Mat6::Zero();                   ///< of ξ at T_cam_board, per px² of corner variance
  double squares = 0;                                ///< px²
  Eigen::Matrix<double, 6, Eigen::Dynamic> to_lens;  ///< ξ of the best pose a unit of each intrinsic; of lens fits only
};

struct BoardViews {
  std::vector<BoardView> views;  ///< in order of frames
  double corner_sigma_px = 0;    ///< robust; the poses' own fit taken into account
  std::size_t seen = 0;          ///< frames with any corner
  std::size_t failed = 0;        ///< frames with corners, but no pose that explains them
  std::size_t stray = 0;         ///< corners left out
};

/// Adds the corners' share at a pose; false where a corner cannot be seen from there.
[[nodiscard]] bool add_corners(const CameraModel& model, std::span<const Vec3> board,
                               std::span<const CornerObservation> corners, const Rigid& T_cam_board, PoseNormals& out);

/// A first pose from the homography of the corners' bearings, without refinement; nothing for corners in one line.
[[nodiscard]] std::optional<Rigid> pose_by_homography(const CameraModel& model, std::span<const Vec3> board,
                                                      std::span<const CornerObservation> corners);

/// The pose of every frame with at least six corners, each by itself and without a first guess: homography, then
/// Gauss–Newton on the pixels, strays left out. Frames share nothing but the corners' noise.
[[nodiscard]] BoardViews find_board_poses(const CornerStream& stream, int threads);

}  // namespace takt::batch
