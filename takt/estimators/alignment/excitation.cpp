// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/excitation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "takt/math/median.h"

namespace takt::alignment {

namespace {

/// Rms along the principal axes, largest first, of rates whose mean is removed (a constant bias is no motion).
template <class Rate>
Vec3 principal_rms(std::size_t n, const Rate& rate) {
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i) mean += rate(i) / static_cast<double>(n);
  Mat3 c = Mat3::Zero();
  for (std::size_t i = 0; i < n; ++i) c += (rate(i) - mean) * (rate(i) - mean).transpose() / static_cast<double>(n);
  const Vec3 values = Eigen::SelfAdjointEigenSolver<Mat3>(c).eigenvalues();
  return Vec3(values[2], values[1], values[0]).cwiseMax(0).cwiseSqrt();
}

/// A motion that could be told from noise at all: the strongest axis half above it.
bool still(const Vec3& rms, double noise) {
  return rms[0] < 1.5 * noise + 1e-6;
}

}  // namespace

bool Excitation::sensor_still() const {
  return still(sensor_rms, sensor_noise);
}
bool Excitation::reference_still() const {
  return still(reference_rms, reference_noise);
}

Excitation measure_excitation(const Problem& problem) {
  Excitation e;
  const auto& steps = problem.steps;
  e.sensor_rms =
      principal_rms(steps.size(), [&](std::size_t i) { return Vec3(steps[i].apparent / (steps[i].t1 - steps[i].t0)); });
  std::vector<double> noise;
  for (const Step& s : steps) noise.push_back(std::sqrt(3 / std::max(1e-12, s.information.trace())) / (s.t1 - s.t0));
  e.sensor_noise = median(std::move(noise));

  // The gyro averaged over steps of the sensor, so that its white noise is counted as the comparison will see it.
  const auto rates = problem.reference.rates();
  const auto block =
      static_cast<std::size_t>(std::max(1.0, std::round(problem.step_s / problem.reference.median_step_s())));
  std::vector<Vec3> means;
  for (std::size_t i = 0; i + block <= rates.size(); i += block) {
    Vec3 m = Vec3::Zero();
    for (std::size_t k = 0; k < block; ++k) m += rates[i + k] / static_cast<double>(block);
    means.push_back(m);
  }
  if (means.empty()) return e;
  e.reference_rms = principal_rms(means.size(), [&](std::size_t i) { return means[i]; });
  e.reference_noise =
      problem.reference.noise_density() / std::sqrt(static_cast<double>(block) * problem.reference.median_step_s());
  return e;
}

}  // namespace takt::alignment
