// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <mutex>
#include <string>

#include "cli/verbs.h"

namespace takt::cli {

/// A bar on stderr while a verb works: only on a terminal, never with --quiet, without colour where NO_COLOR is set.
/// Any thread may report.
class ProgressBar {
 public:
  ProgressBar(const Common& common, std::string what);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// 0 … 1 of the whole.
  void operator()(double fraction);

 private:
  using Clock = std::chrono::steady_clock;
  const bool shown_;
  const bool colour_;
  const std::string what_;
  const Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  Clock::time_point drawn_{};
};

/// stderr is a terminal that can move its cursor.
[[nodiscard]] bool stderr_is_terminal();
/// Colour on this stream (1 or 2) is welcome: a terminal, and NO_COLOR is not set (no-color.org).
[[nodiscard]] bool colour_welcome(int stream);

}  // namespace takt::cli
