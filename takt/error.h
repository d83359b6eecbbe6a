// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <stdexcept>
#include <string>

namespace takt {

/// The world failed: a file, a format, a serial line. Says what is wrong, where, and what to try.
/// A broken contract of the caller is a std::logic_error instead; data that cannot answer is a Verdict, not an error.
class Error : public std::runtime_error {
 public:
  Error(const std::string& failed, const std::string& place, const std::string& advice)
      : std::runtime_error(place + ": " + failed + (advice.empty() ? "" : "; " + advice)),
        what_failed(failed),
        where(place),
        try_this(advice) {}

  std::string what_failed;  ///< "row 17 has 3 columns, 7 expected"
  std::string where;        ///< file, line or byte: "run/mav0/imu0/data.csv:17"
  std::string try_this;     ///< "re-export the log with the accelerometer, or pass --columns"
};

}  // namespace takt
