// SPDX-License-Identifier: Apache-2.0
#include "cli/progress.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace takt::cli {

namespace {

bool dumb_terminal() {
  const char* term = std::getenv("TERM");
  return term && std::string(term) == "dumb";
}

std::string remaining_words(double seconds) {
  if (seconds < 1) return "";
  if (seconds < 90) return fmt::format("{:.0f} s left", seconds);
  return fmt::format("{:.0f} min left", seconds / 60);
}

}  // namespace

bool stderr_is_terminal() {
  return isatty(2) == 1 && !dumb_terminal();
}

bool colour_welcome(int stream) {
  const char* refused = std::getenv("NO_COLOR");
  return isatty(stream) == 1 && !dumb_terminal() && !(refused && *refused);
}

ProgressBar::ProgressBar(const Common& common, std::string what)
    : shown_(!common.quiet && stderr_is_terminal()), colour_(colour_welcome(2)), what_(std::move(what)) {}

ProgressBar::~ProgressBar() {
  if (shown_ && drawn_ != Clock::time_point{}) fmt::print(stderr, "\r\x1b[K");
}

void ProgressBar::operator()(double fraction) {
  if (!shown_) return;
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (now - drawn_ < std::chrono::milliseconds(80)) return;
  drawn_ = now;
  constexpr int width = 30;
  const double done = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(done * width);
  std::string bar;
  for (int i = 0; i < width; ++i) {
    if (colour_ && i == 0) bar += "\x1b[36m";
    if (colour_ && i == filled) bar += "\x1b[2m";
    bar += i < filled ? "━" : "─";
  }
  if (colour_) bar += "\x1b[0m";
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string left = done > 0.02 && elapsed > 1 ? remaining_words(elapsed * (1 - done) / done) : "";
  fmt::print(stderr, "\r{} {} {:3.0f} % {}\x1b[K", what_, bar, 100 * done, left);
  std::fflush(stderr);
}

}  // namespace takt::cli
