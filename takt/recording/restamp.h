// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "takt/streams/frame_timing.h"
#include "takt/time/instant.h"

/// The same recording with other stamps on one of its streams: what is asked, and what was done.
namespace takt {

struct Restamping {
  std::string stream;               ///< its name, or a pattern with * and ?
  std::function<Stamp(Stamp)> map;  ///< monotone
  bool record_time = false;         ///< move the recorder's times along with the stamps
  /// What the new stamps mean, where that changes: a format that can say so says so.
  std::optional<ExposureInstant> now_means;
};

struct RestampedStream {
  std::string name;
  std::size_t count = 0;
  Stamp earliest_before{}, earliest_after{};
  Stamp latest_before{}, latest_after{};
};
struct Restamped {
  std::vector<RestampedStream> streams;
  std::vector<std::string> notes;  ///< what was passed over, kept or left out
};

/// Collects what happens to each stream.
class RestampLog {
 public:
  void saw(const std::string& stream, Stamp before, Stamp after);
  [[nodiscard]] std::vector<RestampedStream> streams() const;

 private:
  std::map<std::string, RestampedStream> streams_;
};

/// Throws takt::Error: nothing at `where` has that name.
[[noreturn]] void no_such_stream(const std::string& stream, const std::set<std::string>& there,
                                 const std::string& where);

}  // namespace takt
