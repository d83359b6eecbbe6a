// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <array>
#include <cmath>

#include "takt/error.h"
#include "takt/recording/clock_columns.h"
#include "takt/recording/clock_csv.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"
#include "takt/recording/units.h"

namespace takt {

namespace {

struct PairColumns {
  std::optional<std::size_t> request, device, arrival;
};

bool names_device(const std::string& n) {
  return contains_any(n, {"dev", "sensor", "remote", "client", "slave", "cam", "imu", "hw"});
}
bool names_request(const std::string& n) {
  return contains_any(n, {"request", "send", "sent", "tx", "req"});
}
bool names_arrival(const std::string& n) {
  return contains_any(n, {"arriv", "recv", "receiv", "response", "resp", "host", "rx", "reply"});
}

std::optional<PairColumns> columns_of(const TableShape& shape) {
  PairColumns c;
  for (std::size_t i = 0; i < shape.names.size(); ++i) {
    const std::string n = read_column_name(shape.names[i]).name;
    if (!c.request && names_request(n))
      c.request = i;
    else if (!c.device && names_device(n))
      c.device = i;
    else if (!c.arrival && names_arrival(n))
      c.arrival = i;
  }
  if (c.device && c.arrival && shape.columns >= 2) return c;
  if (!shape.names.empty() && (c.device || c.arrival || c.request) && shape.columns > 3) return std::nullopt;
  if (shape.columns == 2) return PairColumns{{}, 0, 1};
  if (shape.columns == 3) return PairColumns{0, 1, 2};
  return std::nullopt;
}

int exponent_for(TableRows& rows, std::size_t column, const ClockCsvOptions& options, const std::string& where,
                 std::vector<std::string>& notes) {
  if (!rows.shape().names.empty())
    if (const auto e = exponent_of(read_column_name(rows.shape().names[column]).unit)) return *e;
  std::vector<double> sample;
  bool points = false;
  for (int i = 0; i < 2000 && rows.next(); ++i) {
    sample.push_back(rows.number(column));
    points = points || rows.cell(column).find('.') != std::string_view::npos;
  }
  rows.rewind();
  if (options.time_unit == TimeUnit::automatic && points) {
    notes.push_back(fmt::format("{}: column {} taken as seconds (it has a decimal point)", where, column + 1));
    return 9;
  }
  const FoundTimeUnit found = find_time_unit(sample, "", options.time_unit);
  notes.push_back(fmt::format("{}: column {}: {}", where, column + 1, found.note));
  return exponent_to_ns(found.unit);
}

}  // namespace

PairStream read_pairs_csv(const std::string& path, const ClockCsvOptions& options) {
  return read_pairs_csv(read_file(path), path, options);
}

PairStream read_pairs_csv(std::string_view text, const std::string& where, const ClockCsvOptions& options) {
  TableRows rows(text, where);
  const auto columns = columns_of(rows.shape());
  if (!columns)
    throw Error(fmt::format("{} columns are neither device,arrival nor request,device,response", rows.shape().columns),
                where, "see docs/formats/clock.md");
  PairStream out;
  out.name = "pairs";
  out.two_way = columns->request.has_value();
  const int device = exponent_for(rows, *columns->device, options, where, out.notes);
  const int arrival = exponent_for(rows, *columns->arrival, options, where, out.notes);
  const int request = columns->request ? exponent_for(rows, *columns->request, options, where, out.notes) : 0;
  out.pairs.reserve(rows.rows_left_about());
  while (rows.next()) {
    ClockPair p;
    p.device_ns = rows.time_ns(*columns->device, device);
    p.arrival_ns = rows.time_ns(*columns->arrival, arrival);
    if (columns->request) p.request_ns = rows.time_ns(*columns->request, request);
    out.pairs.push_back(p);
  }
  return out;
}

ClockTable clock_table_in(const std::string& path) {
  const std::string head = file_head(path, 65536);
  try {
    // The head may end within a row: that row is left out.
    const auto last = head.find_last_of('\n');
    TableRows rows(std::string_view(head).substr(0, last == std::string::npos ? head.size() : last + 1), path);
    const TableShape& shape = rows.shape();
    bool pairs = false, pulses = false;
    for (const std::string& header : shape.names) {
      const ColumnName n = read_column_name(header);
      pairs = pairs || names_arrival(n.name) || names_request(n.name);
      pulses = pulses ||
               contains_any(n.name, {"edge", "polar", "width", "seq", "utc", "gps", "unix", "pps", "pulse", "label"}) ||
               n.unit == "ticks";
    }
    if (pairs && !pulses) return ClockTable::pairs;
    if (pulses) return ClockTable::pulses;
    if (shape.columns == 1) return ClockTable::pulses;
    if (shape.columns == 3 && shape.names.empty()) return ClockTable::pairs;
    // Two bare columns: beside its pulse a label grows by one, an arrival by as much as the device's stamp.
    if (shape.columns == 2 && shape.names.empty()) {
      std::array<double, 2> first{}, last_row{};
      std::size_t n = 0;
      for (; rows.next(); ++n) {
        const std::array<double, 2> row{rows.number(0), rows.number(1)};
        if (n == 0) first = row;
        last_row = row;
      }
      const bool counts = n > 1 && std::abs(last_row[1] - first[1]) < 1e6 &&
                          std::abs(last_row[0] - first[0]) > 1e3 * std::abs(last_row[1] - first[1]);
      return counts ? ClockTable::pulses : ClockTable::pairs;
    }
  } catch (const std::exception&) {
    return ClockTable::other;
  }
  return ClockTable::other;
}

}  // namespace takt
