// SPDX-License-Identifier: Apache-2.0
// takt listen against a pseudo-terminal that plays a device: it is unplugged, comes back, and is stopped by Ctrl-C.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::TemporaryFolder;

/// A device's end of a line, behind a name that stays while the terminal itself goes and comes.
class Device {
 public:
  explicit Device(std::string name) : name_(std::move(name)) { plug(); }
  ~Device() { unplug(); }
  void plug() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);  // else the child would hold the line itself
    ASSERT_GE(master_, 0);
    grantpt(master_);
    unlockpt(master_);
    std::filesystem::remove(name_);
    std::filesystem::create_symlink(ptsname(master_), name_);
  }
  void unplug() {
    if (master_ >= 0) close(master_);
    master_ = -1;
    std::filesystem::remove(name_);
  }
  void say(const std::string& text) const {
    ASSERT_EQ(write(master_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }

 private:
  std::string name_;
  int master_ = -1;
};

class Listening {
 public:
  explicit Listening(const std::string& device) {
    std::array<int, 2> out{};
    EXPECT_EQ(pipe2(out.data(), O_CLOEXEC), 0);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(out[1], 1);
      close(out[0]);
      execl(TAKT_COMMAND, "takt", "listen", device.c_str(), "--tick-hz", "1000000", "--format", "text", "-q", nullptr);
      _exit(127);
    }
    close(out[1]);
    out_ = out[0];
  }
  ~Listening() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
    close(out_);
  }
  /// Reads until the text is there, or ten seconds are over.
  bool hears(const std::string& text, int seconds = 10) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
    while (text_.find(text) == std::string::npos && std::chrono::steady_clock::now() < until) {
      pollfd waiting{out_, POLLIN, 0};
      if (poll(&waiting, 1, 100) <= 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t n = read(out_, buffer.data(), buffer.size());
      if (n <= 0) break;
      text_.append(buffer.data(), static_cast<std::size_t>(n));
    }
    return text_.find(text) != std::string::npos;
  }
  int interrupt() {
    kill(pid_, SIGINT);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  void forget() { text_.clear(); }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
  std::string text_;
};

std::string second(int i) {
  return "pps," + std::to_string(5'000'000 + 1'000'010LL * i) + "\n";
}

TEST(Listen, IsUnpluggedPluggedInAndStopped) {
  const TemporaryFolder folder;
  Device device(folder.path() + "/ttyDEVICE");
  Listening takt(folder.path() + "/ttyDEVICE");
  // The command needs a moment to start; what is said before it listens may be lost.
  for (int tries = 0; tries < 10 && !takt.hears(R"("event":"hello")", 1); ++tries) device.say("event,hello,1\n");
  for (int i = 0; i < 12; ++i) device.say(second(i));
  device.say("event,imu0,17500000\n");
  EXPECT_TRUE(takt.hears(R"("event":"imu0")"));
  device.unplug();
  EXPECT_TRUE(takt.hears(R"("event":"unplugged")"));
  device.plug();
  EXPECT_TRUE(takt.hears(R"("event":"plugged")"));
  takt.forget();
  device.say(second(20));
  EXPECT_TRUE(takt.hears(R"("event":"pps","ticks":25000200)"));
  EXPECT_EQ(takt.interrupt(), 3) << "stops by itself, and says by its status that the second stayed ambiguous";
  EXPECT_TRUE(takt.hears(R"("event":"end","state":"ambiguous")"));
}

}  // namespace
}  // namespace takt
