// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pick_streams.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "takt/error.h"
#include "takt/streams/stream_name.h"

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
  throw Error(
      fmt::format("{} (it has: {})", problem, names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "))),
      r.path, advice);
}

const StreamRef& named(const Recording& r, const std::vector<StreamRef>& streams, const std::string& name) {
  for (const StreamRef& s : streams)
    if (s.name() == name) return s;
  const StreamRef* found = nullptr;
  for (const StreamRef& s : streams) {
    if (!name_matches(name, s.name())) continue;
    if (found) fail(r, fmt::format("more than one stream matches {}", name), "name one of them");
    found = &s;
  }
  if (found) return *found;
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

StreamPair pick_pair(const Recording& sensor_recording, const Recording& reference_recording, const std::string& sensor,
                     const std::string& reference) {
  const std::vector<StreamRef> sensors = all_streams(sensor_recording), references = all_streams(reference_recording);
  for (const Recording* r : {&sensor_recording, &reference_recording})
    if (all_streams(*r).empty()) fail(*r, "there is no stream that turns", "look into it with: takt inspect");
  StreamPair out;
  out.sensor = sensor.empty() ? sensors.front() : named(sensor_recording, sensors, sensor);
  if (!reference.empty()) {
    out.reference = named(reference_recording, references, reference);
  } else {
    const auto gyro =
        std::find_if(references.begin(), references.end(), [](const StreamRef& s) { return s.is_gyro(); });
    out.reference = gyro == references.end() ? references.front() : *gyro;
  }
  // A gyro is needed on one side: a recording with a camera and a gyro lends its gyro.
  if (sensor.empty() && !out.reference.is_gyro())
    for (const StreamRef& s : sensors)
      if (s.is_gyro()) out.sensor = s;
  return out;
}

}  // namespace takt
