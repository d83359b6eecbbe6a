// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/restamp.h"

#include <fmt/core.h>

#include <algorithm>

#include "takt/error.h"
#include "takt/recording/json_messages.h"
#include "takt/recording/message_reader.h"
#include "takt/recording/sensor_messages.h"
#include "takt/streams/stream_name.h"

namespace takt {

void RestampLog::saw(const std::string& stream, Stamp before, Stamp after) {
  const auto [found, is_new] = streams_.try_emplace(stream);
  RestampedStream& s = found->second;
  ++s.count;
  if (is_new || before < s.earliest_before) s.earliest_before = before, s.earliest_after = after;
  if (is_new || before > s.latest_before) s.latest_before = before, s.latest_after = after;
}

std::vector<RestampedStream> RestampLog::streams() const {
  std::vector<RestampedStream> out;
  for (const auto& [name, stream] : streams_) {
    out.push_back(stream);
    out.back().name = name;
  }
  return out;
}

std::set<std::string> topics_to_restamp(const std::vector<Channel>& channels, const std::string& stream,
                                        const std::string& where, std::vector<std::string>& notes) {
  std::set<std::string> topics, all;
  for (const Channel& c : channels) {
    all.insert(c.topic);
    if (!name_matches(stream, c.topic)) continue;
    const bool json_stamp = c.encoding == MessageEncoding::json;
    const bool readable = json_stamp || (c.encoding != MessageEncoding::other && begins_with_header(c));
    if (!readable)
      throw Error(fmt::format("{}: its messages ({}) do not begin with a header that has a stamp", c.topic, c.type),
                  where, "name another stream with --sensor");
    topics.insert(c.topic);
  }
  if (topics.empty()) {
    std::string list;
    for (const std::string& topic : all) list += (list.empty() ? "" : ", ") + topic;
    throw Error(fmt::format("has no stream {} (it has: {})", stream, list.empty() ? "nothing" : list), where,
                "name the one to restamp with --sensor");
  }
  for (const Channel& c : channels) {
    const SensorMessage kind = sensor_message(c);
    if (!topics.contains(c.topic) || (kind != SensorMessage::image && kind != SensorMessage::compressed_image))
      continue;
    for (const Channel& info : channels)
      if (sensor_message(info) == SensorMessage::camera_info && name_space(info.topic) == name_space(c.topic) &&
          topics.insert(info.topic).second)
        notes.push_back(info.topic + " goes with " + c.topic);
  }
  return topics;
}

std::optional<RestampedMessage> restamp_message(MessageEncoding encoding, std::span<std::byte> message,
                                                const Restamping& order, const std::string& where) {
  const bool json = encoding == MessageEncoding::json;
  const auto before = json ? json_messages::stamp(message) : header_stamp(encoding, message);
  if (!before) return std::nullopt;
  RestampedMessage out{*before, order.map(*before), std::nullopt};
  if (out.after == out.before) return out;
  if (json) {
    out.longer = json_messages::with_stamp(message, out.after);
    if (!out.longer) return std::nullopt;
  } else if (!overwrite_stamp(encoding, message, out.after)) {
    throw Error(fmt::format("stamp {} ns would become {} ns, which the message cannot hold", to_ns(out.before),
                            to_ns(out.after)),
                where, "is this the result of this recording?");
  }
  return out;
}

}  // namespace takt
