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

ParallaxExpectation expected_parallax(const std::vector<Linear>& all) {
  constexpr std::size_t fewest = 30;
  // A heavy-tailed fit (Student t): stops and bursts are part of many recordings.
  constexpr double freedom = 3;
  std::vector<Vec3> seen;
  for (const Linear& l : all)
    if (l.used) seen.push_back(l.parallax);
  ParallaxExpectation out;
  if (seen.size() < fewest) return out;
  Mat3 covariance = Mat3::Identity() * 1e6;
  for (int pass = 0; pass < 10; ++pass) {
    const Mat3 inverse = covariance.inverse();
    Vec3 sum = Vec3::Zero();
    Mat3 squares = Mat3::Zero();
    double weights = 0;
    for (const Vec3& v : seen) {
      const Vec3 e = v - out.mean;
      const double w = (freedom + 3) / (freedom + e.dot(inverse * e));
      sum += w * e, squares += w * e * e.transpose(), weights += w;
    }
    out.mean += sum / weights;
    covariance = squares / static_cast<double>(seen.size()) + 1e-14 * Mat3::Identity();
  }
  // The spread of a Student t with three degrees of freedom is three times its scale matrix.
  out.information = (3 * covariance).inverse();
  return out;
}

double parallax_with_turn(const std::vector<Linear>& all) {
  const auto by_lever = [](const Linear& l) -> Mat3 {
    return exp_so3(l.predicted).toRotationMatrix() - Mat3::Identity();
  };
  // A steady way is none that goes with the turning.
  Vec3 mean_v = Vec3::Zero();
  Mat3 mean_by = Mat3::Zero();
  double n = 0, turns = 0;
  for (const Linear& l : all)
    if (l.used) mean_v += l.parallax, mean_by += by_lever(l), turns += l.predicted.squaredNorm(), n += 1;
  if (!(turns > 0)) return 0;
  mean_v /= n, mean_by /= n;
  Mat3 h = 1e-9 * Mat3::Identity();
  Vec3 g = Vec3::Zero();
  for (const Linear& l : all) {
    if (!l.used) continue;
    const Mat3 by = by_lever(l) - mean_by;
    h += by.transpose() * by, g += by.transpose() * (l.parallax - mean_v);
  }
  return std::sqrt(g.dot(h.ldlt().solve(g)) / turns);
}

}  // namespace takt::alignment
