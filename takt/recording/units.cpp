// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/units.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "takt/math/median.h"

namespace takt {

namespace {

constexpr double standard_gravity_m_s2 = 9.80665;
constexpr double rad_per_deg = std::numbers::pi / 180;

struct Named {
  TimeUnit unit;
  const char* name;
  int exponent;
};
constexpr std::array<Named, 4> time_units{
    {{TimeUnit::s, "s", 9}, {TimeUnit::ms, "ms", 6}, {TimeUnit::us, "us", 3}, {TimeUnit::ns, "ns", 0}}};

/// The words of a column's name in lower case: "timestamp [ns]" -> timestamp, ns.
std::vector<std::string> words(std::string_view name) {
  std::vector<std::string> out(1);
  for (const char c : name) {
    const bool letter = std::isalnum(static_cast<unsigned char>(c)) || static_cast<unsigned char>(c) >= 0x80;
    if (letter)
      out.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!out.back().empty())
      out.emplace_back();
  }
  return out;
}

bool has_word(std::string_view name, std::initializer_list<const char*> any) {
  const auto in_name = words(name);
  return std::any_of(any.begin(), any.end(),
                     [&](const char* w) { return std::find(in_name.begin(), in_name.end(), w) != in_name.end(); });
}

std::optional<TimeUnit> unit_in_header(std::string_view name) {
  if (has_word(name, {"ns", "nsec", "nanoseconds", "nanos"})) return TimeUnit::ns;
  if (has_word(name, {"us", "usec", "microseconds", "micros", "\xc2\xb5s", "\xce\xbcs"})) return TimeUnit::us;
  if (has_word(name, {"ms", "msec", "milliseconds", "millis"})) return TimeUnit::ms;
  if (has_word(name, {"s", "sec", "secs", "seconds"})) return TimeUnit::s;
  return std::nullopt;
}

/// Stamps of 2001 to 2100 as Unix time say their unit by magnitude alone: the units are 1000 apart.
std::optional<TimeUnit> unit_of_epoch(double stamp) {
  for (const Named& u : time_units) {
    const double s = stamp * std::pow(10.0, u.exponent - 9);
    if (s > 1.0e9 && s < 4.1e9) return u.unit;
  }
  return std::nullopt;
}

/// Median of the positive steps; 0 where there is none.
double median_step(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) steps.push_back(stamps[i] - stamps[i - 1]);
  if (steps.empty()) return 0;
  return median(std::move(steps));
}

double rate_hz(double step, TimeUnit unit) {
  return std::pow(10.0, 9 - exponent_to_ns(unit)) / step;
}

void scale(std::vector<Vec3>& values, double by) {
  for (Vec3& v : values) v *= by;
}

double mean_norm(const std::vector<Vec3>& v) {
  double sum = 0;
  for (const Vec3& x : v) sum += x.norm();
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}

}  // namespace

int exponent_to_ns(TimeUnit unit) {
  for (const Named& u : time_units)
    if (u.unit == unit) return u.exponent;
  return 0;
}

const char* to_string(TimeUnit unit) {
  for (const Named& u : time_units)
    if (u.unit == unit) return u.name;
  return "automatic";
}

double norm_percentile(const std::vector<Vec3>& v, double at) {
  if (v.empty()) return 0;
  std::vector<double> norms(v.size());
  std::transform(v.begin(), v.end(), norms.begin(), [](const Vec3& x) { return x.norm(); });
  const auto place = norms.begin() + static_cast<std::ptrdiff_t>(at * static_cast<double>(norms.size() - 1));
  std::nth_element(norms.begin(), place, norms.end());
  return *place;
}

FoundTimeUnit find_time_unit(const std::vector<double>& sample, std::string_view header, TimeUnit asked) {
  const double step = median_step(sample);
  const auto said = [&](TimeUnit unit, const std::string& why) {
    const std::string rate = step > 0 ? fmt::format(", {:.4g} Hz", rate_hz(step, unit)) : "";
    return FoundTimeUnit{unit, fmt::format("time taken as {} ({}{})", to_string(unit), why, rate)};
  };
  if (asked != TimeUnit::automatic) return said(asked, "as asked");
  if (const auto unit = unit_in_header(header)) return said(*unit, fmt::format("from the header '{}'", header));
  // A phone that has been on for twelve days counts as many ns as Unix time has µs, but its spacing is no sensor's then.
  constexpr double slowest_hz = 0.9;
  if (!sample.empty())
    if (const auto unit = unit_of_epoch(sample.front()); unit && !(step > 0 && rate_hz(step, *unit) < slowest_hz))
      return said(*unit, "from the magnitude: Unix time");
  if (!(step > 0)) return said(TimeUnit::s, "a guess: too few stamps to tell; --time-unit says it");

  // Sensors give 5 to 5000 samples a second; the units being 1000 apart, just one of them fits.
  for (const Named& u : time_units)
    if (const double rate = rate_hz(step, u.unit); rate >= 5 && rate < 5000) {
      const bool near_the_edge = rate < 10 || rate > 2500;
      return said(u.unit, near_the_edge ? "from the spacing, not surely; --time-unit overrules" : "from the spacing");
    }
  const bool slow = rate_hz(step, TimeUnit::s) < 5;
  return said(slow ? TimeUnit::ns : TimeUnit::s, "a guess: the spacing fits no unit; --time-unit says it");
}

std::string to_rad_per_s(std::vector<Vec3>& rates, std::string_view header, RateUnit asked) {
  const double typical = norm_percentile(rates, 0.5), high = norm_percentile(rates, 0.99);
  if (asked == RateUnit::rad_s) return "rates taken as rad/s (as asked)";
  if (asked == RateUnit::deg_s) {
    scale(rates, rad_per_deg);
    return "rates taken as deg/s (as asked)";
  }
  const auto from_header = [&](double unit_rad_s, const char* unit) {
    scale(rates, unit_rad_s);
    return fmt::format("rates taken as {} (from the header '{}')", unit, header);
  };
  if (has_word(header, {"mdeg", "mdps", "mdegps", "millidegrees"})) return from_header(1e-3 * rad_per_deg, "mdeg/s");
  if (has_word(header, {"mrad", "mrads", "mradps", "milliradians"})) return from_header(1e-3, "mrad/s");
  if (has_word(header, {"deg", "degs", "dps", "degps", "degrees"}) || header.find("\xc2\xb0") != header.npos)
    return from_header(rad_per_deg, "deg/s");
  if (has_word(header, {"rad", "rads", "radps", "radians"})) {
    const char* doubt = high > 35 ? ", yet beyond 35 rad/s: are they deg/s? --rate-unit overrules" : "";
    return fmt::format("rates taken as rad/s (from the header '{}'{})", header, doubt);
  }
  // No gyro that is held or mounted measures 4000 deg/s.
  if (high > 4000) {
    scale(rates, 1e-3 * rad_per_deg);
    return fmt::format(
        "rates taken as mdeg/s (median {:.3g}, 99 % below {:.3g}: too fast for deg/s; --rate-unit overrules)", typical,
        high);
  }
  // 35 rad/s is the full scale of common gyros (2000 deg/s), and nothing handled turns at 5 rad/s half of the time.
  if (high > 35 || typical > 5) {
    scale(rates, rad_per_deg);
    return fmt::format(
        "rates taken as deg/s (median {:.3g}, 99 % below {:.3g}: too fast for rad/s; --rate-unit overrules)", typical,
        high);
  }
  const char* doubt = high > 12 ? "fast for rad/s: are they deg/s? " : "";
  return fmt::format("rates taken as rad/s (median {:.3g}, 99 % below {:.3g}; {}--rate-unit overrules)", typical, high,
                     doubt);
}

std::string to_m_per_s2(std::vector<Vec3>& accel, std::string_view header) {
  const double mean = mean_norm(accel);
  const auto found = [&](double unit_m_s2, const char* unit, const std::string& why) {
    if (unit_m_s2 != 1) scale(accel, unit_m_s2);
    return fmt::format("accelerations taken as {} ({})", unit, why);
  };
  const std::string from_header = fmt::format("from the header '{}'", header);
  if (has_word(header, {"mg"})) return found(standard_gravity_m_s2 * 1e-3, "mg", from_header);
  if (has_word(header, {"g"})) return found(standard_gravity_m_s2, "g", from_header);
  if (has_word(header, {"m"})) return found(1, "m/s2", from_header);
  const std::string from_mean = fmt::format("mean magnitude {:.3g}", mean);
  if (mean > 0.7 && mean < 1.5) return found(standard_gravity_m_s2, "g", from_mean);
  if (mean > 700 && mean < 1500) return found(standard_gravity_m_s2 * 1e-3, "mg", from_mean);
  if (mean > 7 && mean < 15) return found(1, "m/s2", from_mean);
  return found(1, "m/s2", from_mean + ", which is no gravity in any unit");
}

}  // namespace takt
