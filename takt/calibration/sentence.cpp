// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <cmath>

#include "takt/calibration/estimate.h"
#include "takt/calibration/words.h"

namespace takt {

namespace {

/// A drift worth saying: the offset then holds only at the epoch.
std::string drift_words(const Estimate& e) {
  if (!e.drift || *e.drift == 0) return "";
  if (e.drift_sigma && std::abs(*e.drift) < 3 * *e.drift_sigma) return "";
  std::optional<double> sigma_ppm;
  if (e.drift_sigma) sigma_ppm = 1e6 * *e.drift_sigma;
  return fmt::format(", drifting by {} ppm", value_words(1e6 * *e.drift, sigma_ppm));
}

}  // namespace

std::string sentence(const Estimate& e) {
  const std::string reason = e.reasons.empty() ? "no reason given" : e.reasons.front();
  const std::string sensor = e.sensor.empty() ? "the sensor" : e.sensor;
  const std::string reference = e.reference.empty() ? "the reference" : e.reference;
  if (!e.answered()) return fmt::format("{} against {}: refused: {}", sensor, reference, reason);
  const bool early = e.offset->count() >= 0;
  const std::string verdict = e.verdict == Verdict::weak ? "weak: " + reason : to_string(e.verdict);
  const Duration size = early || *e.offset == Duration::min() ? *e.offset : -*e.offset;
  return fmt::format("{} is {} {} against {}{} ({})", sensor, time_words(size, e.sigma_s), early ? "early" : "late",
                     reference, drift_words(e), verdict);
}

}  // namespace takt
