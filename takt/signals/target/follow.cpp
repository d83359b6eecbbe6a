// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/follow.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt {

namespace {

constexpr double bin_px = 4;
constexpr double widest_share = 0.16;  // of the picture's width: the largest shift looked for

/// The shift that most pairs of expected and candidate places have, to a bin.
Vec2 common_shift(const std::vector<Crossing>& expected, const std::vector<Crossing>& candidates, double widest) {
  const int half = static_cast<int>(std::ceil(widest / bin_px)), side = 2 * half + 1;
  std::vector<int> votes(static_cast<std::size_t>((side + 1) * (side + 1)), 0);
  for (const Crossing& e : expected)
    for (const Crossing& c : candidates) {
      const Vec2 shift = c.pixel - e.pixel;
      if (std::abs(shift.x()) > widest || std::abs(shift.y()) > widest || !alike(c, e)) continue;
      const int x = static_cast<int>(std::lround(shift.x() / bin_px)) + half;
      const int y = static_cast<int>(std::lround(shift.y() / bin_px)) + half;
      ++votes[static_cast<std::size_t>(y * (side + 1) + x)];
    }
  // Two by two bins, so that no shift falls between them; of equal ones the smallest shift.
  Vec2 best = Vec2::Zero();
  int most = -1;
  double nearest = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const int* v = votes.data() + y * (side + 1) + x;
      const int sum = v[0] + v[1] + v[side + 1] + v[side + 2];
      const Vec2 shift = bin_px * Vec2(x - half + 0.5, y - half + 0.5);
      if (sum > most || (sum == most && shift.squaredNorm() < nearest)) {
        most = sum;
        best = shift;
        nearest = shift.squaredNorm();
      }
    }
  return best;
}

using Affine = Eigen::Matrix<double, 2, 3>;

/// Each expected place's nearest candidate within a radius.
std::vector<std::optional<Vec2>> nearest(const std::vector<Crossing>& expected, const std::vector<Crossing>& candidates,
                                         const Affine& map, double radius) {
  std::vector<std::optional<Vec2>> out;
  for (const Crossing& e : expected) {
    const Vec2 at = map * e.pixel.homogeneous();
    double best = radius * radius;
    std::optional<Vec2> met;
    for (const Crossing& c : candidates)
      if (const double d = (c.pixel - at).squaredNorm(); d < best && alike(c, e)) {
        best = d;
        met = c.pixel;
      }
    out.push_back(met);
  }
  return out;
}

/// Least squares, with less weight for those that are further off (Cauchy), from the present map.
Affine fit(const std::vector<Crossing>& expected, const std::vector<std::optional<Vec2>>& met, Affine map,
           double scale) {
  for (int round = 0; round < 3; ++round) {
    Mat3 A = 1e-9 * Mat3::Identity();
    Eigen::Matrix<double, 3, 2> b = Eigen::Matrix<double, 3, 2>::Zero();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!met[i]) continue;
      const Vec3 x = expected[i].pixel.homogeneous();
      const double w = 1 / (1 + (map * x - *met[i]).squaredNorm() / (scale * scale));
      A += w * x * x.transpose();
      b += w * x * met[i]->transpose();
    }
    map = Mat3(A).ldlt().solve(b).transpose();
  }
  return map;
}

}  // namespace

bool alike(const Crossing& a, const Crossing& b) {
  constexpr double pi = std::numbers::pi;
  const double turn = std::abs(std::remainder(a.light_rad - b.light_rad, pi));
  return turn < 0.45;
}

std::vector<std::optional<Vec2>> follow(const std::vector<Crossing>& expected, const std::vector<Crossing>& candidates,
                                        int width, int height) {
  if (expected.size() < 8 || candidates.size() < 8) return {};
  Affine map = Affine::Identity();
  map.col(2) = common_shift(expected, candidates, std::max(40.0, widest_share * width));
  std::vector<std::optional<Vec2>> met;
  for (const double radius : {14.0, 9.0, 6.0, 4.0}) {
    met = nearest(expected, candidates, map, radius);
    map = fit(expected, met, map, 0.4 * radius);
    if (!map.allFinite() || map.leftCols<2>().determinant() < 0.3 || map.leftCols<2>().determinant() > 3) return {};
  }
  met = nearest(expected, candidates, map, 3.5);
  std::size_t should = 0, found = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Vec2 at = map * expected[i].pixel.homogeneous();
    const bool in_picture = at.x() > 12 && at.y() > 12 && at.x() < width - 13 && at.y() < height - 13;
    should += in_picture ? 1 : 0;
    found += in_picture && met[i] ? 1 : 0;
  }
  if (found < 8 || 2 * found < should) return {};
  return met;
}

}  // namespace takt
