// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/rosbag2.h"

#include <fmt/core.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "takt/error.h"
#include "takt/recording/db3_container.h"
#include "takt/recording/decompress.h"
#include "takt/recording/files.h"
#include "takt/recording/folder_restamp.h"
#include "takt/recording/join_recordings.h"
#include "takt/recording/mcap.h"
#include "takt/recording/message_streams.h"
#include "takt/recording/output_file.h"
#include "takt/recording/yaml_fields.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

/// A file in the folder for temporary ones, gone with the last reader.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& ending) {
    std::error_code failed;
    fs::path folder = fs::temp_directory_path(failed);
    if (failed) folder = "/tmp";
    path_ = (folder / ("takt-XXXXXX" + ending)).string();
    const int handle = ::mkstemps(path_.data(), static_cast<int>(ending.size()));
    if (handle < 0) throw Error("no temporary file can be made", folder.string(), "set TMPDIR to a folder with room");
    ::close(handle);
  }
  ~TemporaryFile() { ::unlink(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// "run_0.db3.zstd" -> ".db3"
std::string inner_ending(const std::string& path) {
  return fs::path(path).stem().extension().string();
}

std::shared_ptr<TemporaryFile> unpacked(const std::string& path) {
  auto file = std::make_shared<TemporaryFile>(inner_ending(path));
  OutputFile out(file->path());
  const bool good = decompress_zstd_file(*open_bytes(path), [&](std::span<const std::byte> part) {
    out.write(part);
    return true;
  });
  if (!good) throw Error("its zstd frame is broken or cut off", path, "copy the file again");
  out.finish();
  return file;
}

void pack(const std::string& from, const std::string& to) {
  const std::unique_ptr<ZSTD_CStream, decltype(&ZSTD_freeCStream)> stream(ZSTD_createCStream(), &ZSTD_freeCStream);
  const auto file = open_bytes(from);
  OutputFile out(to);
  std::vector<std::byte> block(1U << 20), piece(ZSTD_CStreamOutSize());
  for (std::uint64_t at = 0;;) {
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(1U << 20, file->size() - at)));
    if (!file->read(at, block)) throw Error("broke off while being read", from, "is the disk well?");
    at += block.size();
    const bool last = at == file->size();
    ZSTD_inBuffer in{block.data(), block.size(), 0};
    std::size_t left = 0;
    do {
      ZSTD_outBuffer part{piece.data(), piece.size(), 0};
      left = ZSTD_compressStream2(stream.get(), &part, &in, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(left)) throw Error(std::string("zstd: ") + ZSTD_getErrorName(left), to, "");
      out.write(std::span<const std::byte>(piece).first(part.pos));
    } while (last ? left != 0 : in.pos < in.size);
    if (last) break;
  }
  out.finish();
}

/// The storage of one file of a folder.
Recording read_file_of_bag(const std::string& path, const OpenOptions& options) {
  if (looks_like_zstd_bag(path)) return read_zstd_bag(path, options);
  return looks_like_mcap(path) ? read_mcap(path, options) : read_db3(path, options);
}
Restamped restamp_file_of_bag(const std::string& in, const std::string& out, const Restamping& order,
                              const OpenOptions& options) {
  if (looks_like_zstd_bag(in)) return restamp_zstd_bag(in, out, order, options);
  return looks_like_mcap(in) ? restamp_mcap(in, out, order, options) : restamp_db3(in, out, order, options);
}

/// The folder's files as metadata.yaml lists them; without a list, or where one is missing, those that are there.
std::vector<std::string> files_of(const std::string& folder, std::vector<std::string>& notes) {
  std::vector<std::string> out;
  const std::string metadata = (fs::path(folder) / "metadata.yaml").string();
  const YamlFields fields(read_file(metadata), metadata);
  const auto listed = fields.under("rosbag2_bagfile_information").texts("relative_file_paths");
  std::error_code failed;
  for (const std::string& name : listed.value_or(std::vector<std::string>{})) {
    const fs::path inside = fs::path(name).filename();  // older versions list it with the folder's name
    if (fs::is_regular_file(fs::path(folder) / inside, failed))
      out.push_back(inside.string());
    else
      notes.push_back(fmt::format("{} is listed in metadata.yaml but is not there", inside.string()));
  }
  if (out.empty()) throw Error("lists no file that is there", metadata, "copy the whole folder");
  return out;
}

}  // namespace

bool looks_like_db3(const std::string& path) {
  const std::string head = file_head(path, 16);
  return head.starts_with("SQLite format 3") || (path.ends_with(".db3") && !head.empty());
}

Recording read_db3(const std::string& path, const OpenOptions&) {
  Recording r = message_streams(std::make_shared<const Db3Container>(path), path, "copy the file again");
  std::error_code failed;
  if (fs::exists(path + "-wal", failed) && fs::file_size(path + "-wal", failed) > 0)
    r.notes.emplace_back(
        "there is a write-ahead log beside the file, which is not looked at: the recorder did not close the bag");
  return r;
}

Recording read_db3(std::span<const std::byte> bytes, const std::string& path) {
  return message_streams(std::make_shared<const Db3Container>(bytes, path), path, "copy the file again");
}

bool looks_like_zstd_bag(const std::string& path) {
  const std::string head = file_head(path, 4);
  const std::string inner = inner_ending(path);
  return is_zstd(std::as_bytes(std::span(head))) && (inner == ".db3" || inner == ".mcap");
}

Recording read_zstd_bag(const std::string& path, const OpenOptions& options) {
  const auto file = unpacked(path);
  Recording r = inner_ending(path) == ".mcap" ? read_mcap(file->path(), options) : read_db3(file->path(), options);
  r.files = {path};
  for (CameraStream& camera : r.cameras)  // pictures are read later
    camera.open = [open = camera.open, file] { return open(); };
  return r;
}

Restamped restamp_zstd_bag(const std::string& in, const std::string& out, const Restamping& order,
                           const OpenOptions& options) {
  const auto file = unpacked(in);
  if (out.empty()) return restamp_file_of_bag(file->path(), "", order, options);
  const TemporaryFile now(inner_ending(in));
  const Restamped result = restamp_file_of_bag(file->path(), now.path(), order, options);
  const bool moves = std::any_of(result.streams.begin(), result.streams.end(), [](const RestampedStream& s) {
    return s.earliest_before != s.earliest_after || s.latest_before != s.latest_after;
  });
  if (moves) {
    pack(now.path(), out);
  } else {
    OutputFile copy(out);
    const auto from = open_bytes(in);
    copy.copy(*from, 0, from->size());
    copy.finish();
  }
  return result;
}

bool looks_like_rosbag2_folder(const std::string& path) {
  std::error_code failed;
  return fs::is_directory(path, failed) &&
         file_head((fs::path(path) / "metadata.yaml").string(), 4096).find("rosbag2_bagfile_information") !=
             std::string::npos;
}

Recording read_rosbag2_folder(const std::string& path, const OpenOptions& options) {
  Recording all;
  for (const std::string& file : files_of(path, all.notes))
    join(all, read_file_of_bag((fs::path(path) / file).string(), options));
  all.files.push_back((fs::path(path) / "metadata.yaml").string());
  return all;
}

Restamped restamp_rosbag2_folder(const std::string& in, const std::string& out, const Restamping& order,
                                 const OpenOptions& options) {
  Restamped result;
  std::map<std::string, RestampedStream> streams;
  std::map<std::string, WriteFile> rewrite;
  for (const std::string& file : files_of(in, result.notes))
    rewrite[file] = [&](const std::string& from, const std::string& to) {
      const Restamped part = restamp_file_of_bag(from, to, order, options);
      for (const std::string& note : part.notes)
        if (std::find(result.notes.begin(), result.notes.end(), note) == result.notes.end())
          result.notes.push_back(note);
      for (const RestampedStream& s : part.streams) {
        const auto [found, is_new] = streams.try_emplace(s.name, s);
        if (is_new) continue;
        RestampedStream& all = found->second;
        all.count += s.count;
        if (s.earliest_before < all.earliest_before)
          all.earliest_before = s.earliest_before, all.earliest_after = s.earliest_after;
        if (s.latest_before > all.latest_before) all.latest_before = s.latest_before, all.latest_after = s.latest_after;
      }
    };
  copy_folder(in, out, rewrite);
  for (const auto& [name, stream] : streams) result.streams.push_back(stream);
  return result;
}

}  // namespace takt
