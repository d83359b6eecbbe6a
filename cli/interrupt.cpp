// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <mutex>
#include <set>
#include <thread>

#include "takt/error.h"

namespace takt::cli {

namespace fs = std::filesystem;

namespace {

struct Unfinished {
  std::mutex mutex;
  std::multiset<fs::path> paths;
};
Unfinished& unfinished() {
  static Unfinished u;
  return u;
}

std::atomic<bool> stop_first{false}, stopped{false};

sigset_t ending_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, s);
  return set;
}

}  // namespace

void guard_against_interrupts() {
  // Removing a folder is not allowed in a signal handler, so a thread waits for the signal instead.
  const sigset_t set = ending_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::thread([set] {
    int signal = 0;
    if (sigwait(&set, &signal) != 0) return;
    if (stop_first && !stopped.exchange(true) && sigwait(&set, &signal) != 0) return;
    Unfinished& u = unfinished();
    const std::lock_guard lock(u.mutex);  // kept: whoever would finish a file now waits until the process ends
    for (const fs::path& path : u.paths) {
      // Other threads are still at work in it: under another name they find it no more.
      fs::path away = path;
      away += ".interrupted";
      std::error_code ignored;
      fs::rename(path, away, ignored);
      fs::remove_all(away, ignored);
    }
    std::signal(signal, SIG_DFL);
    pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
    raise(signal);
  }).detach();
}

void stop_on_interrupt() {
  stop_first = true;
}
bool interrupted() {
  return stopped;
}

RemovedOnInterrupt::RemovedOnInterrupt(fs::path path) : path_(std::move(path)) {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.insert(path_);
}

void RemovedOnInterrupt::keep() {
  const std::lock_guard lock(unfinished().mutex);
  if (!kept_) unfinished().paths.erase(unfinished().paths.find(path_));
  kept_ = true;
}

RemovedOnInterrupt::~RemovedOnInterrupt() {
  if (kept_) return;
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  keep();
}

void write_file(const std::string& path, const std::string& content) {
  // /dev/stdout and pipes can be neither replaced nor left half written.
  if (std::error_code e; fs::exists(path, e) && !fs::is_regular_file(path, e) && !fs::is_directory(path, e)) {
    std::ofstream out(path, std::ios::binary);
    if (!(out << content) || !out.flush()) throw Error("cannot be written", path, "choose another place with -o");
    return;
  }
  const RemovedOnInterrupt temporary(path + ".part" + std::to_string(getpid()));
  errno = 0;
  std::ofstream out(temporary.path(), std::ios::binary);
  if (!(out << content) || !out.flush())
    throw Error(std::string("cannot be written: ") + std::strerror(errno), path, "choose another place with -o");
  out.close();
  std::error_code error;
  fs::rename(temporary.path(), path, error);
  if (error) throw Error("cannot be written: " + error.message(), path, "choose another place with -o");
}

}  // namespace takt::cli
