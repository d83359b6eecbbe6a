// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/folder_restamp.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>

#include "takt/error.h"
#include "takt/recording/table_restamp.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace fs = std::filesystem;

void copy_folder(const std::string& in, const std::string& out, const std::map<std::string, WriteFile>& rewrite) {
  if (out.empty()) {
    for (const auto& [file, write] : rewrite) write((fs::path(in) / file).string(), "");
    return;
  }
  std::error_code failed;
  const auto check = [&](const fs::path& path) {
    if (failed) throw Error("cannot be copied: " + failed.message(), path.string(), "is there room on the disk?");
  };
  fs::create_directories(out, failed);
  check(out);
  for (const auto& entry : fs::recursive_directory_iterator(in, fs::directory_options::follow_directory_symlink)) {
    const fs::path inside = fs::relative(entry.path(), in), target = fs::path(out) / inside;
    if (entry.is_directory()) {
      fs::create_directories(target, failed);
      check(target);
    } else if (const auto special = rewrite.find(inside.generic_string()); special != rewrite.end()) {
      special->second(entry.path().string(), target.string());
    } else {
      fs::copy_file(entry.path(), target, failed);
      check(entry.path());
    }
  }
  // One call for thousands of pictures.
  const int handle = ::open(out.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  ::syncfs(handle);
  ::close(handle);
}

WriteFile table_writer(const Restamping& order, RestampLog& log, const std::string& name) {
  return [&order, &log, name](const std::string& in, const std::string& out) {
    restamp_table(
        in, out,
        [](TableRows&) {
          return TimeColumn{0, 0};
        },
        order.map,
        [&](Stamp before, Stamp after) {
          if (!name.empty()) log.saw(name, before, after);
        });
  };
}

std::map<std::string, WriteFile> tables_to_rewrite(const StreamFiles& files, const std::string& in,
                                                   const Restamping& order, RestampLog& log) {
  std::set<std::string> all;
  std::map<std::string, WriteFile> rewrite;
  for (const auto& [name, file] : files) {
    all.insert(name);
    if (name_matches(order.stream, name)) rewrite[file] = table_writer(order, log, name);
  }
  if (rewrite.empty()) no_such_stream(order.stream, all, in);
  return rewrite;
}

}  // namespace takt
