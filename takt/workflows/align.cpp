// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/align.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "takt/error.h"
#include "takt/recording/camera_file.h"
#include "takt/recording/open_recording.h"
#include "takt/signals/attitude_rotation.h"
#include "takt/signals/gyro_rotation.h"
#include "takt/signals/track_rotation.h"
#include "takt/signals/visual_rotation.h"
#include "takt/streams/audit.h"
#include "takt/workflows/pick_streams.h"

namespace takt {

namespace {

RotationSignal camera_rotation(const CameraStream& camera, const AlignJob& job, std::vector<std::string>& notes) {
  VisualRotationOptions options;
  options.progress = job.progress;
  if (!job.intrinsics.empty()) return visual_rotation(camera, read_camera_file(job.intrinsics, camera.name), options);
  if (camera.model) return visual_rotation(camera, *camera.model, options);
  notes.push_back(fmt::format(
      "{}: no intrinsics; a horizontal field of view of {:.0f}° is assumed and its scale estimated (--intrinsics FILE)",
      camera.name, job.assumed_fov_rad * 180 / std::numbers::pi));
  return visual_rotation(camera, job.assumed_fov_rad, options);
}

ImuStream tidied(const ImuStream& imu, std::vector<std::string>& notes) {
  Tidied out = tidy(imu);
  for (const std::string& word : out.words) notes.push_back(fmt::format("{}: {}", imu.name, word));
  return std::move(out.imu);
}

RotationSignal rotation_of(const StreamRef& stream, const AlignJob& job, std::vector<std::string>& notes) {
  if (stream.camera) return camera_rotation(*stream.camera, job, notes);
  if (stream.tracks) return track_rotation(*stream.tracks);
  if (stream.attitude) return attitude_rotation(*stream.attitude);
  const ImuStream imu = tidied(*stream.imu, notes);
  if (imu.size() < 8)
    throw Error(fmt::format("{} has only {} usable samples", imu.name, imu.size()), imu.name,
                "check it with: takt inspect");
  return gyro_rotation(imu);
}

Estimate align_streams(const StreamRef& sensor, const StreamRef& reference, const AlignJob& job,
                       std::vector<std::string>& notes) {
  const ImuStream gyro = tidied(*reference.imu, notes);
  const RotationSignal signal = rotation_of(sensor, job, notes);
  notes.insert(notes.end(), signal.notes.begin(), signal.notes.end());
  return align_rotation(signal, gyro, job.alignment);
}

Estimate align_pair(const StreamPair& pair, const AlignJob& job, std::vector<std::string>& notes) {
  if (pair.reference.is_gyro()) return align_streams(pair.sensor, pair.reference, job, notes);
  if (pair.sensor.is_gyro()) return inverse(align_streams(pair.reference, pair.sensor, job, notes));
  throw Error(fmt::format("neither {} nor {} is a gyro", pair.sensor.name(), pair.reference.name()), job.inputs.front(),
              "one of the two must be; name it with --reference");
}

}  // namespace

Outcome align(const AlignJob& job) {
  Outcome out;
  std::vector<std::string> notes;
  const auto open = [&](const std::string& path) {
    Recording r = open_recording(path, job.open);
    notes.insert(notes.end(), r.notes.begin(), r.notes.end());
    out.files.insert(out.files.end(), r.files.begin(), r.files.end());
    return r;
  };
  const Recording first = open(job.inputs.at(0));
  if (job.inputs.size() == 1) {
    out.estimate = align_pair(pick_pair(first, job.sensor, job.reference), job, notes);
  } else {
    const Recording second = open(job.inputs[1]);
    out.estimate = align_pair(pick_pair(first, second, job.sensor, job.reference), job, notes);
  }
  out.estimate.notes = std::move(notes);
  return out;
}

}  // namespace takt
