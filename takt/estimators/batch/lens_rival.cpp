// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/lens_rival.h"

#include <algorithm>
#include <cmath>

#include "takt/estimators/batch/lens_fit.h"
#include "takt/estimators/batch/residual_field.h"

namespace takt::batch {

namespace {

constexpr std::size_t most_views = 120;
constexpr int most_rounds = 60;
constexpr double huber_sigmas = 4;

struct Kind {
  const char* name;
  Distortion distortion;
};
constexpr Kind kinds[] = {{"pinhole-radtan", Distortion::radtan}, {"pinhole-equi", Distortion::equidistant}};

std::vector<BoardView> some_of(std::span<const BoardView> views) {
  const std::size_t step = std::max<std::size_t>(1, (views.size() + most_views - 1) / most_views);
  std::vector<BoardView> out;
  for (std::size_t i = 0; i < views.size(); i += step) out.push_back(views[i]);
  return out;
}

/// A lens without any bend that sees as far as this one.
CameraModel plain(const CameraModel& like, Distortion distortion) {
  CameraModel m;
  m.width = like.width, m.height = like.height;
  m.cx = like.cx, m.cy = like.cy;
  const auto beside = like.project({0.1, 0, 1});
  m.fx = m.fy = beside ? (beside->x() - like.cx) / 0.1 : like.fx;
  m.distortion = distortion;
  return m;
}

/// What the corners still share.
ResidualField field_of(const LensFit& fit, const std::vector<Vec3>& board, double noise_px) {
  std::vector<Vec2> at, off;
  for (const BoardView& v : fit.views)
    for (const CornerObservation& c : v.corners) {
      const auto pixel = fit.model.project(v.T_cam_board * board[static_cast<std::size_t>(c.corner)]);
      if (!pixel) continue;
      at.push_back(c.pixel);
      off.push_back(*pixel - c.pixel);
    }
  return residual_field(at, off, fit.model.width, fit.model.height, noise_px);
}

/// ξ that takes the poses before to those after, in the mean.
Vec6 mean_move(std::span<const BoardView> before, std::span<const BoardView> after) {
  Vec6 sum = Vec6::Zero();
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Rigid step = after[i].T_cam_board * before[i].T_cam_board.inverse();
    Vec6 xi;
    xi << step.translation, log_so3(step.rotation);
    sum += xi / static_cast<double>(before.size());
  }
  return sum;
}

}  // namespace

std::optional<LensRival> find_lens_rival(const CameraModel& model, std::span<const BoardView> all,
                                         const std::vector<Vec3>& board, double noise_px, int threads) {
  const std::vector<BoardView> views = some_of(all);
  double residuals = 0;
  for (const BoardView& v : views) residuals += 2 * static_cast<double>(v.corners.size());
  const double huber_px = huber_sigmas * noise_px;
  const LensFit own = fit_lens(model, views, board, huber_px, most_rounds, threads);
  std::optional<LensRival> best;
  for (const Kind& kind : kinds) {
    if (model.projection == Projection::pinhole && model.distortion == kind.distortion) continue;
    const LensFit fit = fit_lens(plain(model, kind.distortion), views, board, huber_px, most_rounds, threads);
    if (!(fit.cost < own.cost) || fit.views.size() != views.size()) continue;
    const double noise = noise_px * std::sqrt(fit.cost / own.cost);
    const double shared = std::max(1.0, field_of(fit, board, noise).chi2_per_dof);
    const double gain = residuals * (own.cost / fit.cost - 1) / shared;
    if (gain < std::max(LensRival::clear_gain, best ? best->gain : 0)) continue;
    const Vec6 move = mean_move(views, fit.views);
    best = LensRival{kind.name, noise, gain, move.tail<3>().norm(), move.head<3>().norm()};
  }
  return best;
}

}  // namespace takt::batch
