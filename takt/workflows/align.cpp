// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/align.h"

#include <fmt/core.h>

#include <algorithm>
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
  notes.push_back(camera.name +
                  ": the scale of its field of view is estimated; --intrinsics FILE or --fov says better");
  return visual_rotation(camera, job.assumed_fov_rad, options);
}

RotationSignal rotation_of_tracks(const TrackStream& tracks, const AlignJob& job) {
  if (!job.intrinsics.empty()) {
    TrackStream known = tracks;
    known.model = read_camera_file(job.intrinsics, tracks.name);
    return track_rotation(known);
  }
  if (!(tracks.model.fx > 0))
    throw Error("has no intrinsics, so its pixels have no directions", tracks.name,
                "write them into calib.yaml, or give a camera file: --intrinsics FILE");
  return track_rotation(tracks);
}

ImuStream tidied(const ImuStream& imu, std::vector<std::string>& notes) {
  Tidied out = tidy(imu);
  for (const std::string& word : out.words) notes.push_back(fmt::format("{}: {}", imu.name, word));
  return std::move(out.imu);
}

RotationSignal rotation_of(const StreamRef& stream, const AlignJob& job, std::vector<std::string>& notes) {
  if (stream.camera) return camera_rotation(*stream.camera, job, notes);
  if (stream.tracks) return rotation_of_tracks(*stream.tracks, job);
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

/// A folder of numbered pictures does not say which stamp of its list belongs to which picture. Each way of pairing
/// them is tried; where the stamps are not even (a gap, a pause), only the right one fits the gyro.
constexpr const char* numbered_folder = "frame folder";

struct Pairing {
  int shift;
  Estimate estimate;
  double log_likelihood = 0;  ///< of the rotations, up to a constant
};

double extra(const Estimate& e, const char* name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  return 0;
}

std::vector<Pairing> try_pairings(const AlignJob& job, const StreamPair& pair, const Estimate& as_given) {
  std::vector<Pairing> all;
  for (const int shift : {-2, -1, 0, 1, 2}) {
    std::vector<std::string> ignored;
    Pairing p{shift, as_given};
    if (shift != 0) {
      OpenOptions open = job.open;
      open.frame_shift = shift;
      try {
        const Recording other = open_recording(job.inputs.front(), open);
        p.estimate = align_streams(pick_pair(other, pair.sensor.name(), pair.reference.name()).sensor, pair.reference,
                                   job, ignored);
      } catch (const Error&) {
        continue;  // the list of stamps ends before the pictures do
      }
    }
    if (!p.estimate.answered()) continue;
    p.log_likelihood = extra(p.estimate, "log_likelihood");
    all.push_back(std::move(p));
  }
  return all;
}

/// Says which pairing the motion confirms. Even stamps cannot tell: another pairing then is another offset, and
/// nothing else.
void judge_pairing(Estimate& e, const std::vector<Pairing>& all) {
  const auto given = std::find_if(all.begin(), all.end(), [](const Pairing& p) { return p.shift == 0; });
  if (given == all.end() || all.size() < 2) return;
  const auto best = std::max_element(
      all.begin(), all.end(), [](const Pairing& a, const Pairing& b) { return a.log_likelihood < b.log_likelihood; });
  double second = -1e300;
  Panel panel;
  panel.name = "pairing";
  panel.kind = "points";
  panel.title = "Which stamp belongs to which picture";
  panel.caption = "Log likelihood of the rotations when picture N takes stamp N + shift, against the best.";
  panel.x = {"shift", "", {}, {}};
  Series likelihood{"log likelihood", "", {}, {}};
  for (const Pairing& p : all) {
    if (p.shift != best->shift) second = std::max(second, p.log_likelihood);
    panel.x.values.push_back(p.shift);
    likelihood.values.push_back(p.log_likelihood - best->log_likelihood);
    e.extras.push_back(
        {fmt::format("pairing_{:+d}_log_likelihood", p.shift), p.log_likelihood - best->log_likelihood, std::nullopt});
    e.extras.push_back(
        {fmt::format("pairing_{:+d}_offset_s", p.shift), to_seconds(*p.estimate.offset), p.estimate.sigma_s});
  }
  panel.y = {std::move(likelihood)};
  e.evidence.panels.push_back(std::move(panel));
  const double clear = best->log_likelihood - second;
  constexpr double clear_nats = 12;  // as for a rival peak
  const double worse = best->log_likelihood - given->log_likelihood;
  if (worse > clear_nats)
    e.doubt(Verdict::weak, fmt::format("the motion fits better by {:.0f} nats when picture N takes stamp N{:+d} "
                                       "(--frame-shift {})",
                                       worse, best->shift, best->shift));
  else if (clear < clear_nats)
    e.doubt(
        Verdict::weak,
        fmt::format("the motion does not tell which stamp belongs to which picture: the stamps are even, and ways of "
                    "pairing them differ by no more than {:.1f} nats; the answer is for the pairing that the notes "
                    "name",
                    std::max(worse, clear)));
  else
    e.reasons.push_back(
        fmt::format("the motion confirms how pictures and stamps are paired: the next best way fits "
                    "worse by {:.0f} nats",
                    clear));
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
    const StreamPair pair = pick_pair(first, job.sensor, job.reference);
    out.estimate = align_pair(pair, job, notes);
    if (first.format == numbered_folder && pair.sensor.camera && job.open.frame_shift == 0 && out.estimate.answered())
      judge_pairing(out.estimate, try_pairings(job, pair, out.estimate));
  } else {
    const Recording second = open(job.inputs[1]);
    out.estimate = align_pair(pick_pair(first, second, job.sensor, job.reference), job, notes);
  }
  out.estimate.notes = std::move(notes);
  return out;
}

}  // namespace takt
