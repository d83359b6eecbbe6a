// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

namespace takt {

/// How the answers follow something that changes from one calibration to the next: a least-squares line.
struct Trend {
  std::string against;  ///< "temperature" or "date"
  std::string unit;     ///< of what it is against: "K", "h", "day"
  double slope_s = 0;   ///< offset per unit
  double sigma_s = 0;   ///< of the slope, from the scatter about the line
  double span = 0;      ///< over which it was seen, in units
  std::size_t answers = 0;

  /// As rare by chance as 3 σ, with as few answers as there are: Student's t as a normal deviate, [Wallace1959].
  [[nodiscard]] bool significant() const;
};

/// Answers of about the same temperature, as [Fu2021] tables 6 and 7 have them.
struct TemperatureBin {
  double mean_c = 0;
  double half_width_c = 0;  ///< half the range of temperatures in it
  std::size_t answers = 0;
  Duration mean{0};
  std::optional<double> std_s;
};

/// How well repeated calibrations of one pair of sensors agree. Refused results do not count as answers.
struct Repeatability {
  std::string sensor;
  std::string reference;
  std::vector<std::size_t> members;  ///< which of the results are of this pair
  std::size_t answers = 0;
  std::optional<Duration> mean;
  std::optional<double> std_s;        ///< sample standard deviation (n − 1); from two answers on
  std::optional<double> sigma_s;      ///< root mean square of the stated σ, where all answers state one
  std::vector<std::size_t> outliers;  ///< which results are far from the others: beyond 5 robust σ of their median
  std::vector<Trend> trends;          ///< against the date, and the temperature (extra `temperature_c`) where known
  std::vector<TemperatureBin> bins;   ///< where temperatures are known, in rising order

  /// Above 1 the results scatter more than they admit.
  [[nodiscard]] std::optional<double> scatter_over_sigma() const;
};

/// One for each pair of sensors, in the order of their first result.
[[nodiscard]] std::vector<Repeatability> repeatability(const std::vector<Estimate>& results);

/// "5 answers: mean 12.34 ± 0.04 ms, standard deviation 0.09 ms, 1.1 times what the stated σ … leads one to expect";
/// then outliers by their names, trends that are significant, and a line a temperature.
/// `names` are the results' files; without them outliers are counted from 1.
[[nodiscard]] std::string in_words(const Repeatability& r, const std::vector<std::string>& names = {});
/// One JSON object: {"repeatability": [{"sensor", "reference", "results", "answers", "mean_s", "std_s", "sigma_s",
/// "outliers", "trends", "temperatures"}]}
[[nodiscard]] std::string to_json(const std::vector<Repeatability>& pairs);

}  // namespace takt
