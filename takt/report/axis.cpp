// SPDX-License-Identifier: Apache-2.0
#include "takt/report/axis.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace takt::report {

namespace {

bool prefixable(const std::string& unit) {
  static const std::array<const char*, 7> bare{"s", "rad", "rad/s", "m", "m/s", "m/s²", "Hz"};
  return std::find(bare.begin(), bare.end(), unit) != bare.end();
}

const char* prefix(int exponent) {
  switch (exponent) {
    case -9:
      return "n";
    case -6:
      return "µ";
    case -3:
      return "m";
    case 3:
      return "k";
    case 6:
      return "M";
    default:
      return nullptr;
  }
}

std::string superscript(int n) {
  static const std::array<const char*, 10> digit{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = n < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(n))) out += digit[static_cast<std::size_t>(c - '0')];
  return out;
}

/// The power of a thousand that brings `size` between 1 and 1000; seconds above one stay seconds.
int exponent_for(double size, const std::string& unit) {
  if (size <= 0 || (size >= (prefixable(unit) ? 0.5 : 1e-3) && size < 1e5)) return 0;
  const int exponent = 3 * static_cast<int>(std::floor(std::log10(size) / 3 + 1e-9));
  return unit == "s" ? std::clamp(exponent, -9, 0) : exponent;
}

std::string with_minus(std::string s) {
  if (s.find_first_of("123456789") == s.npos && s.starts_with('-')) s.erase(0, 1);
  return s.starts_with('-') ? "−" + s.substr(1) : s;
}

}  // namespace

double nice_step(double width, int about) {
  const double raw = width / std::max(about, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double lead : {1.0, 2.0, 5.0})
    if (lead * power >= raw * (1 - 1e-9)) return lead * power;
  return 10 * power;
}

std::vector<Tick> Axis::ticks(int about) const {
  const double low = (range.low - base) * factor, high = (range.high - base) * factor;
  const double step = nice_step(high - low, about);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  std::vector<Tick> out;
  for (double k = std::ceil(low / step - 1e-6); k * step <= high + 1e-6 * step; ++k)
    out.push_back({base + k * step / factor, with_minus(fmt::format("{:.{}f}", k * step, decimals))});
  return out;
}

std::string Axis::label() const {
  std::string out = name;
  if (base != 0) out += fmt::format(" {} {:.12g}{}", base > 0 ? "−" : "+", std::abs(base), base_unit);
  if (unit.empty()) return out;
  return out.empty() ? unit : out + ", " + unit;
}

Axis make_axis(const std::string& name, const std::string& unit, Range range) {
  Axis axis;
  axis.name = name;
  if (!std::isfinite(range.low) || !std::isfinite(range.high) || range.low > range.high) range = {0, 1};
  if (range.width() <= 1e-12 * std::max(std::abs(range.low), 1e-300)) {
    const double pad = range.low == 0 ? 1 : 1e-3 * std::abs(range.low);
    range = {range.low - pad, range.high + pad};
  }
  axis.range = range;
  const double size = std::max(std::abs(range.low), std::abs(range.high));
  if (size > 1e4 * range.width()) {
    const double grain = std::pow(10.0, std::ceil(std::log10(range.width())));
    axis.base = std::floor(range.low / grain) * grain;
  }
  const double shown = std::max(std::abs(range.low - axis.base), std::abs(range.high - axis.base));
  const int exponent = exponent_for(shown, unit);
  axis.factor = std::pow(10.0, -exponent);
  axis.unit = unit;
  axis.base_unit = unit.empty() ? "" : " " + unit;
  if (exponent == 0) return axis;
  if (const char* p = prefix(exponent); p && prefixable(unit))
    axis.unit = p + unit;
  else
    axis.unit = "10" + superscript(exponent) + (unit.empty() ? "" : " " + unit);
  return axis;
}

}  // namespace takt::report
