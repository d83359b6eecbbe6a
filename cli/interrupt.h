// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

/// An interrupted command leaves nothing half written.
namespace takt::cli {

/// From here on Ctrl-C, a closed terminal and `kill` first remove what RemovedOnInterrupt names, then end the process
/// by the same signal. Called once, before any thread is started.
void guard_against_interrupts();

/// For a verb that runs until it is told to stop: the first signal only makes `interrupted` true; a second one ends the
/// process as usual.
void stop_on_interrupt();
[[nodiscard]] bool interrupted();

/// A file or folder that is worth nothing unless finished: removed at an interrupt and by the destructor.
class RemovedOnInterrupt {
 public:
  explicit RemovedOnInterrupt(std::filesystem::path path);
  ~RemovedOnInterrupt();
  RemovedOnInterrupt(const RemovedOnInterrupt&) = delete;
  RemovedOnInterrupt& operator=(const RemovedOnInterrupt&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// It is finished: neither an interrupt nor the destructor removes it.
  void keep();

 private:
  std::filesystem::path path_;
  bool kept_ = false;
};

/// Writes `content` beside `path` and renames it there: readers see the old file or the new one, never a part.
/// Throws takt::Error.
void write_file(const std::string& path, const std::string& content);

}  // namespace takt::cli
