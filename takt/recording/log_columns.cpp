// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/log_columns.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "takt/error.h"

namespace takt {

namespace {

const char* const expected = "takt reads t,wx,wy,wz[,ax,ay,az] or t,angle; name the columns so in the first line";

/// A column's name without its unit: "w_RS_S_x [rad s^-1]" -> "w_rs_s_x", "GyroX (deg/s)" -> "gyrox"; Betaflight counts
/// its axes: "gyroADC[1]" -> "gyroadc_y".
std::string plain_name(const std::string& name) {
  std::string out;
  if (const std::size_t at = name.find('['); at != std::string::npos && at + 2 < name.size() && name[at + 2] == ']' &&
                                             name[at + 1] >= '0' && name[at + 1] <= '2')
    return plain_name(name.substr(0, at) + "_" + static_cast<char>('x' + (name[at + 1] - '0')));
  for (const char c : name.substr(0, name.find_first_of("[(")))
    out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  while (!out.empty() && out.back() == ' ') out.pop_back();
  return out;
}

bool is_time(const std::string& name) {
  for (const char* word : {"t", "ts", "time", "timestamp", "stamp", "timestamps", "timestamp_ns", "seconds_elapsed"})
    if (name == word) return true;
  for (const char* prefix : {"t_", "time_", "ts_", "time ", "timestamp_", "timestamp "})
    if (name.starts_with(prefix)) return true;
  for (const char* ending : {"timestamp", "nanos", "millis"})  // phones': sensorTimestamp, elapsedRealtimeNanos
    if (name.ends_with(ending)) return true;
  return name.ends_with("_time") || name.ends_with(" time");
}

bool is_angle(const std::string& name) {
  return name.starts_with("angle") || name.starts_with("theta") || name.ends_with("angle") ||
         name.ends_with("_angle_rad");
}

enum class Kind { gyro, accel, bare, other };

/// What a triple of columns measures, by the part of its names before the axis.
Kind kind_of(const std::string& prefix) {
  const auto has = [&](std::initializer_list<const char*> parts) {
    return std::any_of(parts.begin(), parts.end(), [&](const char* p) { return prefix.find(p) != prefix.npos; });
  };
  if (prefix == "w" || prefix == "g" || has({"gyr", "omega", "angular", "w_rs", "rate", "rotation"})) return Kind::gyro;
  if (prefix == "a" || has({"acc", "alpha", "linear", "a_rs"})) return Kind::accel;
  if (has({"mag", "pos", "vel", "quat", "grav", "bias", "gps", "lat", "lon", "alt", "orient", "axis", "setpoint",
           "command", "motor", "debug"}))
    return Kind::other;
  return prefix.size() == 1 ? Kind::other : Kind::bare;
}

/// "gyro_x" -> ("gyro", 0); "wz_rad_s" -> ("w", 2); nothing for a name without axis.
std::optional<std::pair<std::string, std::size_t>> axis_of(std::string name) {
  for (const char* unit : {"_mdeg_s", "_mrad_s", "_rad_s", "_deg_s", "_m_s2",   "_mdps",  "_radps",  "_degps",
                           "_dps",    "_rads",   "_mps2",  "_mg",    "_g",      "_rad/s", "_mdeg/s", "_deg/s",
                           "_m/s2",   "_m/s^2",  " rad/s", " deg/s", " mdeg/s", " m/s2",  " m/s^2"})
    if (name.ends_with(unit)) {
      name.resize(name.size() - std::char_traits<char>::length(unit));
      break;
    }
  if (name.empty() || name.back() < 'x' || name.back() > 'z') return std::nullopt;
  const auto axis = static_cast<std::size_t>(name.back() - 'x');
  name.pop_back();
  while (!name.empty() && (name.back() == '_' || name.back() == '.' || name.back() == ' ' || name.back() == '-'))
    name.pop_back();
  return std::pair{name, axis};
}

std::string listed(const TableShape& shape, const std::array<std::size_t, 3>& columns) {
  return fmt::format("{}, {}, {}", shape.names[columns[0]], shape.names[columns[1]], shape.names[columns[2]]);
}

LogColumns by_names(const TableShape& shape, const std::string& where) {
  LogColumns found;
  std::optional<std::size_t> time;
  std::vector<std::pair<std::string, std::array<std::optional<std::size_t>, 3>>> triples;  // in the file's order
  for (std::size_t i = 0; i < shape.columns; ++i) {
    const std::string name = plain_name(shape.names[i]);
    if (is_time(name)) {
      if (!time) time = i;
    } else if (is_angle(name)) {
      if (!found.angle) found.angle = i;
    } else if (const auto axis = axis_of(name)) {
      auto triple = std::find_if(triples.begin(), triples.end(), [&](const auto& t) { return t.first == axis->first; });
      if (triple == triples.end()) triple = triples.insert(triples.end(), {axis->first, {}});
      if (!triple->second[axis->second]) triple->second[axis->second] = i;
    }
  }
  std::optional<std::array<std::size_t, 3>> bare;
  for (const auto& [prefix, axes] : triples) {
    if (!axes[0] || !axes[1] || !axes[2]) continue;
    const std::array<std::size_t, 3> columns{*axes[0], *axes[1], *axes[2]};
    auto* const slot = kind_of(prefix) == Kind::gyro    ? &found.gyro
                       : kind_of(prefix) == Kind::accel ? &found.accel
                       : kind_of(prefix) == Kind::bare  ? &bare
                                                        : nullptr;
    if (slot && !*slot) *slot = columns;
  }
  found.rates_by_default = bare && !found.gyro && !found.accel;
  if (bare && !found.gyro)
    found.gyro = bare;
  else if (bare && !found.accel)
    found.accel = bare;

  if (!time) throw Error("the header names no time column", where, expected);
  if (!found.gyro && !found.angle) throw Error("the header names neither three rates nor an angle", where, expected);
  found.time = *time;
  if (found.gyro) found.angle.reset();
  found.note = fmt::format("columns by header: time {}", shape.names[found.time]);
  if (found.gyro) found.note += "; rates " + listed(shape, *found.gyro);
  if (found.accel) found.note += "; accelerations " + listed(shape, *found.accel);
  if (found.angle) found.note += "; angle " + shape.names[*found.angle];
  return found;
}

/// Never falls and does rise.
bool only_grows(const std::vector<std::vector<double>>& rows, std::size_t column) {
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i][column] < rows[i - 1][column]) return false;
  return rows.size() < 2 || rows.back()[column] > rows.front()[column];
}

bool counts_rows(const std::vector<std::vector<double>>& rows, std::size_t column) {
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i][column] != rows[i - 1][column] + 1) return false;
  return rows.size() > 1 && (rows[0][column] == 0 || rows[0][column] == 1);
}

LogColumns by_place(const TableShape& shape, const std::vector<std::vector<double>>& head, const std::string& where) {
  const std::size_t last = shape.columns - 1;
  LogColumns found;
  std::size_t first_value = 1;
  if (shape.columns >= 3 && counts_rows(head, 0) && only_grows(head, 1)) {
    found.time = 1;  // after a running number
    first_value = 2;
  } else if (!only_grows(head, 0) && only_grows(head, last)) {
    found.time = last;
    first_value = 0;
  }
  const std::size_t values = shape.columns - 1 - (first_value == 2 ? 1 : 0);
  const std::size_t v = first_value;
  if (values == 1)
    found.angle = v;
  else if (values == 3 || values >= 6)
    found.gyro = {{v, v + 1, v + 2}};
  else
    throw Error(fmt::format("{} columns without a header", shape.columns), where, expected);
  found.rates_by_default = values == 3;
  if (values >= 6) found.accel = {{v + 3, v + 4, v + 5}};
  found.note = fmt::format("columns by place: time in column {}, then {}{}{}", found.time + 1,
                           found.angle ? "an angle" : "rates x y z", found.accel ? ", accelerations x y z" : "",
                           values > 6 ? "; the others are left out" : "");
  return found;
}

}  // namespace

LogColumns find_columns(const TableShape& shape, const std::vector<std::vector<double>>& head,
                        const std::string& where) {
  if (!shape.names.empty()) return by_names(shape, where);
  if (shape.columns < 2) throw Error("one column only", where, expected);
  return by_place(shape, head, where);
}

}  // namespace takt
