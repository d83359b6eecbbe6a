// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/inflation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>

namespace takt::alignment {

namespace {

/// Weight falls as 1/m⁴ beyond this many sigmas.
constexpr double robust_sigmas = 3;
constexpr std::size_t fewest_scores = 40, fewest_clusters = 20;

/// How all unknowns move with one once they are fitted: its own score is the rows along this.
State direction_of(const Normal& shape, Unknown unknown) {
  return shape.row(unknown).transpose() / shape(unknown, unknown);
}

std::vector<double> scores_in_time(const Scores& s, const State& direction) {
  std::vector<std::size_t> order(s.items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return s.items[a].t0 + s.items[a].t1 < s.items[b].t0 + s.items[b].t1;
  });
  std::vector<double> out;
  for (const std::size_t i : order)
    if (s.steps[i].used)
      out.push_back((s.whitened[i].leftCols<unknowns>() * direction).dot(s.whitened[i].col(unknowns)));
  return out;
}

/// The score is linear in the residual rotations: each one's factor in it. Whitening is a causal filter, so its
/// transpose is the same filter run backward.
std::vector<Vec3> factors_of(const Scores& s, const State& direction) {
  std::vector<Vec3> factors(s.steps.size(), Vec3::Zero());
  Whitener<Vec3> whiten(s.errors);
  bool restart = true;
  for (std::size_t i = s.steps.size(); i-- > 0;) {
    const Linear& l = s.steps[i];
    if (l.used) {
      if (restart) whiten.restart();
      const double misfit = (l.root * l.rows.col(unknowns)).norm() / (s.scale * std::sqrt(3.0));
      const Vec3 backward = whiten(Vec3(s.whitened[i].leftCols<unknowns>() * direction));
      factors[i] = std::sqrt(weight_of(misfit)) * l.root * backward;
    }
    restart = !l.used || l.first;
  }
  return factors;
}

}  // namespace

double weight_of(double misfit) {
  const double r = misfit / robust_sigmas;
  return 1 / (1 + r * r * r * r);
}

double inflation_by_time(const Scores& s, const Normal& shape, Unknown unknown) {
  const std::vector<double> score = scores_in_time(s, direction_of(shape, unknown));
  double power = 0;
  for (const double x : score) power += x * x;
  if (power <= 0 || score.size() < fewest_scores) return 1;
  const double n = static_cast<double>(score.size());
  const auto lags =
      static_cast<std::size_t>(std::min(n / 5, std::max(2.5 * s.overlap, std::min(12.0, 1.5 * std::cbrt(n)))));
  double sum = power;
  for (std::size_t lag = 1; lag <= lags; ++lag) {
    double c = 0;
    for (std::size_t i = lag; i < score.size(); ++i) c += score[i] * score[i - lag];
    sum += 2 * (1 - static_cast<double>(lag) / static_cast<double>(lags + 1)) * c;
  }
  // The ratio itself scatters by some √(4·lags/3n); within that it is no evidence.
  const double ratio = sum / power;
  const double scatter = std::sqrt(4.0 * static_cast<double>(lags) / (3.0 * n));
  return ratio > 1 + scatter ? std::sqrt(ratio) : 1;
}

double inflation_by_feature(const Scores& s, const std::vector<Eigen::Matrix3Xd>& by_match, const Normal& shape,
                            Unknown unknown, double s2) {
  const State direction = direction_of(shape, unknown);
  const std::vector<Vec3> factors = factors_of(s, direction);
  std::unordered_map<std::int64_t, double> clusters;
  double independent = 0;
  for (std::size_t i = 0; i < s.items.size(); ++i) {
    independent += s2 * (s.whitened[i].leftCols<unknowns>() * direction).squaredNorm();
    for (Eigen::Index k = 0; k < by_match[i].cols(); ++k)
      clusters[(*s.items[i].matches)[static_cast<std::size_t>(k)].id] += factors[i].dot(by_match[i].col(k));
  }
  if (clusters.size() < fewest_clusters || !(independent > 0)) return 1;
  double clustered = 0;
  for (const auto& [id, score] : clusters) clustered += score * score;
  const double n = static_cast<double>(clusters.size());
  return std::sqrt(std::max(1.0, clustered / independent * n / (n - 1)));
}

double inflation_by_window(std::span<const WindowOffset> windows) {
  double chi2 = 0, freedom = -1;
  for (const WindowOffset& w : windows) {
    if (!(w.sigma_s > 0)) continue;
    // A single wild one is for the doubts to report.
    chi2 += std::min(16.0, w.offset_s * w.offset_s / (w.sigma_s * w.sigma_s)), freedom += 1;
  }
  if (freedom < 3) return 1;
  const double ratio = chi2 / freedom;
  return ratio > 1 + 1.5 * std::sqrt(2 / freedom) ? std::sqrt(ratio) : 1;
}

}  // namespace takt::alignment
