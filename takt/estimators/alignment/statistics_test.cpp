// SPDX-License-Identifier: Apache-2.0
// A σ is a promise: error/σ over many recordings is standard normal. bench/accuracy/alignment.cpp is the full study.
#include <gtest/gtest.h>

#include <cmath>

#include "takt/estimators/alignment/alignment.h"
#include "takt/math/parallel.h"
#include "tests/alignment_cases.h"

namespace takt {
namespace {

using cases::Scenario;
using cases::Sensor;

/// Two-sided: an honest estimator fails a bound once in a thousand choices of the seeds. Three bounds a test (mean,
/// variance from below and above together count as one, 4σ: 6e-5 a run) make a false alarm about once in 400.
constexpr double z_bound = 3.29;

/// χ² of n degrees of freedom at the normal quantile z [Wilson1931].
double chi_square_at(double n, double z) {
  const double a = 2 / (9 * n);
  return n * std::pow(1 - a + z * std::sqrt(a), 3);
}

struct Statistics {
  int runs = 0, answered = 0, beyond = 0;
  double sum = 0, squares = 0;
};

Statistics errors_over_sigma(const Scenario& scenario, int seeds) {
  std::vector<Estimate> found(static_cast<std::size_t>(seeds));
  std::vector<double> error(found.size());
  parallel_for(seeds, 0, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const cases::Recorded r = cases::record(scenario, static_cast<std::uint64_t>(i + 1));
    found[k] = align_rotation(r.sensor, r.reference);
    if (found[k].answered()) error[k] = cases::offset_error_s(found[k], r.truth);
  });
  Statistics s;
  s.runs = seeds;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (found[k].verdict != Verdict::trusted) continue;
    const double z = error[k] / *found[k].sigma_s;
    ++s.answered;
    s.sum += z, s.squares += z * z;
    s.beyond += std::abs(z) > 4;
  }
  return s;
}

void expect_standard_normal(const Statistics& s) {
  // Good recordings: an estimator that is right only where it dares is none.
  EXPECT_GE(s.answered, 0.9 * s.runs);
  const double n = s.answered;
  EXPECT_LT(std::abs(s.sum / std::sqrt(n)), z_bound) << "mean of error/σ " << s.sum / n;
  EXPECT_LT(s.squares, chi_square_at(n, z_bound))
      << "rms of error/σ " << std::sqrt(s.squares / n) << ": σ is too small";
  EXPECT_GT(s.squares, chi_square_at(n, -z_bound))
      << "rms of error/σ " << std::sqrt(s.squares / n) << ": σ is too large";
  EXPECT_EQ(s.beyond, 0) << "trusted and beyond 4σ";
}

TEST(AlignmentStatistics, GyroAgainstGyro) {
  expect_standard_normal(errors_over_sigma({.name = "gyro", .sensor = Sensor::gyro, .duration_s = 20}, 40));
}

TEST(AlignmentStatistics, TracksAgainstGyro) {
  expect_standard_normal(errors_over_sigma({.name = "tracks", .duration_s = 12}, 24));
}

/// Some seconds of slow motion correlate with one second of any other by chance. That makes no rival of it.
TEST(AlignmentStatistics, AChanceLikenessIsNoRival) {
  parallel_for(12, 0, [](int i) {
    const cases::Recorded r =
        cases::record({.name = "short and slow", .motion = "weak", .duration_s = 8}, static_cast<std::uint64_t>(i + 1));
    const Estimate found = align_rotation(r.sensor, r.reference);
    for (const std::string& reason : found.reasons) EXPECT_EQ(reason.find("two offsets"), std::string::npos) << reason;
    if (found.verdict == Verdict::trusted) {
      EXPECT_LT(std::abs(cases::offset_error_s(found, r.truth)), 4 * *found.sigma_s) << "seed " << i + 1;
    }
  });
}

/// A tracker's shifted windows were measured to have their centre of contrast some two pixels beside the corner.
TEST(AlignmentStatistics, FeaturesThatKeepTheirErrors) {
  expect_standard_normal(errors_over_sigma({.name = "windows", .duration_s = 10, .window_error_px = 2}, 16));
}

}  // namespace
}  // namespace takt
