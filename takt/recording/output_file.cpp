// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/output_file.h"

#include <fcntl.h>
#include <isa-l/crc.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "takt/error.h"

namespace takt {

namespace {

constexpr std::size_t buffer_bytes = 1U << 20;

std::string last_error() {
  return std::string("cannot be written: ") + std::strerror(errno);
}

}  // namespace

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (path.empty()) return;
  handle_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (handle_ < 0) fail();
  buffer_.reserve(buffer_bytes);
}

OutputFile::~OutputFile() {
  if (handle_ >= 0) ::close(handle_);
}

void OutputFile::fail() const {
  throw Error(last_error(), path_, errno == ENOSPC ? "make room on the disk" : "choose another place with -o");
}

void OutputFile::write(std::span<const std::byte> bytes) {
  place_ += bytes.size();
  if (counts_crc_) crc_ = crc32_of(bytes, crc_);
  if (handle_ < 0) return;
  if (buffer_.size() + bytes.size() > buffer_bytes) flush();
  if (bytes.size() < buffer_bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    return;
  }
  while (!bytes.empty()) {
    const ssize_t done = ::write(handle_, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) fail();
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

void OutputFile::flush() {
  std::span<const std::byte> left = buffer_;
  while (!left.empty()) {
    const ssize_t done = ::write(handle_, left.data(), left.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) fail();
    left = left.subspan(static_cast<std::size_t>(done));
  }
  buffer_.clear();
}

void OutputFile::copy(const ByteSource& from, std::uint64_t at, std::uint64_t count) {
  if (handle_ < 0 && !counts_crc_) {
    place_ += count;
    return;
  }
  std::vector<std::byte> block(static_cast<std::size_t>(std::min<std::uint64_t>(count, buffer_bytes)));
  while (count > 0) {
    const auto part = std::span(block).first(static_cast<std::size_t>(std::min<std::uint64_t>(count, block.size())));
    if (!from.read(at, part)) throw Error("the input broke off while being copied", path_, "is the disk well?");
    write(part);
    at += part.size();
    count -= part.size();
  }
}

void OutputFile::patch(std::uint64_t place, std::span<const std::byte> bytes) {
  if (handle_ < 0) return;
  flush();
  if (::pwrite(handle_, bytes.data(), bytes.size(), static_cast<off_t>(place)) != static_cast<ssize_t>(bytes.size()))
    fail();
}

void OutputFile::finish() {
  if (handle_ < 0) return;
  flush();
  if (::fsync(handle_) != 0 && errno != EINVAL) fail();
  const int handle = handle_;
  handle_ = -1;
  if (::close(handle) != 0) fail();
}

void OutputFile::start_crc() {
  counts_crc_ = true;
  crc_ = 0;
}

std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before) {
  return ::crc32_gzip_refl(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

void publish(const std::string& temporary, const std::string& final_name) {
  std::error_code failed;
  std::filesystem::rename(temporary, final_name, failed);
  if (failed) throw Error("cannot be written: " + failed.message(), final_name, "choose another place with -o");
  std::string folder = std::filesystem::path(final_name).parent_path().string();
  if (folder.empty()) folder = ".";
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  ::fsync(handle);
  ::close(handle);
}

}  // namespace takt
