// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

namespace takt {

/// Bytes as they come: a serial device (by libserialport), a pipe, standard input ("-"), or a file read to its end.
class LiveBytes {
 public:
  /// Throws takt::Error where `path` cannot be opened now.
  LiveBytes(std::string path, int baud);
  ~LiveBytes();
  LiveBytes(const LiveBytes&) = delete;
  LiveBytes& operator=(const LiveBytes&) = delete;

  enum class Status {
    data,       ///< something was appended
    quiet,      ///< nothing came within the time
    ended,      ///< a file's or pipe's end
    unplugged,  ///< the device is gone; each further read tries to open it again
    plugged,    ///< and now it is back
  };
  /// Appends what has come, waiting at most `wait_ms` for it.
  [[nodiscard]] Status read(std::string& to, int wait_ms);

 private:
  struct Line;
  bool open();
  void close();

  std::string path_;
  int baud_;
  std::unique_ptr<Line> line_;
};

}  // namespace takt
