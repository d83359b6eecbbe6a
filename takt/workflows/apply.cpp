// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/apply.h"

#include <fmt/core.h>

#include <unordered_map>

#include "takt/error.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/output_file.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace {

const CameraStream& camera_named(const Recording& recording, const std::string& name) {
  for (const CameraStream& camera : recording.cameras)
    if (name_matches(name, camera.name)) return camera;
  throw Error("no camera is named " + name, recording.path, "an instant or a row can be chosen for cameras only");
}

double line_delay_s(const ApplyJob& job, const CameraStream& camera) {
  if (job.result.line_delay_s) return *job.result.line_delay_s;
  if (camera.timing.shutter == Shutter::unknown && camera.timing.readout_s == 0)
    throw Error(camera.name + ": neither the result nor the recording knows its line delay", job.in,
                "leave --row away, or set readout_s and shutter in its sensor.yaml");
  return camera.timing.line_delay_s();
}

/// Adds what turns the stamps' meaning into the wanted one to the map.
void change_meaning(const ApplyJob& job, Restamping& order, std::vector<std::string>& notes) {
  const Recording recording = open_recording(job.in, job.open);
  const CameraStream& camera = camera_named(recording, order.stream);
  const double delay_s = job.meaning.row ? line_delay_s(job, camera) : 0;
  auto shifts = std::make_shared<std::unordered_map<std::int64_t, Duration>>();
  for (std::size_t i = 0; i < camera.size(); ++i) {
    const double exposure_s = camera.exposures_s.empty() ? camera.timing.exposure_s : camera.exposures_s[i];
    if (exposure_s == 0 && job.meaning.instant && *job.meaning.instant != camera.timing.instant)
      throw Error(fmt::format("{}: the exposure of frame {} is unknown", camera.name, i), job.in,
                  "leave --instant away, or set exposure_s in its sensor.yaml");
    (*shifts)[to_ns(camera.stamps[i])] = meaning_shift(camera.timing, exposure_s, delay_s, job.meaning);
  }
  order.map = [map = order.map, shifts](Stamp t) {
    const auto shift = shifts->find(to_ns(t));
    return shift == shifts->end() ? map(t) : map(t) + shift->second;
  };
  order.now_means = job.meaning.instant;
  notes.push_back(fmt::format(
      "{}: its stamps meant {}; now they mean {}", camera.name, in_words(camera.timing.instant, camera.timing.row),
      in_words(job.meaning.instant.value_or(camera.timing.instant), job.meaning.row.value_or(camera.timing.row))));
}

}  // namespace

Restamped apply(const ApplyJob& job) {
  Restamping order;
  order.stream = !job.stream.empty()          ? job.stream
                 : job.moved == Moved::sensor ? job.result.sensor
                                              : job.result.reference;
  order.map = stamp_map(job.result, job.moved);
  order.record_time = job.record_time;
  std::vector<std::string> notes;
  if (order.stream.empty()) throw Error("the result names no sensor", job.in, "name the stream with --sensor");
  if (job.meaning.asks_anything())
    change_meaning(job, order, notes);
  else if (job.result.frame_instant || job.result.frame_row)
    notes.push_back("the stamps mean the same instant and row as before, now on the other clock");
  Restamped out = restamp_recording(job.in, job.out, order, job.open);
  out.notes.insert(out.notes.begin(), notes.begin(), notes.end());
  return out;
}

void publish_recording(const std::string& temporary, const std::string& final_name) {
  publish(temporary, final_name);
}

}  // namespace takt
