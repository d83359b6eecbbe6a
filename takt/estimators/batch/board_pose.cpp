// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/board_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "takt/math/median.h"
#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

constexpr std::size_t fewest_corners = 6;
/// A corner further off than this many sigmas does not belong to the board.
constexpr double stray_sigmas = 5;
/// The median length of a two-dimensional standard normal vector.
constexpr double rayleigh_median = 1.17741;
/// A pose whose typical corner is this far off explains nothing (px).
constexpr double hopeless_px = 5;
constexpr int poses_a_task = 16;

/// Every so-manieth corner, `count` of them, from a given one on.
std::vector<CornerObservation> spread_out(std::span<const CornerObservation> all, std::size_t count,
                                          std::size_t first) {
  std::vector<CornerObservation> some;
  count = std::min(count, all.size());
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[(first + i * all.size() / count) % all.size()]);
  return some;
}

}  // namespace

/// Pose from the homography of bearings (direct linear transform): b × H·(x, y, 1) = 0, H = (r1, r2, t).
std::optional<Rigid> pose_by_homography(const CameraModel& model, std::span<const Vec3> board,
                                        std::span<const CornerObservation> corners) {
  Vec2 middle = Vec2::Zero();
  for (const CornerObservation& c : corners)
    middle += board[static_cast<std::size_t>(c.corner)].head<2>() / static_cast<double>(corners.size());
  double scale = 0;
  for (const CornerObservation& c : corners)
    scale = std::max(scale, (board[static_cast<std::size_t>(c.corner)].head<2>() - middle).norm());
  if (!(scale > 0)) return std::nullopt;

  using Row9 = Eigen::Matrix<double, 3, 9>;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  std::vector<std::pair<Vec3, Vec3>> pairs;  // bearing, homogeneous board point
  for (const CornerObservation& c : corners) {
    const auto bearing = model.bearing(c.pixel);
    if (!bearing) continue;
    Vec3 m;
    m << (board[static_cast<std::size_t>(c.corner)].head<2>() - middle) / scale, 1;
    Row9 rows;
    const Mat3 cross = hat(*bearing);
    rows << m.x() * cross, m.y() * cross, m.z() * cross;
    normal += rows.transpose() * rows;
    pairs.emplace_back(*bearing, m);
  }
  if (pairs.size() < 4) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  // Corners in one line have a whole family of homographies.
  if (!(eigen.eigenvalues()[1] > 1e-9 * eigen.eigenvalues()[8])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Mat3 H = Eigen::Map<const Mat3>(h.data());
  double ahead = 0;
  for (const auto& [bearing, m] : pairs) ahead += bearing.dot(H * m) > 0 ? 1 : -1;
  if (ahead < 0) H = -H;
  const double length = std::sqrt(H.col(0).norm() * H.col(1).norm());
  if (!(length > 0)) return std::nullopt;
  Mat3 axes;
  axes << H.col(0) / length, H.col(1) / length, H.col(0).cross(H.col(1)) / (length * length);
  const Mat3 R = align_vectors(axes).rotation;
  Vec3 centre;
  centre << middle, 0;
  return Rigid{Quat(R), H.col(2) * (scale / length) - R * centre};
}

namespace {

/// Gauss–Newton to the end; false where it leaves the board's sight or a direction of ξ is not determined.
bool refine(const CameraModel& model, std::span<const Vec3> board, std::span<const CornerObservation> corners,
            Rigid& pose, PoseNormals& at) {
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 15; ++round) {
    at = {};
    if (!add_corners(model, board, corners, pose, at)) return false;
    const Eigen::LDLT<Mat6> factor(at.information);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1e-9 * factor.vectorD().maxCoeff()))
      return false;
    const Vec6 step = -factor.solve(at.gradient);
    // What the step gains, in corners: far below one it is the last, as the next would gain the square of that.
    const double gain = -step.dot(at.gradient);
    if (!(gain >= 0) || at.squares > 4 * before) return false;
    pose = moved(pose, step);
    if (gain < 1e-4 * at.squares / static_cast<double>(corners.size()) + 1e-12) return true;
    before = at.squares;
  }
  return true;
}

std::vector<double> distances(const CameraModel& model, std::span<const Vec3> board,
                              std::span<const CornerObservation> corners, const Rigid& pose) {
  std::vector<double> out;
  out.reserve(corners.size());
  for (const CornerObservation& c : corners) {
    const auto pixel = model.project(pose * board[static_cast<std::size_t>(c.corner)]);
    out.push_back(pixel ? (*pixel - c.pixel).norm() : std::numeric_limits<double>::infinity());
  }
  return out;
}

void settle(BoardView& view, const PoseNormals& at) {
  view.information = at.information;
  view.squares = at.squares;
}

/// The first pose of a frame, from all its corners; nothing where no part of the corners agrees on one.
std::optional<BoardView> first_pose(const CornerStream& s, std::size_t frame) {
  const std::span<const CornerObservation> all = s.corners[frame];
  BoardView view;
  view.frame = frame;
  // The second and later attempts take fewer corners, so that one without strays comes along.
  for (std::size_t attempt = 0; attempt < 12; ++attempt) {
    const auto some = spread_out(all, attempt == 0 ? 16 : 8, attempt);
    const auto start = pose_by_homography(*s.model, s.board, some);
    if (!start) continue;
    view.T_cam_board = *start;
    view.corners.assign(all.begin(), all.end());
    PoseNormals at;
    if (attempt == 0 && !refine(*s.model, s.board, all, view.T_cam_board, at)) view.T_cam_board = *start;
    const std::vector<double> off = distances(*s.model, s.board, all, view.T_cam_board);
    const double typical = median(off);
    if (attempt == 0 && typical < hopeless_px && *std::ranges::max_element(off) < 6 * typical) {
      settle(view, at);
      return view;
    }
    // Keep what is near, and fit again.
    if (!(typical < hopeless_px)) continue;
    for (int round = 0; round < 3; ++round) {
      const std::vector<double> now = distances(*s.model, s.board, all, view.T_cam_board);
      const double limit = std::max(0.05, 4 * median(now));
      view.corners.clear();
      for (std::size_t i = 0; i < all.size(); ++i)
        if (now[i] < limit) view.corners.push_back(all[i]);
      if (view.corners.size() < fewest_corners || !refine(*s.model, s.board, view.corners, view.T_cam_board, at)) break;
    }
    if (view.corners.size() < std::max(fewest_corners, all.size() / 2)) continue;
    settle(view, at);
    return view;
  }
  return std::nullopt;
}

/// Takes each corner by the noise of all frames: strays out, the others (back) in.
bool tidy_view(const CornerStream& s, BoardView& view, double sigma_px) {
  const std::span<const CornerObservation> all = s.corners[view.frame];
  for (int round = 0; round < 3; ++round) {
    const std::vector<double> off = distances(*s.model, s.board, all, view.T_cam_board);
    std::vector<CornerObservation> kept;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (off[i] < stray_sigmas * sigma_px) kept.push_back(all[i]);
    if (kept.size() < std::max(fewest_corners, all.size() / 3)) return false;
    const bool same = kept.size() == view.corners.size();
    view.corners = std::move(kept);
    view.stray = static_cast<int>(all.size() - view.corners.size());
    if (same && view.information != Mat6::Zero()) return true;
    PoseNormals at;
    if (!refine(*s.model, s.board, view.corners, view.T_cam_board, at)) return false;
    settle(view, at);
  }
  return true;
}

}  // namespace

Rigid moved(const Rigid& T_cam_board, const Vec6& xi) {
  const Quat turn = exp_so3(xi.tail<3>());
  return {(turn * T_cam_board.rotation).normalized(), turn * T_cam_board.translation + xi.head<3>()};
}

bool add_corners(const CameraModel& model, std::span<const Vec3> board, std::span<const CornerObservation> corners,
                 const Rigid& T_cam_board, PoseNormals& out) {
  const Mat3 R = T_cam_board.rotation.toRotationMatrix();
  for (const CornerObservation& c : corners) {
    const Vec3 p = R * board[static_cast<std::size_t>(c.corner)] + T_cam_board.translation;
    const auto at = project_with_jacobians(model, p);
    if (!at) return false;
    const Vec2 r = at->pixel - c.pixel;
    Eigen::Matrix<double, 2, 6> j;
    j << at->to_point, -at->to_point * hat(p);
    out.information.noalias() += j.transpose() * j;
    out.gradient.noalias() += j.transpose() * r;
    out.squares += r.squaredNorm();
  }
  out.corners += static_cast<int>(corners.size());
  return true;
}

BoardViews find_board_poses(const CornerStream& s, int threads) {
  if (!s.model) throw std::invalid_argument("find_board_poses: " + s.name + " has no camera model");
  const std::size_t n = s.size();
  std::vector<std::optional<BoardView>> found(n);
  const auto tasks = static_cast<int>((n + poses_a_task - 1) / poses_a_task);
  const auto each = [&](const auto& body) {
    parallel_for(tasks, threads, [&](int task) {
      const auto first = static_cast<std::size_t>(task) * poses_a_task;
      for (std::size_t i = first; i < std::min(n, first + poses_a_task); ++i) body(i);
    });
  };
  each([&](std::size_t i) {
    if (s.corners[i].size() >= fewest_corners) found[i] = first_pose(s, i);
  });

  BoardViews out;
  std::vector<double> sigmas;
  for (const auto& view : found) {
    if (!view) continue;
    const double n_corners = static_cast<double>(view->corners.size());
    const double fitted = std::sqrt(1 - 3 / n_corners);  // six parameters from 2n numbers
    sigmas.push_back(median(distances(*s.model, s.board, view->corners, view->T_cam_board)) / rayleigh_median / fitted);
  }
  if (!sigmas.empty()) out.corner_sigma_px = median(sigmas);
  each([&](std::size_t i) {
    if (found[i] && !tidy_view(s, *found[i], out.corner_sigma_px)) found[i].reset();
  });
  for (std::size_t i = 0; i < n; ++i) {
    out.seen += !s.corners[i].empty();
    if (!found[i]) {
      out.failed += !s.corners[i].empty();
      continue;
    }
    out.stray += static_cast<std::size_t>(found[i]->stray);
    out.views.push_back(std::move(*found[i]));
  }
  return out;
}

}  // namespace takt::batch
