// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "takt/error.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/kalibr_folder.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

/// A picture's copy under another stamp's name; its ending stays.
WriteFile under_name(Stamp stamp) {
  return [stamp](const std::string& in, const std::string& out) {
    if (to_ns(stamp) < 0)
      throw Error("would get a stamp below 0, which no picture's name can say", in,
                  "convert the folder to .mcap first");
    if (out.empty()) return;
    const fs::path picture(out);
    fs::copy_file(in, picture.parent_path() / (std::to_string(to_ns(stamp)) + picture.extension().string()));
  };
}

}  // namespace

Restamped restamp_kalibr_folder(const std::string& in, const std::string& out, const Restamping& order,
                                const OpenOptions&) {
  std::set<std::string> all;
  std::map<std::string, WriteFile> rewrite;
  RestampLog log;
  for (const fs::path& imu : kalibr_imus(in)) {
    const std::string name = imu.stem().string();
    all.insert(name);
    if (name_matches(order.stream, name)) rewrite[imu.filename().string()] = table_writer(order, log, name);
  }
  for (const fs::path& camera : kalibr_cameras(in)) {
    const std::string name = camera.filename().string();
    all.insert(name);
    if (!name_matches(order.stream, name)) continue;
    for (const fs::path& picture : pictures_in(camera)) {
      const auto before = stamp_in_name(picture);
      if (!before) continue;
      const Stamp after = order.map(*before);
      log.saw(name, *before, after);
      if (after != *before) rewrite[(fs::path(name) / picture.filename()).generic_string()] = under_name(after);
    }
  }
  Restamped result{log.streams(), {}};
  if (rewrite.empty() && result.streams.empty()) no_such_stream(order.stream, all, in);
  copy_folder(in, out, rewrite);
  result.streams = log.streams();
  return result;
}

}  // namespace takt
