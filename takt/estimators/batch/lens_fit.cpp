// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/lens_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

constexpr double unseen_px = 50;  // what a corner costs that the model cannot see from its pose

/// One frame's share of the normal equations.
struct FrameNormals {
  Eigen::MatrixXd lens;      ///< Jₗᵀ·W·Jₗ
  Eigen::MatrixXd cross;     ///< Jₗᵀ·W·Jₚ
  Mat6 pose = Mat6::Zero();  ///< Jₚᵀ·W·Jₚ
  Eigen::VectorXd lens_gradient;
  Vec6 pose_gradient = Vec6::Zero();
  double cost = 0;
};

double huber_cost(double distance, double huber_px) {
  return distance <= huber_px ? distance * distance : huber_px * (2 * distance - huber_px);
}

double frame_cost(const CameraModel& model, const BoardView& view, const std::vector<Vec3>& board, double huber_px) {
  double cost = 0;
  for (const CornerObservation& c : view.corners) {
    const auto at = model.project(view.T_cam_board * board[static_cast<std::size_t>(c.corner)]);
    cost += huber_cost(at ? (*at - c.pixel).norm() : unseen_px, huber_px);
  }
  return cost;
}

FrameNormals normals(const CameraModel& model, const BoardView& view, const std::vector<Vec3>& board, double huber_px) {
  const Eigen::Index n = intrinsics_of(model).size();
  FrameNormals out{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, 6), Mat6::Zero(), Eigen::VectorXd::Zero(n)};
  const Mat3 R = view.T_cam_board.rotation.toRotationMatrix();
  for (const CornerObservation& c : view.corners) {
    const Vec3 p = R * board[static_cast<std::size_t>(c.corner)] + view.T_cam_board.translation;
    const auto at = project_with_jacobians(model, p);
    if (!at) {
      out.cost += huber_cost(unseen_px, huber_px);
      continue;
    }
    const Vec2 r = at->pixel - c.pixel;
    const double distance = r.norm(), weight = distance <= huber_px ? 1 : huber_px / distance;
    out.cost += huber_cost(distance, huber_px);
    Eigen::Matrix<double, 2, 6> to_pose;
    to_pose << at->to_point, -at->to_point * hat(p);
    const auto& to_lens = at->to_intrinsics;
    out.lens.noalias() += weight * to_lens.transpose() * to_lens;
    out.cross.noalias() += weight * to_lens.transpose() * to_pose;
    out.pose.noalias() += weight * to_pose.transpose() * to_pose;
    out.lens_gradient.noalias() += weight * to_lens.transpose() * r;
    out.pose_gradient.noalias() += weight * to_pose.transpose() * r;
  }
  return out;
}

/// Intrinsics differ by orders of magnitude: each is damped by its own curvature.
template <class Matrix>
Matrix damped(const Matrix& m, double lambda) {
  Matrix out = m;
  out.diagonal() += lambda * m.diagonal();
  out.diagonal().array() += 1e-12;
  return out;
}

}  // namespace

bool is_lens(const CameraModel& m) {
  if (!intrinsics_of(m).allFinite() || !(m.fx > 1) || !(m.fy > 1)) return false;
  const auto inside = [](double x, double low, double high) { return x > low && x < high; };
  switch (m.projection) {
    case Projection::pinhole:
      break;
    case Projection::omni:
      if (!inside(m.shape[0], -0.05, 20)) return false;
      break;
    case Projection::double_sphere:
      if (!inside(m.shape[0], -0.99, 20) || !inside(m.shape[1], 1e-4, 0.9999)) return false;
      break;
    case Projection::eucm:
      if (!inside(m.shape[0], 1e-4, 0.9999) || !inside(m.shape[1], 1e-3, 100)) return false;
      break;
  }
  return m.distortion != Distortion::fov || inside(std::abs(m.coeffs[0]), 0, 3.1);
}

LensFit fit_lens(const CameraModel& start, std::vector<BoardView> views, const std::vector<Vec3>& board,
                 double huber_px, int most_rounds, int threads) {
  LensFit fit;
  fit.model = start;
  fit.views = std::move(views);
  const auto frames = static_cast<int>(fit.views.size());
  const Eigen::Index n = intrinsics_of(start).size();
  double lambda = 1e-3;
  std::vector<FrameNormals> parts(fit.views.size());
  for (fit.rounds = 0; fit.rounds < most_rounds && !fit.converged; ++fit.rounds) {
    parallel_for(frames, threads, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      parts[k] = normals(fit.model, fit.views[k], board, huber_px);
    });
    fit.cost = 0;
    for (const FrameNormals& p : parts) fit.cost += p.cost;
    // What an undamped step still promises, in corners' variances: far below one is the end, and nothing else is. A
    // small gain alone may be the slow walk along a valley.
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd downhill = Eigen::VectorXd::Zero(n);
    double promised = 0, corners = 0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Eigen::LDLT<Mat6> pose(parts[k].pose);
      all += parts[k].lens - parts[k].cross * pose.solve(parts[k].cross.transpose());
      downhill += parts[k].lens_gradient - parts[k].cross * pose.solve(parts[k].pose_gradient);
      promised += parts[k].pose_gradient.dot(pose.solve(parts[k].pose_gradient));
      corners += static_cast<double>(fit.views[k].corners.size());
    }
    promised += downhill.dot(all.ldlt().solve(downhill));
    if (std::abs(promised) < 1e-5 * fit.cost / std::max(1.0, 2 * corners)) {
      fit.converged = true;
      break;
    }
    bool stepped = false;
    while (!stepped && lambda < 1e8) {
      Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
      std::vector<Eigen::LDLT<Mat6>> poses;
      for (const FrameNormals& p : parts) {
        poses.emplace_back(damped(p.pose, lambda));
        reduced += p.lens - p.cross * poses.back().solve(p.cross.transpose());
        gradient += p.lens_gradient - p.cross * poses.back().solve(p.pose_gradient);
      }
      const Eigen::VectorXd step = -damped(reduced, lambda).ldlt().solve(gradient);
      const CameraModel model = with_intrinsics(fit.model, intrinsics_of(fit.model) + step);
      std::vector<BoardView> moved_views = fit.views;
      double cost = std::numeric_limits<double>::infinity();
      if (is_lens(model)) {
        std::vector<double> costs(fit.views.size());
        parallel_for(frames, threads, [&](int i) {
          const auto k = static_cast<std::size_t>(i);
          const Vec6 xi = -poses[k].solve(parts[k].pose_gradient + parts[k].cross.transpose() * step);
          if (xi.allFinite()) moved_views[k].T_cam_board = moved(fit.views[k].T_cam_board, xi);
          costs[k] = frame_cost(model, moved_views[k], board, huber_px);
        });
        cost = 0;
        for (const double c : costs) cost += c;
      }
      if (cost < fit.cost) {
        stepped = true;
        fit.model = model;
        fit.views = std::move(moved_views);
        fit.cost = cost;
        lambda = std::max(1e-12, 0.1 * lambda);
      } else {
        lambda *= 5;
      }
    }
    if (!stepped) break;
  }
  parallel_for(frames, threads, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    parts[k] = normals(fit.model, fit.views[k], board, huber_px);
  });
  fit.information = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const Eigen::LDLT<Mat6> pose(parts[k].pose);
    fit.information += parts[k].lens - parts[k].cross * pose.solve(parts[k].cross.transpose());
    fit.views[k].information = parts[k].pose;
    fit.views[k].to_lens = -pose.solve(parts[k].cross.transpose());
    fit.views[k].squares = parts[k].cost;
  }
  return fit;
}

}  // namespace takt::batch
