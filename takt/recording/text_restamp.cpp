// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/text_restamp.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/csv_log.h"
#include "takt/recording/files.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/output_file.h"
#include "takt/recording/table_restamp.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

TimeColumn ns_in_front(TableRows&) {
  return {0, 0};
}

/// Restamps one table and says so in the log under the stream's name; without a name it only follows another table.
WriteFile table_writer(const Restamping& order, RestampLog& log, const std::string& name) {
  return [&order, &log, name](const std::string& in, const std::string& out) {
    restamp_table(in, out, ns_in_front, order.map, [&](Stamp before, Stamp after) {
      if (!name.empty()) log.saw(name, before, after);
    });
  };
}

const char* word(ExposureInstant instant) {
  switch (instant) {
    case ExposureInstant::start:
      return "start";
    case ExposureInstant::end:
      return "end";
    case ExposureInstant::middle:
      break;
  }
  return "middle";
}

/// A sensor.yaml whose key `stamp` says something else.
void write_stamp_key(const std::string& in, const std::string& out, ExposureInstant instant) {
  std::string text = read_file(in);
  const std::string line = fmt::format("stamp: {}", word(instant));
  std::size_t at = text.starts_with("stamp:") ? 0 : text.find("\nstamp:");
  if (at == std::string::npos) {
    text += (text.empty() || text.ends_with('\n') ? "" : "\n") + line + "\n";
  } else {
    at += text[at] == '\n' ? 1 : 0;
    std::size_t end = text.find_first_of("\r\n#", at);
    if (end != std::string::npos && text[end] == '#') --end;  // the blank before a remark
    text.replace(at, std::min(end, text.size()) - at, line);
  }
  OutputFile file(out);
  file.write(text);
  file.finish();
}

[[noreturn]] void no_such_stream(const std::string& stream, const std::string& all, const std::string& where) {
  throw Error(fmt::format("has no stream {} (it has: {})", stream, all.empty() ? "nothing" : all), where,
              "name the one to restamp with --sensor");
}

/// The files of a folder that hold a stream's stamps, by the stream's name.
using StreamFiles = std::vector<std::pair<std::string, std::string>>;

void choose(const StreamFiles& files, const std::string& in, const Restamping& order, RestampLog& log,
            std::map<std::string, WriteFile>& rewrite) {
  std::string all;
  for (const auto& [name, file] : files) {
    all += (all.empty() ? "" : ", ") + name;
    if (name_matches(order.stream, name)) rewrite[file] = table_writer(order, log, name);
  }
  if (rewrite.empty()) no_such_stream(order.stream, all, in);
}

}  // namespace

Restamped restamp_asl(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  std::error_code failed;
  const fs::path root = fs::is_directory(fs::path(in) / "mav0", failed) ? "mav0" : "";
  StreamFiles files;
  for (const auto& entry : fs::directory_iterator(fs::path(in) / root, failed))
    if (fs::exists(entry.path() / "data.csv", failed))
      files.emplace_back(entry.path().filename().string(),
                         (root / entry.path().filename() / "data.csv").generic_string());
  std::sort(files.begin(), files.end());

  Restamped result;
  RestampLog log;
  std::map<std::string, WriteFile> rewrite;
  choose(files, in, order, log, rewrite);
  bool pictures = false;
  for (const auto& [name, file] : files) {
    if (!rewrite.contains(file)) continue;
    const fs::path folder = fs::path(file).parent_path();
    pictures = pictures || fs::is_directory(fs::path(in) / folder / "data", failed);
    if (fs::exists(fs::path(in) / folder / "exposure.csv", failed))
      rewrite[(folder / "exposure.csv").generic_string()] = table_writer(order, log, "");
    if (order.now_means && fs::exists(fs::path(in) / folder / "sensor.yaml", failed))
      rewrite[(folder / "sensor.yaml").generic_string()] = [instant = *order.now_means](const std::string& from,
                                                                                        const std::string& to) {
        write_stamp_key(from, to, instant);
      };
  }
  copy_folder(in, out, rewrite);
  if (pictures)
    result.notes.emplace_back(
        "pictures keep their file names, which may be old stamps: tools that take the time from the name do not see "
        "the change");
  result.streams = log.streams();
  return result;
}

Restamped restamp_tracks_folder(const std::string& in, const std::string& out, const Restamping& order,
                                const OpenOptions&) {
  StreamFiles files;
  std::error_code failed;
  constexpr std::string_view of_camera = "_tracks.csv", of_imu = ".csv";
  for (const auto& entry : fs::directory_iterator(in, failed)) {
    const std::string file = entry.path().filename().string();
    if (file.starts_with("cam") && file.ends_with(of_camera))
      files.emplace_back(file.substr(0, file.size() - of_camera.size()), file);
    else if (file.starts_with("imu") && file.ends_with(of_imu))
      files.emplace_back(file.substr(0, file.size() - of_imu.size()), file);
  }
  std::sort(files.begin(), files.end());
  RestampLog log;
  std::map<std::string, WriteFile> rewrite;
  choose(files, in, order, log, rewrite);
  copy_folder(in, out, rewrite);
  return {log.streams(), {}};
}

Restamped restamp_csv_log(const std::string& in, const std::string& out, const Restamping& order,
                          const OpenOptions& options) {
  const std::string name = fs::path(in).stem().string();
  if (!name_matches(order.stream, name)) no_such_stream(order.stream, name, in);
  RestampLog log;
  std::string note;
  restamp_table(
      in, out, [&](TableRows& rows) { return time_column_of_log(rows, in, options.time_unit, note); }, order.map,
      [&](Stamp before, Stamp after) { log.saw(name, before, after); });
  return {log.streams(), {name + ": " + note}};
}

}  // namespace takt
