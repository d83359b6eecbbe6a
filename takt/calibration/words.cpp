// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/words.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace takt {

namespace {

struct TimeUnit {
  const char* name;
  long double ns;
};
constexpr std::array<TimeUnit, 4> time_units{{{"s", 1e9L}, {"ms", 1e6L}, {"µs", 1e3L}, {"ns", 1}}};

const TimeUnit& unit_for(long double size_ns) {
  for (const TimeUnit& u : time_units)
    if (size_ns >= u.ns) return u;
  return size_ns == 0 ? time_units.front() : time_units.back();
}

bool known(std::optional<double> sigma) {
  return sigma && std::isfinite(*sigma) && *sigma > 0;
}

/// "-0.00" is a zero.
std::string without_minus_zero(std::string s) {
  return s.starts_with('-') && s.find_first_of("123456789") == s.npos ? s.substr(1) : s;
}

/// fmt 9 drops zeros of a long double that rounds up: 0.0999… with two decimals would be "0.1".
std::string fixed(long double v, int decimals) {
  std::array<char, 400> text;  // a Duration has 19 digits, a σ in ns at most 317 before the point
  const auto end = std::to_chars(text.data(), text.data() + text.size(), v, std::chars_format::fixed, decimals).ptr;
  return {text.data(), end};
}

std::string without_trailing_zeros(std::string digits) {
  if (digits.find('.') == digits.npos) return digits;
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.ends_with('.')) digits.pop_back();
  return digits;
}

std::string nanosecond_words(long double ns, std::optional<double> sigma_s) {
  const long double sigma_ns = known(sigma_s) ? 1e9L * static_cast<long double>(*sigma_s) : 0;
  const TimeUnit& unit = unit_for(std::max(std::abs(ns), sigma_ns));
  if (sigma_ns == 0) {
    const int to_the_nanosecond = static_cast<int>(std::log10(unit.ns) + 0.5L);
    return without_trailing_zeros(fixed(ns / unit.ns, to_the_nanosecond)) + " " + unit.name;
  }
  const int decimals = decimals_for(static_cast<double>(sigma_ns / unit.ns));
  return without_minus_zero(fixed(ns / unit.ns, decimals)) + " ± " + fixed(sigma_ns / unit.ns, decimals) + " " +
         unit.name;
}

}  // namespace

int decimals_for(double sigma) {
  if (!known(sigma)) return 0;
  int exponent = static_cast<int>(std::floor(std::log10(sigma)));
  double lead = sigma / std::pow(10.0, exponent);
  if (lead >= 9.5) {  // rounds up to the next power of ten
    lead = 1;
    ++exponent;
  }
  return std::max(0, (lead < 3.55 ? 1 : 0) - exponent);
}

std::string value_words(double value, std::optional<double> sigma) {
  if (!known(sigma)) return without_minus_zero(fmt::format("{:.6g}", value));
  if (const double size = std::max(std::abs(value), *sigma); size < 1e-4) {
    const int exponent = static_cast<int>(std::floor(std::log10(size)));
    const double unit = std::pow(10.0, exponent);
    return fmt::format("({})e{:+03d}", value_words(value / unit, *sigma / unit), exponent);
  }
  const int decimals = decimals_for(*sigma);
  return without_minus_zero(fmt::format("{:.{}f}", value, decimals)) + fmt::format(" ± {:.{}f}", *sigma, decimals);
}

std::string time_words(Duration value, std::optional<double> sigma_s) {
  return nanosecond_words(static_cast<long double>(value.count()), sigma_s);
}

std::string time_words(double value_s, std::optional<double> sigma_s) {
  return std::isfinite(value_s) ? nanosecond_words(1e9L * static_cast<long double>(value_s), sigma_s) : "unknown";
}

std::string rounded_time_words(double sigma_s) {
  if (!known(sigma_s)) return time_words(sigma_s, std::nullopt);
  const long double sigma_ns = 1e9L * static_cast<long double>(sigma_s);
  const TimeUnit& unit = unit_for(sigma_ns);
  return fixed(sigma_ns / unit.ns, decimals_for(static_cast<double>(sigma_ns / unit.ns))) + " " + unit.name;
}

}  // namespace takt
