// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/time/instant.h"

/// Numbers as people read them: with their uncertainty, its unit, and no digit more than it supports.
namespace takt {

/// Digits after the point that a σ supports: two of its digits where it starts with 1, 2 or a small 3, else one
/// (the rounding rule of the Particle Data Group's Review, section 5.3 of its introduction). 0 where σ is not positive.
[[nodiscard]] int decimals_for(double sigma);

/// "12.34 ± 0.08", "(1.22 ± 0.05)e-08" where that would be a row of zeros; six significant digits where σ is unknown.
[[nodiscard]] std::string value_words(double value, std::optional<double> sigma);

/// "12.34 ± 0.08 ms", in the unit (ns, µs, ms, s) that suits the larger of the two. Every nanosecond of an int64 is
/// kept.
[[nodiscard]] std::string time_words(Duration value, std::optional<double> sigma_s);
[[nodiscard]] std::string time_words(double value_s, std::optional<double> sigma_s);
/// A σ or a scatter by itself, with the digits that it would get behind a ±: "0.08 ms".
[[nodiscard]] std::string rounded_time_words(double sigma_s);

}  // namespace takt
