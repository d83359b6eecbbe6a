// SPDX-License-Identifier: Apache-2.0
// Tables of a camera's frames and of strobes on a counter.
#include <fmt/core.h>

#include "takt/error.h"
#include "takt/recording/clock_columns.h"
#include "takt/recording/clock_csv.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"
#include "takt/recording/units.h"

namespace takt {

namespace {

std::string header_of(const TableRows& rows, std::size_t column) {
  return rows.shape().names.empty() ? std::string() : rows.shape().names[column];
}

/// By the name of the column, else as told, else seconds where there is a decimal point and ns where there is none.
int exponent_in(TableRows& rows, std::size_t column, const ClockCsvOptions& options) {
  if (const auto e = exponent_of(read_column_name(header_of(rows, column)).unit)) return *e;
  if (options.time_unit != TimeUnit::automatic) return exponent_to_ns(options.time_unit);
  bool points = false;
  for (int i = 0; i < 50 && rows.next(); ++i)
    points = points || rows.cell(column).find_first_of(".eE") != std::string_view::npos;
  rows.rewind();
  return points ? 9 : 0;
}

}  // namespace

FrameTable read_frames_csv(const std::string& path, const ClockCsvOptions& options) {
  return read_frames_csv(read_file(path), path, options);
}

FrameTable read_frames_csv(std::string_view text, const std::string& where, const ClockCsvOptions& options) {
  TableRows rows(text, where);
  std::size_t stamp = 0;
  std::optional<std::size_t> exposure;
  if (rows.shape().names.empty()) {
    if (rows.shape().columns > 1) exposure = 1;
  } else {
    for (std::size_t i = 0; i < rows.shape().columns; ++i)
      if (contains_any(read_column_name(header_of(rows, i)).name, {"expos", "shutter", "integration"})) exposure = i;
    if (exposure == stamp) stamp = 1;
    if (stamp >= rows.shape().columns) throw Error("no column holds the frames' stamps", where, "name one t_ns");
  }
  const int of_stamp = exponent_in(rows, stamp, options);
  const int of_exposure = exposure ? exponent_in(rows, *exposure, {}) : 0;
  FrameTable out;
  while (rows.next()) {
    out.stamps_ns.push_back(rows.time_ns(stamp, of_stamp));
    if (!exposure) continue;
    const double s = 1e-9 * static_cast<double>(rows.time_ns(*exposure, of_exposure));
    if (!(s >= 0 && s < 60))
      throw Error(fmt::format("an exposure of {:g} s", s), rows.place(), "name its unit: exposure_s, exposure_us");
    out.exposures_s.push_back(s);
  }
  return out;
}

StrobeStream read_strobes_csv(const std::string& path, const ClockCsvOptions& options) {
  return read_strobes_csv(read_file(path), path, options);
}

StrobeStream read_strobes_csv(std::string_view text, const std::string& where, const ClockCsvOptions& options) {
  TableRows rows(text, where);
  if (rows.shape().columns < 2) throw Error("has one column", where, "give start,end of each strobe");
  std::size_t start = 0, end = 1;
  for (std::size_t i = 0; i < rows.shape().names.size(); ++i) {
    const std::string name = read_column_name(header_of(rows, i)).name;
    if (contains_any(name, {"start", "begin", "rise"})) start = i;
    if (contains_any(name, {"end", "stop", "fall"})) end = i;
  }
  const bool in_ticks = options.tick_hz.has_value();
  const int of_start = in_ticks ? 0 : exponent_in(rows, start, options);
  const int of_end = in_ticks ? 0 : exponent_in(rows, end, options);
  if (!in_ticks && read_column_name(header_of(rows, start)).unit == "ticks")
    throw Error("strobes in ticks of a counter whose rate is not known", where, "give --tick-hz");
  StrobeStream out;
  out.name = "strobe";
  out.counter = {"board", options.tick_hz.value_or(1e9), 64};
  while (rows.next()) {
    const FrameStrobe s{rows.time_ns(start, of_start), rows.time_ns(end, of_end), {}};
    if (s.end_ticks <= s.start_ticks)
      throw Error("a strobe ends before it begins", rows.place(), "give start,end of each strobe");
    if (!out.strobes.empty() && s.start_ticks < out.strobes.back().start_ticks)
      throw Error("strobes go back in time", rows.place(), "sort them, or cut the table where the counter restarted");
    out.strobes.push_back(s);
  }
  return out;
}

}  // namespace takt
