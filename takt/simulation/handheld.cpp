// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/handheld.h"

#include <algorithm>

#include "takt/simulation/camera_truth.h"
#include "takt/simulation/random.h"

namespace takt {

namespace {

/// About what a pixel sees of a wall at the mean distance: finer would shimmer, coarser would look soft.
double texel_for(const Vec3& half_extent_m, const CameraModel& model) {
  return std::clamp(half_extent_m.mean() / model.fx, 0.002, 0.02);
}

class RenderingReader : public FrameReader {
 public:
  RenderingReader(std::shared_ptr<const Renderer> renderer, std::shared_ptr<const std::vector<Exposure>> exposures,
                  int threads)
      : renderer_(std::move(renderer)), exposures_(std::move(exposures)), threads_(threads) {}

  std::optional<Frame> next() override {
    if (at_ == exposures_->size()) return std::nullopt;
    const Exposure& e = (*exposures_)[at_];
    Frame frame{at_, e.stamp, e.exposure_s, renderer_->render(at_, e, threads_)};
    ++at_;
    return frame;
  }

 private:
  std::shared_ptr<const Renderer> renderer_;
  std::shared_ptr<const std::vector<Exposure>> exposures_;
  int threads_;
  std::size_t at_ = 0;
};

CameraStream rendered_camera(const HandheldOptions& o, const SimulatedCamera& camera, const std::string& name,
                             const std::shared_ptr<const Trajectory>& trajectory,
                             const std::vector<Exposure>& exposures) {
  CameraStream out;
  out.name = name;
  out.clock = name;
  for (const Exposure& e : exposures) {
    out.stamps.push_back(e.stamp);
    out.exposures_s.push_back(e.exposure_s);
  }
  out.timing = camera.timing();
  out.model = camera.model();
  out.T_body_cam = camera.T_body_cam;
  const Vec3 half = o.motion.room_half_extent_m;
  const auto room = std::make_shared<const Room>(make_room(half, texel_for(half, *out.model), o.seed));
  const auto renderer = std::make_shared<const Renderer>(trajectory, camera, room, o.image_noise, o.seed);
  const auto schedule = std::make_shared<const std::vector<Exposure>>(exposures);
  out.open = [renderer, schedule, threads = o.threads] {
    return std::make_unique<RenderingReader>(renderer, schedule, threads);
  };
  return out;
}

/// What the cameras' clocks do besides: stamps from the step on are earlier by it, so that the offset is larger.
void step_stamps(const HandheldOptions& o, std::vector<Exposure>& exposures, Estimate& truth) {
  if (o.step_s == 0) return;
  const OffsetPiece before{exposures.empty() ? Stamp{} : exposures.front().stamp, truth.epoch, *truth.offset,
                           *truth.drift, 0};
  OffsetPiece after = before;
  bool stepped = false;
  for (Exposure& e : exposures) {
    if (e.middle_s < o.step_at_s) continue;
    e.stamp -= from_seconds(o.step_s);
    if (!stepped) after.start = e.stamp;
    stepped = true;
  }
  if (!stepped) return;
  after.offset += from_seconds(o.step_s);
  truth.pieces = {before, after};
  // The answer at the end: that of the last piece.
  truth.epoch = exposures.back().stamp;
  truth.offset = after.offset + from_seconds(after.drift * seconds_since(after.epoch, truth.epoch));
}

void add_camera(const HandheldOptions& o, const SimulatedCamera& camera, const std::string& name,
                std::span<const Vec3> landmarks, const std::vector<Exposure>& exposures, std::uint64_t seed,
                SimulatedRecording& out) {
  if (o.footage == Footage::images) {
    out.recording.cameras.push_back(rendered_camera(o, camera, name, out.trajectory, exposures));
    return;
  }
  TrackStream tracks = simulate_tracks(*out.trajectory, camera, o.tracking, landmarks, exposures, seed);
  tracks.name = tracks.clock = name;
  out.recording.tracks.push_back(std::move(tracks));
}

/// The second camera stands to the right of the first and looks the same way.
void add_second_camera(const HandheldOptions& o, std::span<const Vec3> landmarks, SimulatedRecording& out) {
  SimulatedCamera camera = o.camera;
  camera.T_body_cam.topRightCorner<3, 1>() += camera.T_body_cam.topLeftCorner<3, 3>() * Vec3(0.11, 0, 0);
  SimulatedClocks clocks = out.clocks;
  clocks.offset_s += o.stereo_offset_s;
  const std::uint64_t seed = mix64(o.seed + 1);
  std::vector<Exposure> exposures = simulate_exposures(camera, clocks, o.duration_s, seed);
  Estimate truth = camera_truth("cam1", camera, o.imu, clocks, o.duration_s, o.seed);
  step_stamps(o, exposures, truth);
  add_camera(o, camera, "cam1", landmarks, exposures, seed, out);
  Estimate first = out.truth;
  out.truth.estimates = {std::move(first), std::move(truth)};
}

}  // namespace

SimulatedRecording simulate_handheld(const HandheldOptions& o) {
  SimulatedRecording out;
  out.clocks.offset_s = o.offset_s;
  out.clocks.drift = o.drift;
  out.trajectory = make_trajectory(o.motion, o.seed);
  out.exposures = simulate_exposures(o.camera, out.clocks, o.duration_s, o.seed);
  out.truth = camera_truth("cam0", o.camera, o.imu, out.clocks, o.duration_s, o.seed);
  step_stamps(o, out.exposures, out.truth);
  out.recording.format = "simulated";
  out.recording.notes.push_back("simulated: " + o.motion.name + ", seed " + std::to_string(o.seed));
  out.recording.imus.push_back(simulate_imu(*out.trajectory, o.imu, out.clocks, o.duration_s, o.seed));
  const auto landmarks = o.footage == Footage::tracks
                             ? landmarks_on_walls(o.motion.room_half_extent_m, o.tracking.landmarks, o.seed)
                             : std::vector<Vec3>{};
  add_camera(o, o.camera, "cam0", landmarks, out.exposures, o.seed, out);
  if (o.stereo) add_second_camera(o, landmarks, out);
  return out;
}

}  // namespace takt
