// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/live_bytes.h"

#include <fcntl.h>
#include <libserialport.h>
#include <poll.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "takt/error.h"

namespace takt {

struct LiveBytes::Line {
  int fd = -1;
  bool device = false;  // may be unplugged, and come back
  sp_port* port = nullptr;
};

LiveBytes::LiveBytes(std::string path, int baud)
    : path_(std::move(path)), baud_(baud), line_(std::make_unique<Line>()) {
  errno = 0;
  if (!open())
    throw Error(std::string("cannot be opened: ") + std::strerror(errno), path_,
                "is it plugged in, and may you read it (group dialout)?");
}

LiveBytes::~LiveBytes() {
  close();
}

void LiveBytes::close() {
  if (line_->port) {
    sp_close(line_->port);
    sp_free_port(line_->port);
    line_->port = nullptr;
  } else if (line_->fd > 0) {
    ::close(line_->fd);
  }
  line_->fd = -1;
}

bool LiveBytes::open() {
  if (path_ == "-") {
    line_->fd = 0;
    return true;
  }
  std::error_code failed;
  // A device may be named by a link (/dev/serial/by-id/...).
  const std::string real = std::filesystem::canonical(path_, failed).string();
  struct stat about {};
  if (failed || stat(real.c_str(), &about) != 0) {
    errno = ENOENT;
    return false;
  }
  if (S_ISDIR(about.st_mode)) {
    errno = EISDIR;
    return false;
  }
  if (S_ISCHR(about.st_mode)) {
    line_->device = true;
    sp_port* port = nullptr;
    if (sp_get_port_by_name(real.c_str(), &port) == SP_OK) {
      if (sp_open(port, SP_MODE_READ) == SP_OK) {
        sp_set_baudrate(port, baud_);
        sp_set_bits(port, 8);
        sp_set_parity(port, SP_PARITY_NONE);
        sp_set_stopbits(port, 1);
        sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE);
        if (sp_get_port_handle(port, &line_->fd) == SP_OK) {
          line_->port = port;
          return true;
        }
        sp_close(port);
      }
      sp_free_port(port);
    }
  }
  // Files, pipes, and terminals that are no serial port of this machine (pseudo-terminals).
  const int fd = ::open(real.c_str(), O_RDONLY | O_NOCTTY | O_CLOEXEC | (line_->device ? O_NONBLOCK : 0));
  if (fd < 0) return false;
  if (termios raw{}; line_->device && tcgetattr(fd, &raw) == 0) {
    cfmakeraw(&raw);
    tcsetattr(fd, TCSANOW, &raw);
  } else {
    line_->device = false;  // /dev/null and the like end, and do not come back
  }
  line_->fd = fd;
  return true;
}

LiveBytes::Status LiveBytes::read(std::string& to, int wait_ms) {
  if (line_->fd < 0) {
    if (open()) return Status::plugged;
    poll(nullptr, 0, std::min(wait_ms, 200));
    return Status::unplugged;
  }
  pollfd waiting{line_->fd, POLLIN, 0};
  const int ready = poll(&waiting, 1, wait_ms);
  if (ready == 0) return Status::quiet;
  std::array<char, 16384> buffer;
  const ssize_t got = ready < 0 ? -1 : ::read(line_->fd, buffer.data(), buffer.size());
  if (got > 0) {
    to.append(buffer.data(), static_cast<std::size_t>(got));
    return Status::data;
  }
  if (got < 0 && (errno == EINTR || errno == EAGAIN)) return Status::quiet;
  if (!line_->device) return Status::ended;
  close();
  return Status::unplugged;
}

}  // namespace takt
