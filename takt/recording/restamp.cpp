// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/restamp.h"

#include <fmt/core.h>

#include "takt/error.h"

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

void no_such_stream(const std::string& stream, const std::set<std::string>& there, const std::string& where) {
  std::string all;
  for (const std::string& name : there) all += (all.empty() ? "" : ", ") + name;
  throw Error(fmt::format("has no stream {} (it has: {})", stream, all.empty() ? "nothing" : all), where,
              "name the one to restamp with --sensor");
}

}  // namespace takt
