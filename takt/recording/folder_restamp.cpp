// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/folder_restamp.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/output_file.h"
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
      fs::create_directory(target, failed);  // and not `out` again, where an interrupt took it away
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

WriteFile table_writer(const Restamping& order, RestampLog& log, const std::string& name, TimeColumn time) {
  return [&order, &log, name, time](const std::string& in, const std::string& out) {
    restamp_table(
        in, out, [time](TableRows&) { return time; }, order.map,
        [&](Stamp before, Stamp after) {
          if (!name.empty()) log.saw(name, before, after);
        });
  };
}

WriteFile text_writer(const Restamping& order, RestampLog& log, const std::string& name, RestampText restamped) {
  return [&order, &log, name, restamped = std::move(restamped)](const std::string& in, const std::string& out) {
    const std::string text = restamped(read_file(in), in, [&](Stamp before) {
      const Stamp after = order.map(before);
      if (!name.empty()) log.saw(name, before, after);
      return after;
    });
    OutputFile file(out);
    file.write(text);
    file.finish();
  };
}

std::map<std::string, WriteFile> files_to_rewrite(const StreamFiles& files, const std::string& in,
                                                  const std::string& wanted,
                                                  const std::function<WriteFile(const std::string& stream)>& writer) {
  std::set<std::string> all;
  std::map<std::string, WriteFile> rewrite;
  for (const auto& [name, file] : files) {
    all.insert(name);
    if (name_matches(wanted, name)) rewrite[file] = writer(name);
  }
  if (rewrite.empty()) no_such_stream(wanted, all, in);
  return rewrite;
}

std::map<std::string, WriteFile> tables_to_rewrite(const StreamFiles& files, const std::string& in,
                                                   const Restamping& order, RestampLog& log) {
  return files_to_rewrite(files, in, order.stream,
                          [&](const std::string& name) { return table_writer(order, log, name); });
}

}  // namespace takt
