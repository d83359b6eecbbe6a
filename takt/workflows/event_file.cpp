// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/event_file.h"

#include <span>
#include <utility>

namespace takt {

EventFile::EventFile(std::string path) : path_(std::move(path)), file_(path_ + ".part", "", 0) {}

void EventFile::write(const std::string& topic, std::uint64_t time_ns, const std::string& json) {
  const auto [channel, fresh] = channels_.try_emplace(topic);
  if (fresh) channel->second = file_.add_channel(topic, {"takt.Event", "jsonschema", R"({"type":"object"})", "json"});
  file_.write(channel->second, time_ns, std::as_bytes(std::span(json)));
}

void EventFile::finish() {
  file_.finish();
  publish(path_ + ".part", path_);
}

}  // namespace takt
