// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "takt/recording/message_file.h"
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

/// The topics that `stream` names. A camera's camera_info goes with its pictures, or the two would not match any more.
/// Throws takt::Error at `where` where there is none, or one whose messages have no header to restamp.
[[nodiscard]] std::set<std::string> topics_to_restamp(const std::vector<Channel>& channels, const std::string& stream,
                                                      const std::string& where, std::vector<std::string>& notes);

/// A message whose stamp has been exchanged: in place, or in `longer` where its length changes (JSON).
struct RestampedMessage {
  Stamp before, after;
  std::optional<std::vector<std::byte>> longer;
};
/// Throws takt::Error where the new stamp does not fit into the message; nothing where the message is broken.
[[nodiscard]] std::optional<RestampedMessage> restamp_message(MessageEncoding encoding, std::span<std::byte> message,
                                                              const Restamping& order, const std::string& where);

}  // namespace takt
