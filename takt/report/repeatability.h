// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

namespace takt {

/// How well repeated calibrations of one pair of sensors agree. Refused results do not count as answers.
struct Repeatability {
  std::string sensor;
  std::string reference;
  std::vector<std::size_t> members;  ///< which of the results are of this pair
  std::size_t answers = 0;
  std::optional<Duration> mean;
  std::optional<double> std_s;    ///< sample standard deviation (n − 1); from two answers on
  std::optional<double> sigma_s;  ///< root mean square of the stated σ, where all answers state one

  /// Above 1 the results scatter more than they admit.
  [[nodiscard]] std::optional<double> scatter_over_sigma() const;
};

/// One for each pair of sensors, in the order of their first result.
[[nodiscard]] std::vector<Repeatability> repeatability(const std::vector<Estimate>& results);

/// "5 answers: mean 12.34 ± 0.04 ms, standard deviation 0.09 ms, 1.1 times what the stated σ … leads one to expect"
[[nodiscard]] std::string in_words(const Repeatability& r);
/// One JSON object: {"repeatability": [{"sensor", "reference", "results", "answers", "mean_s", "std_s", "sigma_s"}]}
[[nodiscard]] std::string to_json(const std::vector<Repeatability>& pairs);

}  // namespace takt
