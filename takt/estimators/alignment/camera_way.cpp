// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/camera_way.h"

#include <algorithm>
#include <cmath>

#include "takt/math/banded.h"
#include "takt/math/median.h"
#include "takt/motion/fit_spline.h"

namespace takt::alignment {

namespace {

constexpr std::size_t fewest_pieces = 30;
/// Beyond this a recording is mostly gap.
constexpr double most_segments = 2e6;
/// Against swings that the pieces hardly see, those of their own length or shorter; swings of twice that length are
/// damped by 1 % or so.
constexpr double stiffness = 1.25e-4;
/// σ over the median length of a normal vector of three.
constexpr double length_to_sigma = 1 / 1.538;
constexpr double freedom = 3;  ///< of the Student t by which pieces are weighed

}  // namespace

CameraWay::CameraWay(const std::vector<WayPiece>& pieces, double length_s) {
  if (pieces.size() < fewest_pieces || !(length_s > 0)) return;
  constexpr int order = 4;
  double end_s = pieces.front().t1;
  begin_s_ = pieces.front().t0;
  for (const WayPiece& p : pieces) begin_s_ = std::min(begin_s_, p.t0), end_s = std::max(end_s, p.t1);
  const double duration = end_s - begin_s_;
  if (duration / (0.25 * length_s) > most_segments) return;
  const auto knots = UniformKnots<order>::covering(duration, 0.25 * length_s);
  const double h = knots.interval_s();
  const double per_second = static_cast<double>(pieces.size()) / duration;
  const Eigen::MatrixXd gram =
      stiffness * per_second * std::pow(length_s, 4) / (h * h * h) * roughness_of_basis<order>();

  constexpr BasisMatrix<order> basis = uniform_basis<order>();
  std::vector<double> weights(pieces.size(), 1);
  for (int pass = 0; pass < 5; ++pass) {
    int bandwidth = order;
    std::vector<std::pair<KnotPlace, KnotPlace>> places;
    for (const WayPiece& p : pieces) {
      places.emplace_back(knots.locate(std::min(p.t0 - begin_s_, knots.duration_s())),
                          knots.locate(std::min(p.t1 - begin_s_, knots.duration_s())));
      bandwidth = std::max(bandwidth, places.back().second.first - places.back().first.first + order - 1);
    }
    BandedMatrix normal(knots.control_points(), bandwidth);
    Eigen::Matrix<double, Eigen::Dynamic, 3> right =
        Eigen::Matrix<double, Eigen::Dynamic, 3>::Zero(knots.control_points(), 3);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const auto& [from, to] = places[i];
      Eigen::VectorXd row = Eigen::VectorXd::Zero(to.first - from.first + order);
      row.head<order>() -= weights_at<order, 0>(basis, from.u, h).value;
      row.tail<order>() += weights_at<order, 0>(basis, to.u, h).value;
      normal.add_block(from.first, weights[i] * row * row.transpose());
      right.middleRows(from.first, row.size()) += weights[i] * row * pieces[i].moved.transpose();
    }
    for (int segment = 0; segment < knots.segments(); ++segment) normal.add_block(segment, gram);
    // Where it lies and which way it goes on the whole are nobody's to say, but have to be something.
    for (int i = 0; i < knots.control_points(); ++i) normal(i, i) += 1e-9;
    const BandedCholesky factor(std::move(normal));
    if (!factor.ok()) return;
    spline_.emplace(h, Spline::Points(factor.solve(right).transpose()));
    std::vector<double> misses;
    for (const WayPiece& p : pieces) misses.push_back((p.moved - between(p.t0, p.t1)).norm());
    const double sigma = std::max(1e-9, length_to_sigma * median(misses));
    for (std::size_t i = 0; i < pieces.size(); ++i)
      weights[i] = (freedom + 3) / (freedom + misses[i] * misses[i] / (sigma * sigma));
  }
}

Vec3 CameraWay::between(double t0, double t1) const {
  return spline_ ? Vec3((*spline_)(inside(t1)) - (*spline_)(inside(t0))) : Vec3(Vec3::Zero());
}

}  // namespace takt::alignment
