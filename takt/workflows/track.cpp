// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/track.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "takt/error.h"
#include "takt/recording/camera_file.h"
#include "takt/recording/files.h"
#include "takt/recording/live_lines.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/tracks_folder.h"
#include "takt/signals/feature_tracks.h"
#include "takt/signals/track_rotation.h"
#include "takt/streams/audit.h"
#include "takt/workflows/offset_history.h"

namespace takt {

namespace {

/// A camera's frames one after another, from given tracks or from pictures.
struct Feed {
  std::string name;
  FrameTiming timing;
  CameraModel model;
  std::optional<Mat4> T_body_cam;
  std::optional<double> pixel_sigma;
  std::function<std::optional<TrackedFrame>()> read;
  std::optional<TrackedFrame> next{};
  void advance() { next = read(); }
};

Feed feed_of(const TrackStream& t) {
  return {t.name, t.timing, t.model, t.T_body_cam, t.pixel_sigma, [&t, at = std::size_t{0}]() mutable {
            if (at == t.size()) return std::optional<TrackedFrame>{};
            ++at;
            return std::optional<TrackedFrame>{{t.stamps[at - 1], 0, t.features[at - 1]}};
          }};
}

Feed feed_of(const CameraStream& c, const CameraModel& model) {
  FrameTiming timing = c.timing;
  timing.rows = model.height;
  const auto reader = std::make_shared<FeatureTrackReader>(c, model);
  return {c.name, timing, model, c.T_body_cam, std::nullopt, [reader]() {
            auto frame = reader->next();
            if (!frame) return std::optional<TrackedFrame>{};
            return std::optional<TrackedFrame>{{frame->stamp, frame->exposure_s, std::move(frame->features)}};
          }};
}

/// The cameras that are followed, the one to answer for first: all that are calibrated, or the one that is named.
std::vector<Feed> feeds(const Recording& r, const TrackJob& job) {
  std::vector<Feed> out;
  for (const TrackStream& t : r.tracks)
    if (job.sensor.empty() || t.name == job.sensor) out.push_back(feed_of(t));
  const bool tracks_given = !out.empty();
  for (const CameraStream& c : r.cameras) {
    if (job.sensor.empty() ? tracks_given : c.name != job.sensor) continue;
    const bool further = !out.empty();
    if (!job.intrinsics.empty()) {
      if (!further) out.push_back(feed_of(c, read_camera_file(job.intrinsics, c.name)));
    } else if (c.model && (!further || c.T_body_cam)) {
      out.push_back(feed_of(c, *c.model));
    } else if (!further) {
      throw Error(c.name + " has no intrinsics", r.path, "give them with --intrinsics FILE");
    }
  }
  if (out.empty())
    throw Error(job.sensor.empty() ? "there is no camera to track" : "no camera is named " + job.sensor, r.path,
                "look into it with: takt inspect");
  return out;
}

const ImuStream& reference(const Recording& r, const TrackJob& job) {
  for (const ImuStream& i : r.imus)
    if (job.reference.empty() || i.name == job.reference) {
      if (i.accel_m_s2.size() != i.size())
        throw Error(i.name + " has no accelerometer", r.path, "use takt align, which needs the gyro only");
      return i;
    }
  throw Error(job.reference.empty() ? "there is no IMU" : "no IMU is named " + job.reference, r.path,
              "look into it with: takt inspect");
}

TrackingRig rig_of(const std::string& path, const std::vector<Feed>& cameras, const ImuStream& imu) {
  TrackingRig rig;
  rig.imu_name = imu.name;
  rig.imu_noise = imu.noise;
  for (const Feed& f : cameras) {
    if (!(f.model.fx > 0))
      throw Error(f.name + " has no intrinsics", path, "add them to its calibration (docs/formats/inputs.md)");
    if (!f.T_body_cam)
      throw Error(f.name + ": how the camera is mounted on the IMU is not known", path,
                  "add T_BS or T_imu_cam to its calibration (docs/formats/inputs.md)");
    TrackingCamera c{f.name, f.model, f.timing, *f.T_body_cam, f.pixel_sigma};
    if (imu.T_body_imu) c.T_imu_cam = imu.T_body_imu->inverse() * *f.T_body_cam;
    rig.cameras.push_back(std::move(c));
  }
  return rig;
}

/// Hands a recording to the tracker as it would have come live: everything in order of its stamp.
class Replay {
 public:
  Replay(OffsetTracker& tracker, const TrackJob& job, OffsetHistory& history)
      : tracker_(tracker), job_(job), history_(history) {}

  void run(const ImuStream& imu, std::vector<Feed>& cameras) {
    for (Feed& f : cameras) f.advance();
    // Clocks that never met are set side by side.
    const bool apart = clocks_apart(imu, cameras);
    for (std::size_t i = 0; i < imu.size(); ++i) {
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        const Duration shift = apart ? first_[c] - imu.stamps.front() : Duration{0};
        while (cameras[c].next && cameras[c].next->stamp - shift <= imu.stamps[i]) give(c, cameras[c]);
      }
      tracker_.observe_imu({imu.stamps[i], imu.gyro_rad_s[i], imu.accel_m_s2[i]});
      tell();
      if (job_.progress && i % 500 == 0) job_.progress(static_cast<double>(i) / static_cast<double>(imu.size()));
    }
    for (std::size_t c = 0; c < cameras.size(); ++c)
      while (cameras[c].next) give(c, cameras[c]);
    tracker_.finish();
    tell();
  }

 private:
  bool clocks_apart(const ImuStream& imu, const std::vector<Feed>& cameras) {
    bool apart = false;
    for (const Feed& f : cameras) {
      first_.push_back(f.next ? f.next->stamp : Stamp{});
      if (f.next && !imu.stamps.empty())
        apart =
            apart || f.next->stamp > imu.stamps.back() || f.next->stamp < imu.stamps.front() - std::chrono::seconds(10);
    }
    return apart;
  }
  void give(std::size_t c, Feed& feed) {
    tracker_.observe_frame(c, *feed.next);
    feed.advance();
    tell();
  }
  void tell() {
    if (tracker_.counts().frames == used_) return;
    used_ = tracker_.counts().frames;
    const OffsetNow now = tracker_.estimate(0);
    history_.observe(now, tracker_.counts());
    if (job_.on_estimate) job_.on_estimate(now);
    if (const auto pose = tracker_.pose(); pose && job_.on_pose) job_.on_pose(*pose);
  }

  OffsetTracker& tracker_;
  const TrackJob& job_;
  OffsetHistory& history_;
  std::vector<Stamp> first_;
  std::size_t used_ = 0;
};

/// Lines of a pipe as they come. Lines that say nothing are left out and counted.
std::vector<std::string> listen(std::istream& in, const TrackingRig& rig, OffsetTracker& tracker, const TrackJob& job,
                                OffsetHistory& history) {
  std::size_t lines = 0, broken = 0, used = 0;
  std::string line, why, first_why;
  while (std::getline(in, line)) {
    ++lines;
    if (line.empty()) continue;
    const auto sample = read_live_line(line, why);
    const auto* frame = sample ? std::get_if<LiveFrame>(&*sample) : nullptr;
    if (!sample) {
      if (broken++ == 0) first_why = fmt::format("line {} {}", lines, why);
    } else if (const auto* imu = std::get_if<LiveImuSample>(&*sample)) {
      if (imu->imu == rig.imu_name) tracker.observe_imu({imu->stamp, imu->gyro_rad_s, imu->accel_m_s2});
    } else {
      for (std::size_t c = 0; c < rig.cameras.size(); ++c)
        if (rig.cameras[c].name == frame->camera)
          tracker.observe_frame(c, {frame->stamp, frame->exposure_s, frame->features});
    }
    if (tracker.counts().frames == used) continue;
    used = tracker.counts().frames;
    history.observe(tracker.estimate(0), tracker.counts());
    if (job.on_estimate) job.on_estimate(tracker.estimate(0));
    if (const auto pose = tracker.pose(); pose && job.on_pose) job.on_pose(*pose);
  }
  tracker.finish();
  if (broken > 0 && broken == lines)
    throw Error("no line is a sample: " + first_why, "stdin", "see docs/formats/stream.md");
  if (broken == 0) return {};
  return {fmt::format("{} of {} lines were left out: {}", broken, lines, first_why)};
}

/// What a simulator wrote beside its recording, for the report.
std::optional<Estimate> truth_beside(const std::string& input, const TrackingRig& rig) {
  const std::filesystem::path file = std::filesystem::path(input) / "truth.json";
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed)) return std::nullopt;
  try {
    Estimate truth = estimate_from_json(read_file(file.string()), file.string());
    if (truth.sensor == rig.cameras.front().name) return truth;
  } catch (const Error&) {
    // Not a result of ours: there is no truth to draw.
  }
  return std::nullopt;
}

/// The answer, with what the other cameras and the whole run say.
Estimate answer(const OffsetTracker& tracker, const TrackingRig& rig, const OffsetHistory& history,
                const std::vector<std::string>& notes, const std::optional<Estimate>& truth) {
  Estimate e = tracker.result(0);
  e.notes.insert(e.notes.begin(), notes.begin(), notes.end());
  history.complete(e, truth);
  if (rig.cameras.size() > 1)
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) e.estimates.push_back(tracker.result(c));
  return e;
}

}  // namespace

Outcome track_live(const TrackJob& job, std::istream& in) {
  if (job.rig.empty())
    throw Error("a live stream needs its rig", "stdin", "give the calibration with --rig calib.yaml");
  Outcome out;
  out.files = {job.rig};
  const Recording described = read_rig(read_file(job.rig), job.rig);
  std::vector<Feed> cameras;
  for (const TrackStream& t : described.tracks)
    if (job.sensor.empty() || t.name == job.sensor) cameras.push_back(feed_of(t));
  if (cameras.empty()) throw Error("has no camera " + job.sensor, job.rig, "name one of its sections");
  TrackingRig rig = rig_of(job.rig, cameras, described.imus.front());
  if (!job.reference.empty()) rig.imu_name = job.reference;
  OffsetTracker tracker(rig, job.tracking, [](const TrackStream& t) { return track_rotation(t); });
  OffsetHistory history;
  std::vector<std::string> notes = described.notes;
  for (std::string& note : listen(in, rig, tracker, job, history)) notes.push_back(std::move(note));
  out.estimate = answer(tracker, rig, history, notes, std::nullopt);
  return out;
}

Outcome track(const TrackJob& job) {
  Outcome out;
  const Recording recording = open_recording(job.input, job.open);
  out.files = recording.files;
  std::vector<Feed> cameras = feeds(recording, job);
  std::vector<std::string> notes = recording.notes;
  Tidied imu = tidy(reference(recording, job));
  for (const std::string& word : imu.words) notes.push_back(fmt::format("{}: {}", imu.imu.name, word));
  const TrackingRig rig = rig_of(recording.path, cameras, imu.imu);
  OffsetTracker tracker(rig, job.tracking, [](const TrackStream& t) { return track_rotation(t); });
  OffsetHistory history;
  Replay(tracker, job, history).run(imu.imu, cameras);
  out.estimate = answer(tracker, rig, history, notes, truth_beside(job.input, rig));
  return out;
}

}  // namespace takt
