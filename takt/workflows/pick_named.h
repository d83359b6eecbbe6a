// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/core.h>

#include <string>
#include <vector>

#include "takt/error.h"
#include "takt/streams/stream_name.h"

namespace takt {

/// The streams of that name or pattern, all of them where it is empty. Throws takt::Error that lists what there is; `kind` is what
/// the message calls them, `where` the recording.
template <class Stream>
[[nodiscard]] std::vector<Stream> pick_named(const std::vector<Stream>& all, const std::string& name, const char* kind,
                                             const std::string& where) {
  std::vector<Stream> out;
  std::string names;
  for (const Stream& s : all) {
    names += (names.empty() ? "" : ", ") + s.name;
    if (name.empty() || name_matches(name, s.name)) out.push_back(s);
  }
  if (out.empty())
    throw Error(name.empty() ? fmt::format("no {} in it", kind) : fmt::format("no {} named {}", kind, name), where,
                fmt::format("it has: {} ({})", names.empty() ? "none" : names, kind));
  return out;
}

}  // namespace takt
