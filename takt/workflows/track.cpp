// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/track.h"

#include <fmt/core.h>

#include <algorithm>

#include "takt/error.h"
#include "takt/recording/open_recording.h"
#include "takt/signals/track_rotation.h"

namespace takt {

namespace {

/// The cameras that are followed: the sensor first.
std::vector<const TrackStream*> followed(const Recording& r, const TrackJob& job) {
  std::vector<const TrackStream*> out;
  for (const TrackStream& t : r.tracks)
    if (job.sensor.empty() || t.name == job.sensor) out.push_back(&t);
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

TrackingRig rig_of(const Recording& r, const std::vector<const TrackStream*>& cameras, const ImuStream& imu) {
  TrackingRig rig;
  rig.imu_name = imu.name;
  rig.imu_noise = imu.noise;
  for (const TrackStream* t : cameras) {
    if (!(t->model.fx > 0))
      throw Error(t->name + " has no intrinsics", r.path, "add them to calib.yaml (docs/formats/inputs.md)");
    if (!t->T_body_cam)
      throw Error(t->name + ": how the camera is mounted on the IMU is not known", r.path,
                  "add T_imu_cam to calib.yaml (docs/formats/inputs.md)");
    TrackingCamera c{t->name, t->model, t->timing, *t->T_body_cam, t->pixel_sigma};
    if (imu.T_body_imu) c.T_imu_cam = imu.T_body_imu->inverse() * *t->T_body_cam;
    rig.cameras.push_back(std::move(c));
  }
  return rig;
}

}  // namespace

Outcome track(const TrackJob& job) {
  Outcome out;
  const Recording recording = open_recording(job.input, job.open);
  out.files = recording.files;
  const auto cameras = followed(recording, job);
  const ImuStream& imu = reference(recording, job);
  OffsetTracker tracker(rig_of(recording, cameras, imu), job.tracking,
                        [](const TrackStream& t) { return track_rotation(t); });
  std::vector<std::size_t> at(cameras.size(), 0);
  std::size_t used = 0;
  const auto tell = [&] {
    if (tracker.counts().frames == used) return;
    used = tracker.counts().frames;
    if (job.on_estimate) job.on_estimate(tracker.estimate(0));
    if (const auto pose = tracker.pose(); pose && job.on_pose) job.on_pose(*pose);
  };
  for (std::size_t i = 0; i < imu.size(); ++i) {
    for (std::size_t c = 0; c < cameras.size(); ++c)
      while (at[c] < cameras[c]->size() && cameras[c]->stamps[at[c]] <= imu.stamps[i]) {
        tracker.observe_frame(c, {cameras[c]->stamps[at[c]], 0, cameras[c]->features[at[c]]});
        ++at[c];
        tell();
      }
    tracker.observe_imu({imu.stamps[i], imu.gyro_rad_s[i], imu.accel_m_s2[i]});
    tell();
    if (job.progress && i % 1000 == 0) job.progress(static_cast<double>(i) / static_cast<double>(imu.size()));
  }
  tracker.finish();
  tell();
  out.estimate = tracker.result(0);
  out.estimate.notes.insert(out.estimate.notes.begin(), recording.notes.begin(), recording.notes.end());
  return out;
}

}  // namespace takt
