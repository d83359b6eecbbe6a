// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/message_restamper.h"

#include <fmt/core.h>

#include <algorithm>

#include "takt/error.h"
#include "takt/recording/json_messages.h"
#include "takt/recording/message_reader.h"
#include "takt/recording/sensor_messages.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace {

/// The topics that `stream` names, and the camera_info of those that are pictures.
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
  if (topics.empty()) no_such_stream(stream, all, where);
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

/// Nothing where the message is broken.
std::optional<RestampedMessage> exchange_stamp(MessageEncoding encoding, std::span<std::byte> message,
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

}  // namespace

MessageRestamper::MessageRestamper(const std::vector<Channel>& channels, const Restamping& order, std::string where)
    : order_(order), where_(std::move(where)) {
  topics_ = topics_to_restamp(channels, order.stream, where_, result_.notes);
}

std::optional<RestampedMessage> MessageRestamper::restamp(const Channel& channel, std::span<std::byte> message) {
  auto done = exchange_stamp(channel.encoding, message, order_, where_);
  if (!done) {
    ++broken_;
    return std::nullopt;
  }
  log_.saw(channel.topic, done->before, done->after);
  return done->after == done->before ? std::nullopt : std::move(done);
}

void MessageRestamper::left_out(const RecordWalk::Damage& damage) {
  if (damage.places > 0)
    note(fmt::format("damaged in {} places, the first at byte {}: the {} bytes there are left out", damage.places,
                     damage.first_at, damage.bytes));
}

Restamped MessageRestamper::finish() {
  if (broken_ > 0) note(fmt::format("{} broken chunks or messages were copied as they are", broken_));
  result_.streams = log_.streams();
  return std::move(result_);
}

}  // namespace takt
