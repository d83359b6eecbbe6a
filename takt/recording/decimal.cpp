// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/decimal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

namespace takt {

namespace {

constexpr int most_digits = 19;  // of an uint64 that cannot overflow

constexpr auto powers_of_ten = [] {
  std::array<std::uint64_t, most_digits + 1> p{};
  p[0] = 1;
  for (std::size_t i = 1; i < p.size(); ++i) p[i] = p[i - 1] * 10;
  return p;
}();

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// value · 10^scale = digits before any sign is put on.
std::optional<std::uint64_t> scaled(std::uint64_t value, int scale) {
  if (value == 0) return 0;
  if (scale > most_digits) return std::nullopt;
  if (scale >= 0) {
    const std::uint64_t factor = powers_of_ten[static_cast<std::size_t>(scale)];
    if (value > std::numeric_limits<std::uint64_t>::max() / factor) return std::nullopt;
    return value * factor;
  }
  if (scale < -most_digits) return 0;
  const std::uint64_t divisor = powers_of_ten[static_cast<std::size_t>(-scale)];
  const std::uint64_t rest = value % divisor;
  return value / divisor + (rest >= divisor - rest ? 1 : 0);
}

}  // namespace

std::optional<std::int64_t> decimal_to_ns(std::string_view text, int exponent_to_ns) {
  const char* p = text.data();
  const char* const end = p + text.size();
  bool negative = false;
  if (p != end && (*p == '-' || *p == '+')) negative = *p++ == '-';

  std::uint64_t value = 0;
  int digits = 0, scale = exponent_to_ns;
  bool any = false;
  const auto take = [&](bool fraction) {
    for (; p != end && is_digit(*p); ++p) {
      any = true;
      if (digits < most_digits) {
        value = value * 10 + static_cast<std::uint64_t>(*p - '0');
        digits += value != 0;
        scale -= fraction;
      } else {
        scale += !fraction;
      }
    }
  };
  take(false);
  if (p != end && *p == '.') {
    ++p;
    take(true);
  }
  if (!any) return std::nullopt;
  if (p != end && (*p == 'e' || *p == 'E')) {
    ++p;
    if (p + 1 < end && *p == '+' && is_digit(p[1])) ++p;
    int exponent = 0;
    const auto [stop, failed] = std::from_chars(p, end, exponent);
    if (failed != std::errc{} || std::abs(exponent) > 400) return std::nullopt;
    p = stop;
    scale += exponent;
  }
  if (p != end) return std::nullopt;
  const auto magnitude = scaled(value, scale);
  if (!magnitude || *magnitude > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    return std::nullopt;
  const auto ns = static_cast<std::int64_t>(*magnitude);
  return negative ? -ns : ns;
}

std::string decimal_of_ns(std::int64_t ns, int exponent_to_ns, int decimals) {
  const auto magnitude = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  const auto places = static_cast<std::size_t>(exponent_to_ns);
  std::string digits = std::to_string(magnitude);
  if (digits.size() <= places) digits.insert(0, places + 1 - digits.size(), '0');
  std::string behind = digits.substr(digits.size() - places);
  digits.resize(digits.size() - places);
  const auto least = static_cast<std::size_t>(std::max(decimals, 0));
  while (behind.size() > least && behind.back() == '0') behind.pop_back();
  if (behind.size() < least) behind.resize(least, '0');
  return (ns < 0 ? "-" : "") + digits + (behind.empty() ? "" : "." + behind);
}

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

std::optional<double> finite_double(std::string_view text) {
  const char* first = text.data();
  const char* const end = first + text.size();
  if (first != end && *first == '+') ++first;
  double value = 0;
  const auto [stop, failed] = std::from_chars(first, end, value);
  if (failed != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace takt
