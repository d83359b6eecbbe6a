// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pick_streams.h"

#include <fmt/ranges.h>

#include <vector>

#include "takt/error.h"

namespace takt {

namespace {

/// In the order in which a sensor is chosen when none is named.
std::vector<StreamRef> all_streams(const Recording& r) {
  std::vector<StreamRef> out;
  for (const auto& s : r.cameras) out.push_back({&s, nullptr, nullptr, nullptr});
  for (const auto& s : r.tracks) out.push_back({nullptr, &s, nullptr, nullptr});
  for (const auto& s : r.attitudes) out.push_back({nullptr, nullptr, &s, nullptr});
  for (const auto& s : r.imus) out.push_back({nullptr, nullptr, nullptr, &s});
  return out;
}

[[noreturn]] void fail(const Recording& r, const std::string& problem, const char* advice) {
  std::vector<std::string> names;
  for (const StreamRef& s : all_streams(r)) names.push_back(s.name());
  throw Error(fmt::format("{} (it has: {})", problem, names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "))),
              r.path, advice);
}

const StreamRef& named(const Recording& r, const std::vector<StreamRef>& streams, const std::string& name) {
  for (const StreamRef& s : streams)
    if (s.name() == name) return s;
  fail(r, fmt::format("no stream is named {}", name), "name one of them with --sensor or --reference");
}

}  // namespace

const std::string& StreamRef::name() const {
  if (camera) return camera->name;
  if (tracks) return tracks->name;
  if (attitude) return attitude->name;
  return imu->name;
}

StreamPair pick_pair(const Recording& recording, const std::string& sensor, const std::string& reference) {
  const std::vector<StreamRef> streams = all_streams(recording);
  StreamPair out;
  if (!sensor.empty()) out.sensor = named(recording, streams, sensor);
  if (!reference.empty()) {
    out.reference = named(recording, streams, reference);
  } else {
    for (const StreamRef& s : streams)
      if (s.is_gyro() && s.imu != out.sensor.imu) {
        out.reference = s;
        break;
      }
    if (!out.reference.imu) fail(recording, "there is no gyro to align to", "give the gyro's log as a second file");
  }
  if (sensor.empty()) {
    for (const StreamRef& s : streams)
      if (s.name() != out.reference.name()) {
        out.sensor = s;
        break;
      }
    if (!out.sensor.camera && !out.sensor.tracks && !out.sensor.attitude && !out.sensor.imu)
      fail(recording, "there is nothing to align with the gyro", "give the other log as a second file");
  }
  return out;
}

StreamRef pick_one(const Recording& recording, const std::string& name) {
  const std::vector<StreamRef> streams = all_streams(recording);
  if (!name.empty()) return named(recording, streams, name);
  if (streams.empty()) fail(recording, "there is no stream that turns", "inspect it with: takt inspect");
  return streams.front();
}

}  // namespace takt
