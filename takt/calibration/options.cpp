// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/options.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "takt/calibration/tree.h"

namespace takt {

namespace {

struct Unit {
  const char* suffix;
  const char* name;
};
// Longer suffixes first: rad/s before s.
constexpr std::array<Unit, 12> units{{{"_rad_s", "rad/s"},
                                      {"_deg_s", "deg/s"},
                                      {"_ppm", "ppm"},
                                      {"_deg", "deg"},
                                      {"_rad", "rad"},
                                      {"_ms", "ms"},
                                      {"_us", "µs"},
                                      {"_ns", "ns"},
                                      {"_hz", "Hz"},
                                      {"_px", "px"},
                                      {"_m", "m"},
                                      {"_s", "s"}}};

}  // namespace

OptionName option_name(const std::string& field) {
  OptionName name{field, ""};
  for (const Unit& u : units)
    if (const std::string suffix = u.suffix; name.flag.size() > suffix.size() && name.flag.ends_with(suffix)) {
      name = {field.substr(0, field.size() - suffix.size()), u.name};
      break;
    }
  std::replace(name.flag.begin(), name.flag.end(), '_', '-');
  return name;
}

std::string option_value(bool v) {
  return v ? "on" : "off";
}
std::string option_value(double v) {
  return fmt::format("{}", v);
}
std::string option_value(const std::string& v) {
  return v;
}

std::string options_table(const std::vector<OptionRow>& rows) {
  std::string out = "| option | unit | default | meaning |\n|---|---|---|---|\n";
  for (const OptionRow& row : rows) {
    const OptionName name = option_name(row.field);
    out += fmt::format("| `--{}` | {} | {} | {} |\n", name.flag, name.unit, row.value, row.help);
  }
  return out;
}

std::string options_json(const std::vector<OptionRow>& rows) {
  tree::Node out = tree::object();
  for (const OptionRow& row : rows) out.add(row.field, tree::text(row.value));
  return tree::to_json(out);
}

}  // namespace takt
