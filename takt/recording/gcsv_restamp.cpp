// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/gcsv.h"
#include "takt/recording/table_restamp.h"
#include "takt/streams/stream_name.h"

namespace takt {

Restamped restamp_gcsv(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  constexpr std::size_t header_and_more = 1U << 17;
  const std::string name = std::filesystem::path(in).stem().string();
  if (!name_matches(order.stream, name)) no_such_stream(order.stream, {name}, in);
  const GcsvTable table = gcsv_table(file_head(in, header_and_more), in);
  if (!table.exponent_to_ns || *table.exponent_to_ns < 0)
    throw Error("its tscale is no power of ten down to 1 ns, so other stamps cannot be written exactly", in,
                "run takt convert to .csv first");
  RestampLog log;
  restamp_table(
      in, out,
      [&](TableRows&) {
        return TimeColumn{0, *table.exponent_to_ns};
      },
      order.map, [&](Stamp before, Stamp after) { log.saw(name, before, after); }, table.at);
  return {log.streams(), {}};
}

}  // namespace takt
