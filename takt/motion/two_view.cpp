// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/two_view.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "takt/math/median.h"

namespace takt {

namespace {

constexpr Eigen::Index min_matches = 6;
/// Residuals beyond this many sigmas lose weight as 1/r² (Cauchy-like, so that gross outliers hardly pull).
constexpr double robust_scale = 2.5;
constexpr double outlier_sigmas = 4;

using Tangent = Eigen::Matrix<double, 2, 3>;

/// Two unit vectors across a unit vector.
Tangent tangent(const Vec3& a) {
  const Vec3 helper = std::abs(a.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  Tangent e;
  const Vec3 u = a.cross(helper).normalized();
  e.row(0) = u;
  e.row(1) = a.cross(u);
  return e;
}

/// σ of a normal variable over the median of its magnitude.
constexpr double mad_to_sigma = 1.4826;

/// The matches in their tangent planes, linearised at a rotation.
struct Linearised {
  std::vector<Vec2> residual;        ///< from − p
  std::vector<Tangent> basis;        ///< d residual / d v, before the parallax scale
  std::vector<Tangent> by_rotation;  ///< d residual / d δ
  std::vector<double> scale;         ///< of v, given from outside
  std::vector<Vec2> extra;           ///< likewise, beside v: d residual
  std::vector<double> nearness;      ///< of v, measured: inverse depth over the mean's

  Linearised(const BearingPairs& pairs, const Quat& rotation) {
    const Mat3 r = rotation.toRotationMatrix();
    const auto n = static_cast<std::size_t>(pairs.from.cols());
    residual.resize(n), basis.resize(n), by_rotation.resize(n), scale.assign(n, 1.0), nearness.assign(n, 1.0);
    extra.assign(n, Vec2::Zero());
    for (std::size_t i = 0; i < n; ++i) {
      const auto c = static_cast<Eigen::Index>(i);
      const Vec3 p = r * pairs.to.col(c);
      basis[i] = tangent(p);
      residual[i] = basis[i] * (pairs.from.col(c) - p);
      // R·exp(δ)·to = p + R·(δ × to) = p − hat(p)·R·δ, so the prediction moves by that much.
      by_rotation[i] = -basis[i] * hat(p) * r;
      if (pairs.parallax_scale.size() > 0) scale[i] = pairs.parallax_scale[c];
      if (pairs.parallax_extra.cols() > 0) extra[i] = basis[i] * pairs.parallax_extra.col(c);
    }
  }
  [[nodiscard]] std::size_t size() const { return residual.size(); }
  [[nodiscard]] Tangent by_parallax(std::size_t i) const { return scale[i] * nearness[i] * basis[i]; }
  /// The displacement that v makes at the mean's depth.
  [[nodiscard]] Vec2 along(std::size_t i, const Vec3& v) const { return scale[i] * (basis[i] * v) + extra[i]; }
  /// What is left for δ and v.
  [[nodiscard]] Vec2 wanted(std::size_t i) const { return residual[i] - nearness[i] * extra[i]; }
  [[nodiscard]] Vec2 after(std::size_t i, const Vec3& v) const { return wanted(i) - by_parallax(i) * v; }
};

/// Inverse covariance of a match's residual, in units of 1/(2σ²): one across the parallax, less along it.
/// `shared` matches are taken to err together along it.
Eigen::Matrix2d weight(const Linearised& l, std::size_t i, const Vec3& v, double sigma, double depth_scatter,
                       double shared) {
  const Vec2 along = l.along(i, v);
  const double ratio = depth_scatter * depth_scatter * shared / (2 * sigma * sigma);
  // (I + ratio·a·aᵀ)⁻¹ = I − a·aᵀ·ratio/(1 + ratio·|a|²)
  return Eigen::Matrix2d::Identity() - along * along.transpose() * (ratio / (1 + ratio * along.squaredNorm()));
}

struct Noise {
  double sigma;                ///< one bearing, one axis
  std::vector<double> misfit;  ///< in sigmas
};

/// Noise from the residuals across the parallax, where nothing else should be left.
Noise measure_noise(const Linearised& l, const Vec3& v, double sigma_before, const TwoViewOptions& options) {
  Noise out;
  out.misfit.resize(l.size());
  std::vector<double> across(l.size());
  const double all = static_cast<double>(l.size());
  for (std::size_t i = 0; i < l.size(); ++i) {
    const Vec2 e = l.after(i, v);
    const Vec2 along = l.along(i, v);
    const double length = along.norm();
    const Vec2 normal = length > 0 ? Vec2(-along.y() / length, along.x() / length) : Vec2(0, 1);
    across[i] = std::abs(normal.dot(e));
    out.misfit[i] = std::sqrt(e.dot(weight(l, i, v, sigma_before, options.depth_scatter, all) * e));
  }
  // Six unknowns (rotation and parallax) were fitted to n residuals of one dimension each.
  const double sigma =
      mad_to_sigma * median(std::move(across)) / std::sqrt(2.0) * std::sqrt(all / std::max(1.0, all - 5));
  out.sigma = std::max(options.sigma_floor_rad, sigma);
  for (double& m : out.misfit) m /= std::sqrt(2.0) * out.sigma;
  return out;
}

double robust_weight(double misfit) {
  const double r = misfit / robust_scale;
  return 1 / (1 + r * r * r * r);
}

/// v for δ = 0, by robust least squares; noise and weights settle with it.
struct ParallaxFit {
  Vec3 v = Vec3::Zero();
  Noise noise;
};

/// Each match's own nearness: its part of the displacement along v over the mean's. Trusted as far as it stands out of
/// the noise; where it does not, the match is as near as the mean. Without this a wrong direction of v, which moves
/// near points more than far ones, would be taken for a rotation.
void measure_nearness(Linearised& l, const Vec3& v, double sigma, double depth_scatter) {
  for (std::size_t i = 0; i < l.size(); ++i) {
    const Vec2 along = l.along(i, v);
    const double signal = depth_scatter * depth_scatter * along.squaredNorm(), noise = 2 * sigma * sigma;
    const double seen = along.squaredNorm() > 0 ? along.dot(l.residual[i]) / along.squaredNorm() : 1;
    l.nearness[i] = std::clamp((signal * seen + noise) / (signal + noise), 0.0, 5.0);
  }
}

ParallaxFit fit_parallax(Linearised& l, const TwoViewOptions& options) {
  ParallaxFit fit;
  fit.noise = measure_noise(l, fit.v, 1e9, options);
  for (int pass = 0; pass < 8; ++pass) {
    Mat3 h = Mat3::Zero();
    Vec3 g = Vec3::Zero();
    for (std::size_t i = 0; i < l.size(); ++i) {
      // Its length is the mean of the along-components, its direction what leaves least across it.
      const Eigen::Matrix2d w =
          robust_weight(fit.noise.misfit[i]) * (pass < 3 || !options.measure_nearness
                                                    ? Eigen::Matrix2d::Identity().eval()
                                                    : weight(l, i, fit.v, fit.noise.sigma, options.depth_scatter, 1));
      const Tangent b = l.by_parallax(i);
      h += b.transpose() * w * b;
      g += b.transpose() * (w * l.wanted(i));
    }
    h.diagonal().array() += 1e-12 * h.trace();
    const Vec3 v = h.ldlt().solve(g);
    const bool settled = (v - fit.v).norm() < 1e-2 * fit.noise.sigma;
    fit.v = v;
    if (options.measure_nearness) measure_nearness(l, fit.v, fit.noise.sigma, options.depth_scatter);
    fit.noise = measure_noise(l, fit.v, fit.noise.sigma, options);
    if (settled && pass >= 3) break;
  }
  return fit;
}

TwoViewNormals normals(const Linearised& l, const ParallaxFit& fit, std::span<const Eigen::Matrix3Xd> extra,
                       const TwoViewOptions& options) {
  const auto e = static_cast<Eigen::Index>(extra.size());
  const Eigen::Index m = 3 + e;
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(m + 3, m + 3);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(m + 3);
  Eigen::MatrixXd row(2, m + 3);
  Eigen::MatrixXd each(m + 3, options.each_match ? static_cast<Eigen::Index>(l.size()) : 0);
  std::size_t explained = 0;
  for (std::size_t i = 0; i < l.size(); ++i) {
    const double misfit = fit.noise.misfit[i];
    if (misfit < outlier_sigmas) ++explained;
    const Eigen::Matrix2d w = robust_weight(misfit) * weight(l, i, fit.v, fit.noise.sigma, options.depth_scatter,
                                                             static_cast<double>(l.size()));
    row.leftCols<3>() = l.by_rotation[i];
    for (Eigen::Index k = 0; k < e; ++k)
      row.col(3 + k) = -l.basis[i] * extra[static_cast<std::size_t>(k)].col(static_cast<Eigen::Index>(i));
    row.rightCols<3>() = l.by_parallax(i);
    full.noalias() += row.transpose() * w * row;
    const Vec2 weighted = w * l.wanted(i);
    g.noalias() += row.transpose() * weighted;
    if (options.each_match) each.col(static_cast<Eigen::Index>(i)).noalias() = row.transpose() * weighted;
  }
  const double noise_var = 2 * fit.noise.sigma * fit.noise.sigma;
  full /= noise_var;
  g /= noise_var;
  Mat3 vv = full.bottomRightCorner<3, 3>();
  vv += options.parallax_information;
  g.tail<3>() += options.parallax_information * options.parallax_mean;
  vv.diagonal().array() += 1e-12 * vv.trace();
  const Eigen::MatrixXd cross = full.topRightCorner(m, 3);
  const Eigen::MatrixXd gain = vv.ldlt().solve(cross.transpose()).transpose();
  TwoViewNormals out;
  out.information = full.topLeftCorner(m, m) - gain * cross.transpose();
  out.gradient = g.head(m) - gain * g.tail<3>();
  if (options.each_match) out.each = (each.topRows(m) - gain * each.bottomRows<3>()) / noise_var;
  out.parallax = fit.v;
  out.sigma_rad = fit.noise.sigma;
  out.explained = static_cast<double>(explained) / static_cast<double>(l.size());
  return out;
}

/// The rotation on which most matches roughly agree: two-match hypotheses, scored by truncated angles.
Quat consensus_rotation(const BearingPairs& pairs) {
  const Eigen::Index n = pairs.from.cols();
  const auto score = [&](const Mat3& r, double cut) {
    double sum = 0;
    for (Eigen::Index i = 0; i < n; ++i)
      sum += std::min((pairs.from.col(i) - r * pairs.to.col(i)).squaredNorm(), cut * cut);
    return sum;
  };
  Mat3 best = Mat3::Identity();
  // Half the matches should pass the cut under the best hypothesis; start from the flow's own size.
  std::vector<double> flow;
  for (Eigen::Index i = 0; i < n; ++i) flow.push_back((pairs.from.col(i) - pairs.to.col(i)).norm());
  const double cut = std::max(1e-4, 0.5 * median(std::move(flow)));
  double best_score = score(best, cut);
  std::uint64_t state = 0x9E3779B97F4A7C15u;  // any fixed start: the result must not depend on the caller's history
  const auto pick = [&] {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return static_cast<Eigen::Index>(state % static_cast<std::uint64_t>(n));
  };
  for (int trial = 0; trial < 40; ++trial) {
    const Eigen::Index i = pick(), j = pick();
    if (i == j || pairs.to.col(i).cross(pairs.to.col(j)).norm() < 0.02) continue;
    Mat3 correlation =
        pairs.from.col(i) * pairs.to.col(i).transpose() + pairs.from.col(j) * pairs.to.col(j).transpose();
    const Mat3 r = align_vectors(correlation).rotation;
    const double s = score(r, cut);
    if (s < best_score) best_score = s, best = r;
  }
  return Quat(best);
}

}  // namespace

std::optional<TwoViewNormals> two_view_normals(const BearingPairs& pairs, const Quat& R_from_to,
                                               std::span<const Eigen::Matrix3Xd> extra, const TwoViewOptions& options) {
  if (pairs.from.cols() < min_matches) return std::nullopt;
  Linearised l(pairs, R_from_to);
  const ParallaxFit fit = fit_parallax(l, options);
  return normals(l, fit, extra, options);
}

std::optional<MatchWeights> weigh_matches(const BearingPairs& pairs, const Quat& R_from_to,
                                          const TwoViewOptions& options) {
  if (pairs.from.cols() < min_matches) return std::nullopt;
  Linearised l(pairs, R_from_to);
  const ParallaxFit fit = fit_parallax(l, options);
  return MatchWeights{fit.v,
                      fit.noise.sigma,
                      {l.nearness.begin(), l.nearness.end()},
                      {fit.noise.misfit.begin(), fit.noise.misfit.end()}};
}

TwoViewNormals two_view_normals(const BearingPairs& pairs, const Quat& R_from_to, const MatchWeights& weights,
                                std::span<const Eigen::Matrix3Xd> extra, const TwoViewOptions& options) {
  Linearised l(pairs, R_from_to);
  if (weights.nearness.size() != l.size() || weights.misfit.size() != l.size())
    throw std::invalid_argument("two_view_normals: weights for other matches");
  l.nearness.assign(weights.nearness.begin(), weights.nearness.end());
  const ParallaxFit kept{weights.parallax, {weights.sigma_rad, {weights.misfit.begin(), weights.misfit.end()}}};
  return normals(l, kept, extra, options);
}

std::optional<TwoViewFit> fit_two_view(const BearingPairs& pairs, const TwoViewOptions& options) {
  if (pairs.from.cols() < min_matches) return std::nullopt;
  Quat rotation = consensus_rotation(pairs);
  for (int pass = 0; pass < 12; ++pass) {
    Linearised l(pairs, rotation);
    const ParallaxFit fit = fit_parallax(l, options);
    const TwoViewNormals n = normals(l, fit, {}, options);
    Mat3 h = n.information;
    h.diagonal().array() += 1e-9 * h.trace();
    const Vec3 step = h.ldlt().solve(Vec3(n.gradient));
    if (!step.allFinite()) return std::nullopt;
    rotation = (rotation * exp_so3(step)).normalized();
    const bool settled = step.norm() < 1e-2 * n.sigma_rad;
    if (!settled && pass < 11) continue;
    TwoViewFit out{rotation, n.information, n.parallax, n.sigma_rad, n.explained, {}};
    out.misfit = Eigen::Map<const Eigen::VectorXd>(fit.noise.misfit.data(), static_cast<Eigen::Index>(l.size()));
    return out;
  }
  return std::nullopt;
}

}  // namespace takt
