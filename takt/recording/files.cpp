// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "takt/error.h"

namespace takt {

namespace {

[[noreturn]] void fail(const std::string& path) {
  const int code = errno;
  throw Error(std::string("cannot be read: ") + std::strerror(code), path,
              code == ENOENT ? "check the path" : "check that it is a file that you may read");
}

class File : public ByteSource {
 public:
  explicit File(const std::string& path) : handle_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (handle_ < 0) fail(path);
    struct stat info {};
    const bool known = ::fstat(handle_, &info) == 0;
    if (known && !S_ISDIR(info.st_mode)) {
      size_ = static_cast<std::uint64_t>(info.st_size);
      return;
    }
    if (known) errno = EISDIR;
    ::close(handle_);
    fail(path);
  }
  ~File() override { ::close(handle_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] bool read(std::uint64_t offset, std::span<std::byte> out) const override {
    return read_some(offset, out) == out.size();
  }
  /// As many bytes as there are.
  [[nodiscard]] std::size_t read_some(std::uint64_t offset, std::span<std::byte> out) const {
    std::size_t done = 0;
    while (done < out.size()) {
      const ssize_t got = ::pread(handle_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  }

 private:
  int handle_;
  std::uint64_t size_ = 0;
};

class Memory : public ByteSource {
 public:
  explicit Memory(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] bool read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return false;
    if (!out.empty()) std::memcpy(out.data(), bytes_.data() + offset, out.size());
    return true;
  }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace

std::string read_file(const std::string& path) {
  const File file(path);
  std::string text(file.size(), '\0');
  text.resize(file.read_some(0, std::as_writable_bytes(std::span(text))));
  return text;
}

std::string file_head(const std::string& path, std::size_t count) {
  try {
    const File file(path);
    std::string head(count, '\0');
    head.resize(file.read_some(0, std::as_writable_bytes(std::span(head))));
    return head;
  } catch (const Error&) {
    return {};
  }
}

std::shared_ptr<const ByteSource> open_bytes(const std::string& path) {
  return std::make_shared<File>(path);
}
std::shared_ptr<const ByteSource> view_bytes(std::span<const std::byte> bytes) {
  return std::make_shared<Memory>(bytes);
}

}  // namespace takt
