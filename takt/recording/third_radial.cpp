// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/third_radial.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace takt {

double fold_third_radial(CameraModel& m, double k3) {
  if (k3 == 0) return 0;
  const double x = std::max(m.cx, m.width - 1 - m.cx) / m.fx, y = std::max(m.cy, m.height - 1 - m.cy) / m.fy;
  const double corner = std::hypot(x, y);
  // Least squares of r³ d1 + r⁵ d2 = r⁷ k3, each r as often as it occurs in a circle: weight r.
  constexpr int steps = 200;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Vec2 right = Vec2::Zero();
  for (int i = 1; i <= steps; ++i) {
    const double r = corner * i / steps;
    const Vec2 row(std::pow(r, 3), std::pow(r, 5));
    normal += r * row * row.transpose();
    right += r * row * std::pow(r, 7) * k3;
  }
  const Vec2 moved = normal.fullPivLu().solve(right);
  m.coeffs[0] += moved[0];
  m.coeffs[1] += moved[1];
  double worst = 0;
  for (int i = 1; i <= steps; ++i) {
    const double r = corner * i / steps;
    worst = std::max(worst, std::abs(std::pow(r, 3) * moved[0] + std::pow(r, 5) * moved[1] - std::pow(r, 7) * k3));
  }
  return worst * std::max(m.fx, m.fy);
}

}  // namespace takt
