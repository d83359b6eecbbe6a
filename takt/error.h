// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace takt {

/// The world failed: a file, a format, a serial line. Says what is wrong, where, and what to try.
/// A broken contract of the caller is a std::logic_error instead; data that cannot answer is a Verdict, not an error.
class Error : public std::runtime_error {
 public:
  Error(std::string what_failed, std::string where, std::string try_this)
      : std::runtime_error(where + ": " + what_failed + (try_this.empty() ? "" : "; " + try_this)),
        what_failed(std::move(what_failed)),
        where(std::move(where)),
        try_this(std::move(try_this)) {}

  std::string what_failed;  ///< "row 17 has 3 columns, 7 expected"
  std::string where;        ///< file, line or byte: "run/mav0/imu0/data.csv:17"
  std::string try_this;     ///< "re-export the log with the accelerometer, or pass --columns"
};

}  // namespace takt
