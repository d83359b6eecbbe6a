// SPDX-License-Identifier: Apache-2.0
#include "takt/math/long_run_variance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt {

namespace {

/// Levinson–Durbin: x_i = Σ a_k·x_{i−k} + e_i, order by order; the density at zero is var(e) / (1 − Σ a_k)².
double density_at_zero(const std::vector<double>& covariance, double n) {
  std::vector<double> a;
  double error = covariance[0], best = error;
  double least = n * std::log(error);
  for (std::size_t p = 1; p < covariance.size(); ++p) {
    double reflection = covariance[p];
    for (std::size_t k = 1; k < p; ++k) reflection -= a[k - 1] * covariance[p - k];
    reflection /= error;
    const std::vector<double> before = a;
    for (std::size_t k = 1; k < p; ++k) a[k - 1] -= reflection * before[p - k - 1];
    a.push_back(reflection);
    error *= 1 - reflection * reflection;
    if (!(error > 0)) break;
    const double akaike = n * std::log(error) + 2 * static_cast<double>(p);
    if (akaike >= least) continue;
    least = akaike;
    double sum = 0;
    for (const double c : a) sum += c;
    best = error / ((1 - sum) * (1 - sum));
  }
  return best;
}

}  // namespace

double long_run_variance(std::span<const double> x, int max_order, double fitted) {
  const std::size_t count = x.size();
  if (count < 10) throw std::invalid_argument("long_run_variance: " + std::to_string(count) + " samples, 10 needed");
  const std::size_t orders = std::min(static_cast<std::size_t>(std::max(max_order, 0)), count / 10);
  const double n = static_cast<double>(count);
  double mean = 0;
  for (const double v : x) mean += v / n;
  std::vector<double> covariance(orders + 1, 0);
  for (std::size_t lag = 0; lag <= orders; ++lag) {
    for (std::size_t i = lag; i < count; ++i) covariance[lag] += (x[i] - mean) * (x[i - lag] - mean);
    covariance[lag] /= n;
  }
  if (!(covariance[0] > 0)) return 0;

  double density = density_at_zero(covariance, n);
  if (!(fitted > 0)) return density;
  for (int round = 0; round < 4; ++round) {
    std::vector<double> whole = covariance;
    for (double& c : whole) c += density * std::min(fitted / n, 0.5);
    density = density_at_zero(whole, n);
  }
  return density;
}

}  // namespace takt
