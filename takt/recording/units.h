// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/recording/format.h"

/// Which units a log is in: told by its header, else found from the numbers, and always said in words.
namespace takt {

/// 10^exponent of a time unit against the nanosecond: s 9, ms 6, us 3, ns 0.
[[nodiscard]] int exponent_to_ns(TimeUnit unit);
[[nodiscard]] const char* to_string(TimeUnit unit);

struct FoundTimeUnit {
  TimeUnit unit;
  std::string note;
};
/// From `sample`, raw stamps in the file's order: an epoch of today, else a spacing that a sensor can have.
/// `header` is the column's name, or empty; `asked` overrules everything.
[[nodiscard]] FoundTimeUnit find_time_unit(const std::vector<double>& sample, std::string_view header, TimeUnit asked);

/// Brings `rates` to rad/s in place and says what was assumed.
[[nodiscard]] std::string to_rad_per_s(std::vector<Vec3>& rates, std::string_view header, RateUnit asked);
/// Brings `accel` to m/s² in place; the unit is taken from the header, else from the mean magnitude against gravity.
[[nodiscard]] std::string to_m_per_s2(std::vector<Vec3>& accel, std::string_view header);

/// Percentile (0 to 1) of the vectors' norms; 0 without vectors.
[[nodiscard]] double norm_percentile(const std::vector<Vec3>& v, double at);

}  // namespace takt
