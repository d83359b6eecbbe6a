// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "takt/recording/decimal.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/frame_folder.h"

namespace takt {

namespace {

/// The log's lines `SOF  4328040426246,  frameNum :1 ...`, whose number is µs; all others stay.
std::string with_other_starts(std::string_view text, const std::string&, const std::function<Stamp(Stamp)>& map) {
  constexpr int us = 3;
  std::string out;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.find('\n'), text.size() - 1) + 1);
    text.remove_prefix(line.size());
    const std::size_t begin = line.find_first_of("-0123456789"), end = line.find_first_not_of("-0123456789", begin);
    const auto start = line.starts_with("SOF")
                           ? decimal_to_ns(line.substr(std::min(begin, line.size()), end - begin), us)
                           : std::nullopt;
    if (!start) {
      out += line;
      continue;
    }
    const std::int64_t after_ns = to_ns(map(from_ns(*start)));
    out += line.substr(0, begin);
    out += std::to_string((after_ns + (after_ns < 0 ? -500 : 500)) / 1000);
    out += line.substr(std::min(end, line.size()));
  }
  return out;
}

}  // namespace

Restamped restamp_frame_folder(const std::string& in, const std::string& out, const Restamping& order,
                               const OpenOptions&) {
  constexpr int seconds = 9;
  const StreamFiles files{{"cam0", "framestamp.txt"}, {"imu0", "gyro.txt"}};
  RestampLog log;
  auto rewrite = files_to_rewrite(files, in, order.stream, [&](const std::string& stream) {
    return table_writer(order, log, stream, stream == "imu0" ? TimeColumn{3, seconds} : TimeColumn{0, seconds});
  });
  std::error_code failed;
  if (rewrite.contains("framestamp.txt") &&
      std::filesystem::exists(std::filesystem::path(in) / "gyro_dump.txt", failed))
    rewrite["gyro_dump.txt"] = text_writer(order, log, "", with_other_starts);
  copy_folder(in, out, rewrite);
  return {log.streams(), {}};
}

}  // namespace takt
