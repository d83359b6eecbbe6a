// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "takt/recording/asl.h"
#include "takt/recording/files.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/output_file.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

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
  auto rewrite = tables_to_rewrite(files, in, order, log);
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

}  // namespace takt
