// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/handheld.h"

#include <algorithm>

#include "takt/version.h"

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

CameraStream rendered_camera(const HandheldOptions& o, const std::shared_ptr<const Trajectory>& trajectory,
                             const std::vector<Exposure>& exposures) {
  CameraStream out;
  out.name = "cam0";
  out.clock = "cam0";
  for (const Exposure& e : exposures) {
    out.stamps.push_back(e.stamp);
    out.exposures_s.push_back(e.exposure_s);
  }
  out.timing = o.camera.timing();
  out.model = o.camera.model();
  out.T_body_cam = o.camera.T_body_cam;
  const Vec3 half = o.motion.room_half_extent_m;
  const auto room = std::make_shared<const Room>(make_room(half, texel_for(half, *out.model), o.seed));
  const auto renderer = std::make_shared<const Renderer>(trajectory, o.camera, room, o.image_noise, o.seed);
  const auto schedule = std::make_shared<const std::vector<Exposure>>(exposures);
  out.open = [renderer, schedule, threads = o.threads] {
    return std::make_unique<RenderingReader>(renderer, schedule, threads);
  };
  return out;
}

Estimate truth_of(const HandheldOptions& o, const ClockMap<>& map) {
  const auto& piece = map.pieces().front();
  Estimate e;
  e.method = "truth";
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = piece.offset + from_seconds(o.imu.delay_s());
  e.sigma_s = 0;
  e.epoch = as_stamp(piece.epoch);
  e.drift = piece.drift;
  e.drift_sigma = 0;
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.line_delay_s = o.camera.timing().line_delay_s();
  e.line_delay_sigma_s = 0;
  e.T_reference_sensor = o.camera.T_body_cam;
  e.extras = {{"clock_offset_s", o.offset_s, 0.0}, {"imu_delay_s", o.imu.delay_s(), 0.0}};
  e.provenance.version = version;
  e.provenance.seed = o.seed;
  return e;
}

}  // namespace

SimulatedRecording simulate_handheld(const HandheldOptions& o) {
  SimulatedRecording out;
  out.clocks.offset_s = o.offset_s;
  out.clocks.drift = o.drift;
  out.trajectory = make_trajectory(o.motion, o.seed);
  out.exposures = simulate_exposures(o.camera, out.clocks, o.duration_s, o.seed);
  out.recording.format = "simulated";
  out.recording.notes.push_back("simulated: " + o.motion.name + ", seed " + std::to_string(o.seed));
  out.recording.imus.push_back(simulate_imu(*out.trajectory, o.imu, out.clocks, o.duration_s, o.seed));
  if (o.footage == Footage::images) {
    out.recording.cameras.push_back(rendered_camera(o, out.trajectory, out.exposures));
  } else {
    const auto landmarks = landmarks_on_walls(o.motion.room_half_extent_m, o.tracking.landmarks, o.seed);
    out.recording.tracks.push_back(
        simulate_tracks(*out.trajectory, o.camera, o.tracking, landmarks, out.exposures, o.seed));
  }
  out.truth = truth_of(o, out.clocks.sensor_to_reference(o.duration_s));
  return out;
}

}  // namespace takt
