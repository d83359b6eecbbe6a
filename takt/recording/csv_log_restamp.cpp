// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "takt/recording/csv_log.h"
#include "takt/streams/stream_name.h"

namespace takt {

Restamped restamp_csv_log(const std::string& in, const std::string& out, const Restamping& order,
                          const OpenOptions& options) {
  const std::string name = std::filesystem::path(in).stem().string();
  if (!name_matches(order.stream, name)) no_such_stream(order.stream, {name}, in);
  RestampLog log;
  std::string note;
  restamp_table(
      in, out, [&](TableRows& rows) { return time_column_of_log(rows, in, options.time_unit, note); }, order.map,
      [&](Stamp before, Stamp after) { log.saw(name, before, after); });
  return {log.streams(), {name + ": " + note}};
}

}  // namespace takt
