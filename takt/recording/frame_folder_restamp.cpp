// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <filesystem>

#include "takt/recording/folder_restamp.h"
#include "takt/recording/frame_folder.h"

namespace takt {

namespace {

/// The log's lines `SOF  4328040426246,  frameNum :1 ...`, whose number is µs; all others stay.
std::string with_other_starts(std::string_view text, const std::string&, const std::function<Stamp(Stamp)>& map) {
  std::string out;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.find('\n'), text.size() - 1) + 1);
    text.remove_prefix(line.size());
    const std::size_t at = line.starts_with("SOF") ? line.find_first_of("-0123456789") : std::string_view::npos;
    std::int64_t start_us = 0;
    const auto [end, failed] = at == std::string_view::npos
                                   ? std::from_chars_result{line.data(), std::errc::invalid_argument}
                                   : std::from_chars(line.data() + at, line.data() + line.size(), start_us);
    if (failed != std::errc{} || start_us < -most_logged_us || start_us > most_logged_us) {
      out += line;
      continue;
    }
    const std::int64_t after_ns = to_ns(map(from_ns(start_us * 1000)));
    out += line.substr(0, at);
    out += std::to_string((after_ns + (after_ns < 0 ? -500 : 500)) / 1000);
    out += line.substr(static_cast<std::size_t>(end - line.data()));
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
