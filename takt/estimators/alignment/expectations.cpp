// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/expectations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/math/median.h"

namespace takt::alignment {

double relative_variance(const std::vector<Linear>& all, double scale, double before) {
  std::vector<double> turns;
  for (const Linear& l : all)
    if (l.used) turns.push_back(l.predicted.squaredNorm());
  if (turns.size() < 40) return before;
  const auto quarter = turns.begin() + static_cast<std::ptrdiff_t>(3 * turns.size() / 4);
  std::nth_element(turns.begin(), quarter, turns.end());
  const double most = *quarter;
  std::vector<double> excess;
  for (const Linear& l : all) {
    if (!l.used || l.predicted.squaredNorm() < most) continue;
    // The claimed part shrinks with whatever relative error is already allowed for, so put that back.
    const double claimed = scale * scale * 3 / std::max(1e-30, (l.root * l.root).trace() / 3) / 3;
    const double turn = l.predicted.squaredNorm();
    excess.push_back((l.rows.col(unknowns).squaredNorm() / 2.366 - std::max(0.0, claimed - before * turn)) / turn);
  }
  return std::clamp(median(std::move(excess)), 0.0, 0.25);
}

namespace {

using Six = Eigen::Matrix<double, 6, 1>;
using Six6 = Eigen::Matrix<double, 6, 6>;
using Row = Eigen::Matrix<double, 3, 6>;

struct SeenParallax {
  Vec3 v;
  Row by;  ///< mean, and lever
};

struct ParallaxFit {
  Six x = Six::Zero();
  Six6 information = Six6::Zero();
  Mat3 spread;
};

/// A heavy-tailed fit (Student t): stops and bursts are part of many recordings.
ParallaxFit fit_parallax(const std::vector<SeenParallax>& seen, double lever_most) {
  constexpr double freedom = 3;
  ParallaxFit fit;
  Mat3 covariance = Mat3::Identity() * 1e6;
  for (int pass = 0; pass < 10; ++pass) {
    const Mat3 inverse = covariance.inverse();
    Six6 h = Six6::Zero();
    Six g = Six::Zero();
    Mat3 squares = Mat3::Zero();
    for (const SeenParallax& s : seen) {
      const Vec3 e = s.v - s.by * fit.x;
      const double w = (freedom + 3) / (freedom + e.dot(inverse * e));
      h += w * s.by.transpose() * inverse * s.by;
      g += w * s.by.transpose() * inverse * e;
      squares += w * e * e.transpose();
    }
    h.diagonal().tail<3>().array() += 1 / (lever_most * lever_most);
    g.tail<3>() -= fit.x.tail<3>() / (lever_most * lever_most);
    fit.x += h.ldlt().solve(g);
    fit.information = h;
    covariance = squares / static_cast<double>(seen.size()) + 1e-14 * Mat3::Identity();
  }
  // The spread of a Student t with three degrees of freedom is three times its scale matrix.
  fit.spread = 3 * covariance;
  return fit;
}

}  // namespace

ParallaxExpectation expected_parallax(const std::vector<Linear>& all, double overlap) {
  std::vector<SeenParallax> seen;
  for (const Linear& l : all) {
    if (!l.used) continue;
    SeenParallax s{l.parallax, Row::Zero()};
    s.by.leftCols<3>().setIdentity();
    s.by.rightCols<3>() = exp_so3(l.predicted).toRotationMatrix() - Mat3::Identity();
    seen.push_back(s);
  }
  ParallaxExpectation out;
  if (seen.size() < 30) return out;
  // The lever is not used to expect a pair's own parallax: over a short recording it would explain what it should not.
  constexpr double none = 1e-6, lever_most = 0.3;
  const ParallaxFit plain = fit_parallax(seen, none), levered = fit_parallax(seen, lever_most);
  out.mean = plain.x.head<3>();
  out.information = plain.spread.inverse();
  out.lever = levered.x.tail<3>();
  // Neighbours share their motion, for about twice as long as they run.
  out.lever_sigma = std::sqrt(2 * overlap * levered.information.inverse().bottomRightCorner<3, 3>().trace() / 3);
  return out;
}

}  // namespace takt::alignment
