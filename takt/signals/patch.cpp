// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/patch.h"

#include <Eigen/LU>
#include <cmath>

namespace takt {

namespace {

constexpr int most_rounds = 12;
constexpr double settled_px = 0.003;
/// A corner of two straight edges looks the same however it is stretched along them: the shape is held this loosely
/// (grey levels), so that it does not run away.
constexpr double shape_stiffness = 20;
constexpr double flattest = 1;     ///< rms grey levels
constexpr double farthest_px = 3;  ///< from the start: beyond it is another place

/// Bilinear; the caller stays inside.
float grey_at(const GrayImage& p, double x, double y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const auto fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
  const std::uint8_t* at = p.pixels + iy * p.stride + ix;
  const float top = static_cast<float>(at[0]) + fx * static_cast<float>(at[1] - at[0]);
  const float bottom = static_cast<float>(at[p.stride]) + fx * static_cast<float>(at[p.stride + 1] - at[p.stride]);
  return top + fy * (bottom - top);
}

bool inside(const GrayImage& p, const PatchPlace& place, double half) {
  const Vec2 reach = half * place.shape.cwiseAbs().rowwise().sum();
  return place.at.x() - reach.x() >= 0 && place.at.y() - reach.y() >= 0 && place.at.x() + reach.x() < p.width - 1 &&
         place.at.y() + reach.y() < p.height - 1;
}

/// Grey values at the patch's points, row by row.
void sample(const GrayImage& p, const PatchPlace& place, int side, std::vector<float>& out) {
  const int half = side / 2;
  out.resize(static_cast<std::size_t>(side * side));
  std::size_t i = 0;
  for (int y = -half; y <= half; ++y) {
    Vec2 at = place.at + place.shape * Vec2(-half, y);
    for (int x = -half; x <= half; ++x, ++i, at += place.shape.col(0)) out[i] = grey_at(p, at.x(), at.y());
  }
}

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  float sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Takes the mean off; returns the norm of what is left.
double centre(std::vector<float>& v) {
  float mean = 0;
  for (const float x : v) mean += x;
  mean /= static_cast<float>(v.size());
  for (float& x : v) x -= mean;
  return std::sqrt(dot(v, v));
}

}  // namespace

std::optional<Patch> Patch::cut(const GrayImage& picture, const Vec2& at, int side) {
  const int wide = side + 2;
  if (!inside(picture, {at, Eigen::Matrix2d::Identity()}, wide / 2)) return std::nullopt;
  std::vector<float> around;
  sample(picture, {at, Eigen::Matrix2d::Identity()}, wide, around);

  Patch p;
  p.side_ = side;
  const auto count = static_cast<std::size_t>(side * side);
  p.grey_.resize(count);
  for (auto& j : p.by_unknown_) j.resize(count);
  std::size_t i = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x, ++i) {
      const float* g = around.data() + (y + 1) * wide + x + 1;
      const float gx = 0.5f * (g[1] - g[-1]), gy = 0.5f * (g[wide] - g[-wide]);
      const auto dx = static_cast<float>(x - side / 2), dy = static_cast<float>(y - side / 2);
      p.grey_[i] = g[0];
      p.by_unknown_[0][i] = gx * dx, p.by_unknown_[1][i] = gy * dx;  // the shape, column by column
      p.by_unknown_[2][i] = gx * dy, p.by_unknown_[3][i] = gy * dy;
      p.by_unknown_[4][i] = gx, p.by_unknown_[5][i] = gy;
    }
  p.norm_ = centre(p.grey_);
  if (!(p.norm_ > flattest * side)) return std::nullopt;
  for (auto& j : p.by_unknown_) {
    centre(j);
    const auto share = static_cast<float>(dot(j, p.grey_) / (p.norm_ * p.norm_));
    for (std::size_t k = 0; k < count; ++k) j[k] -= share * p.grey_[k];
  }
  Solver normal;
  for (int a = 0; a < unknowns; ++a)
    for (int b = 0; b < unknowns; ++b)
      normal(a, b) = dot(p.by_unknown_[static_cast<std::size_t>(a)], p.by_unknown_[static_cast<std::size_t>(b)]);
  normal.diagonal().head<4>().array() += shape_stiffness * shape_stiffness;
  const Eigen::FullPivLU<Solver> lu(normal);
  if (!lu.isInvertible()) return std::nullopt;
  p.inverse_normal_ = lu.inverse();
  return p;
}

std::optional<Patch::Found> Patch::find(const GrayImage& picture, const PatchPlace& start) const {
  Found found{start, 0};
  std::vector<float> seen;
  for (int round = 0; round < most_rounds; ++round) {
    if (!inside(picture, found.place, side_ / 2) || !((found.place.at - start.at).norm() < farthest_px))
      return std::nullopt;
    sample(picture, found.place, side_, seen);
    const double norm = centre(seen);
    if (!(norm > 0)) return std::nullopt;
    found.correlation = dot(seen, grey_) / (norm * norm_);
    const auto gain = static_cast<float>(norm_ / norm);
    for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = gain * seen[i] - grey_[i];
    Eigen::Matrix<double, unknowns, 1> gradient;
    for (int k = 0; k < unknowns; ++k) gradient[k] = dot(by_unknown_[static_cast<std::size_t>(k)], seen);
    const Eigen::Matrix<double, unknowns, 1> step = inverse_normal_ * gradient;
    // The patch would fit the picture if it were warped by the step; so the place is warped by its inverse.
    Eigen::Matrix2d warp = Eigen::Matrix2d::Identity();
    warp.col(0) += step.head<2>();
    warp.col(1) += step.segment<2>(2);
    if (!(warp.determinant() > 0.5)) return std::nullopt;
    found.place.shape = (found.place.shape * warp.inverse()).eval();
    const Vec2 move = found.place.shape * step.tail<2>();
    found.place.at -= move;
    if (!found.place.at.allFinite()) return std::nullopt;
    if (move.norm() < settled_px) return found;
  }
  return std::nullopt;
}

}  // namespace takt
