// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/error.h"
#include "takt/math/median.h"
#include "takt/recording/clock_columns.h"
#include "takt/recording/clock_csv.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

struct PulseColumns {
  std::size_t time = 0;
  std::optional<std::size_t> sequence, edge, width, label;
  bool label_is_gps = false;
  ColumnName time_name, width_name, label_name;
  bool intervals = false;  ///< the header says so
};

PulseColumns named_columns(const TableShape& shape, const std::string& where) {
  PulseColumns c;
  std::optional<std::size_t> time;
  for (std::size_t i = 0; i < shape.names.size(); ++i) {
    const ColumnName n = read_column_name(shape.names[i]);
    if (contains_any(n.name, {"seq", "index", "pulse_id"}) || n.name == "n" || n.name == "i" || n.name == "id") {
      c.sequence = i;
    } else if (contains_any(n.name, {"edge", "polar", "level"})) {
      c.edge = i;
    } else if (contains_any(n.name, {"width"})) {
      c.width = i;
      c.width_name = n;
    } else if (contains_any(n.name, {"utc", "gps", "unix", "label", "second", "tai"})) {
      c.label = i;
      c.label_name = n;
      c.label_is_gps = contains_any(n.name, {"gps"});
      if (contains_any(n.name, {"tai"})) throw Error("labels in TAI are not read", where, "give utc_s or gps_s");
    } else if (!time) {
      time = i;
      c.time_name = n;
      c.intervals = contains_any(n.name, {"interval", "delta", "deviation", "minus"});
    }
  }
  if (!time)
    throw Error("no column holds the pulses' stamps", where, "name one t_ns or ticks; see docs/formats/clock.md");
  c.time = *time;
  return c;
}

/// Without a header: the stamp, then labels (Unix seconds) or sequence numbers, told by their size.
PulseColumns columns_by_place(TableRows& rows) {
  PulseColumns c;
  if (rows.shape().columns == 1) return c;
  if (rows.next()) {
    for (std::size_t i = 1; i < rows.shape().columns; ++i) {
      const auto value = finite_double(rows.cell(i));
      if (!value)
        c.edge = i;
      else if (*value >= 1e8 && !c.label)
        c.label = i;
      else if (!c.sequence)
        c.sequence = i;
    }
  }
  rows.rewind();
  return c;
}

Edge edge_in(const TableRows& rows, std::size_t column) {
  const std::string text = read_column_name(rows.cell(column)).name;
  if (text == "1" || text == "r" || text == "assert" || text == "up" || text.starts_with("ris") || text == "high")
    return Edge::rising;
  if (text == "0" || text == "f" || text == "clear" || text == "down" || text.starts_with("fall") || text == "low" ||
      text == "-1")
    return Edge::falling;
  if (text.empty() || text == "unknown") return Edge::unknown;
  throw Error(fmt::format("edge '{}' is neither rising nor falling", text.substr(0, 20)), rows.place(),
              "write rising or falling");
}

/// Raw differences modulo 2^64; a wrapped counter's one wild step does not move the median.
std::vector<double> steps_of(const std::vector<std::int64_t>& v) {
  std::vector<double> out;
  for (std::size_t i = 1; i < v.size(); ++i)
    out.push_back(static_cast<double>(
        static_cast<std::int64_t>(static_cast<std::uint64_t>(v[i]) - static_cast<std::uint64_t>(v[i - 1]))));
  return out;
}

/// A crystal is made for a round number of hertz; one that is not found so must be told.
std::optional<double> usual_tick_hz(double ticks_per_second) {
  for (const double unit : {1e3, 1e6, 1e9})
    if (std::abs(ticks_per_second / unit - 1) < 0.02) return unit;
  const auto near = [&](double step, double ppm) {
    const double round = std::round(ticks_per_second / step) * step;
    return round > 0 && std::abs(ticks_per_second / round - 1) < ppm * 1e-6 ? std::optional(round) : std::nullopt;
  };
  for (int k = 15; k <= 24; ++k)
    if (std::abs(ticks_per_second / std::ldexp(1, k) - 1) < 300e-6) return std::ldexp(1, k);
  if (const auto hz = near(1e6, 300)) return hz;
  return near(1e5, 100);
}

double tick_hz_from(const std::vector<std::int64_t>& stamps, const std::string& where,
                    std::vector<std::string>& notes) {
  const std::vector<double> steps = steps_of(stamps);
  if (steps.size() < 2) throw Error("has fewer than three pulses", where, "give a longer capture, or --tick-hz");
  const double per_pulse = median(steps);
  const auto hz = usual_tick_hz(per_pulse);
  if (!hz)
    throw Error(fmt::format("{:.0f} ticks between pulses fit no usual counter", per_pulse), where, "give --tick-hz");
  notes.push_back(*hz == 1e9
                      ? fmt::format("{}: stamps taken as ns (from their spacing)", where)
                      : fmt::format("{}: a counter of {:g} MHz (from the spacing of its pulses)", where, *hz * 1e-6));
  return *hz;
}

/// "1e6 − µs counted between pulses", or the counted intervals themselves: one column that goes up and down.
bool is_interval_log(const std::vector<std::int64_t>& v) {
  if (v.size() < 8) return false;
  std::size_t down = 0;
  for (std::size_t i = 1; i < v.size(); ++i) down += v[i] <= v[i - 1];
  return down * 4 > v.size();  // a capture of a counter falls at its rare wraps only
}

/// Sums the intervals up; the first pulse is at 0.
void add_up(std::vector<std::int64_t>& v, PulseStream& out, const std::string& where) {
  std::vector<double> values(v.begin(), v.end());
  const double middle = median(values);
  double unit_hz = 0;
  bool deviations = false;
  for (const double hz : {1e6, 1e9})
    if (std::abs(middle / hz - 1) < 0.02) unit_hz = hz;
  if (unit_hz == 0 && std::abs(middle) < 2e4) {
    unit_hz = 1e6;
    deviations = true;
  }
  if (unit_hz == 0)
    throw Error(fmt::format("one column around {:.0f} is neither stamps nor intervals of one second", middle), where,
                "see docs/formats/clock.md");
  std::int64_t sign = -1;
  if (deviations) {
    // A missed edge makes an interval of two seconds, which tells how the difference was taken.
    std::size_t longer = 0, shorter = 0;
    for (const std::int64_t d : v) {
      longer += d < -500'000;
      shorter += d > 1'000'000 - 500'000 / 4;
    }
    if (shorter > longer) sign = 1;
    out.notes.push_back(
        fmt::format("{}: taken as {} a pulse, in µs", where, sign < 0 ? "1e6 − counted" : "counted − 1e6"));
  } else {
    out.notes.push_back(
        fmt::format("{}: taken as intervals between pulses, in {}", where, unit_hz == 1e6 ? "µs" : "ns"));
  }
  out.counter.tick_hz = unit_hz;
  std::int64_t now = 0;
  out.pulses.push_back({});
  for (const std::int64_t d : v) {
    const std::int64_t step = deviations ? 1'000'000 + sign * d : d;
    if (step < 0 || __builtin_add_overflow(now, step, &now))
      throw Error("holds an interval that no counter can have", where, "delete the row");
    out.pulses.push_back({.ticks = now, .edge = Edge::unknown, .sequence = {}, .width_ticks = {}, .label_utc_s = {}});
  }
}

std::int64_t label_s(const TableRows& rows, const PulseColumns& c) {
  const int exponent = exponent_of(c.label_name.unit).value_or(9);
  const std::int64_t ns = rows.time_ns(*c.label, exponent);
  const std::int64_t s = (ns + 500'000'000) / 1'000'000'000;
  if (std::abs(ns - s * 1'000'000'000) > 1'000)
    throw Error("a pulse's label is no whole second", rows.place(), "labels are whole seconds: utc_s");
  return c.label_is_gps ? to_ns(to_utc(from_ns<Gps>(s * 1'000'000'000))) / 1'000'000'000 : s;
}

/// Stamps in seconds have a decimal point.
bool has_points(TableRows& rows, std::size_t column) {
  bool found = false;
  for (int i = 0; i < 50 && rows.next(); ++i)
    found = found || rows.cell(column).find_first_of(".eE") != std::string_view::npos;
  rows.rewind();
  return found;
}

std::optional<int> fixed_exponent(TableRows& rows, const PulseColumns& c, const ClockCsvOptions& options,
                                  std::vector<std::string>& notes, const std::string& where) {
  if (options.tick_hz && c.time_name.unit != "ns" && c.time_name.unit != "us" && c.time_name.unit != "ms" &&
      c.time_name.unit != "s")
    return std::nullopt;
  switch (options.time_unit) {
    case TimeUnit::s:
      return 9;
    case TimeUnit::ms:
      return 6;
    case TimeUnit::us:
      return 3;
    case TimeUnit::ns:
      return 0;
    case TimeUnit::automatic:
      break;
  }
  if (const auto e = exponent_of(c.time_name.unit)) return e;
  if (c.time_name.unit != "ticks" && has_points(rows, c.time)) {
    notes.push_back(fmt::format("{}: stamps taken as seconds (they have a decimal point)", where));
    return 9;
  }
  return std::nullopt;
}

}  // namespace

PulseStream read_pulses_csv(const std::string& path, const ClockCsvOptions& options) {
  return read_pulses_csv(read_file(path), path, options);
}

PulseStream read_pulses_csv(std::string_view text, const std::string& where, const ClockCsvOptions& options) {
  TableRows rows(text, where);
  PulseStream out;
  out.name = "pps";
  out.counter.clock = "device";
  const PulseColumns c = rows.shape().names.empty() ? columns_by_place(rows) : named_columns(rows.shape(), where);
  const std::optional<int> exponent = fixed_exponent(rows, c, options, out.notes, where);

  std::vector<std::int64_t> stamps;
  while (rows.next()) {
    Pulse p;
    if (exponent) {
      p.ticks = rows.time_ns(c.time, *exponent);
    } else if (const auto value = counter_value(rows.cell(c.time))) {
      p.ticks = *value;
    } else {
      throw Error(fmt::format("stamp '{}' is no whole number", std::string(rows.cell(c.time).substr(0, 24))),
                  rows.place(), "correct or delete the row");
    }
    if (c.sequence) p.sequence = static_cast<std::uint32_t>(rows.time_ns(*c.sequence, 0));
    if (c.edge) p.edge = edge_in(rows, *c.edge);
    if (c.width && !rows.cell(*c.width).empty())
      p.width_ticks = rows.time_ns(*c.width, exponent_of(c.width_name.unit).value_or(0));
    if (c.label && !rows.cell(*c.label).empty()) p.label_utc_s = label_s(rows, c);
    stamps.push_back(p.ticks);
    out.pulses.push_back(p);
  }
  if (rows.shape().columns == 1 && (c.intervals || is_interval_log(stamps))) {
    out.pulses.clear();
    add_up(stamps, out, where);
    return out;
  }
  if (exponent)
    out.counter.tick_hz = 1e9;
  else if (options.tick_hz)
    out.counter.tick_hz = *options.tick_hz;
  else
    out.counter.tick_hz = tick_hz_from(stamps, where, out.notes);
  if (options.counter_bits) out.counter.bits = *options.counter_bits;
  return out;
}

}  // namespace takt
