// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/kitti_raw.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

/// "2011-09-26 13:02:25.964389445": with so many decimals, and as many more as the nanosecond needs.
std::string date_of(Stamp stamp, std::size_t decimals, const std::string& where) {
  using namespace std::chrono;
  const sys_time<nanoseconds> time(nanoseconds(to_ns(stamp)));
  const sys_days day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss<nanoseconds> clock(time - day);
  std::string text =
      fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02}.{:09}", static_cast<int>(date.year()),
                  static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), clock.hours().count(),
                  clock.minutes().count(), clock.seconds().count(), clock.subseconds().count());
  if (kitti_stamp(text) != stamp)
    throw Error("would get a date that the format does not have", where, "is the offset in seconds?");
  const std::size_t point = text.size() - 10;
  while (text.back() == '0' && text.size() > point + 1 + decimals) text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string with_other_dates(std::string_view text, const std::string& where, const std::function<Stamp(Stamp)>& map) {
  static_cast<void>(read_kitti_stamps(text, where));  // every line is a date, or blank
  std::string out;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.find('\n'), text.size() - 1) + 1);
    const std::string_view date = line.substr(0, line.find_last_not_of("\r\n ") + 1);
    text.remove_prefix(line.size());
    const auto before = kitti_stamp(date);
    const Stamp after = before ? map(*before) : Stamp{};
    const std::size_t point = date.find('.');
    out += before && after != *before
               ? date_of(after, point == std::string_view::npos ? 0 : date.size() - 1 - point, where)
               : std::string(date);
    out += line.substr(date.size());
  }
  return out;
}

}  // namespace

Restamped restamp_kitti_raw(const std::string& in, const std::string& out, const Restamping& order,
                            const OpenOptions&) {
  StreamFiles files;
  for (const fs::path& camera : kitti_cameras(in))
    files.emplace_back(camera.filename().string(), (camera.filename() / "timestamps.txt").generic_string());
  std::error_code failed;
  if (fs::exists(fs::path(in) / "oxts" / "timestamps.txt", failed))
    files.emplace_back("oxts_imu", "oxts/timestamps.txt");
  RestampLog log;
  copy_folder(in, out, files_to_rewrite(files, in, order.stream, [&](const std::string& stream) {
                return text_writer(order, log, stream, with_other_dates);
              }));
  return {log.streams(), {}};
}

}  // namespace takt
