// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "takt/simulation/random.h"

namespace takt {

namespace {

bool in_image(const CameraModel& m, const Vec2& p, double margin) {
  const double edge = 0.5 + margin;
  return p.x() >= -edge && p.y() >= -edge && p.x() < m.width - 1 + edge && p.y() < m.height - 1 + edge;
}

/// What the tracker remembers of a landmark.
struct Followed {
  std::int64_t id = -1;  ///< −1: not followed now
  int frames_left = 0;
};

}  // namespace

FrameView::FrameView(const Trajectory& truth, const SimulatedCamera& camera, const CameraModel& model, double middle_s)
    : truth_(truth),
      model_(model),
      T_body_cam_(camera.T_body_cam),
      middle_s_(middle_s),
      line_delay_s_(camera.timing().line_delay_s()),
      margin_px_(10 + model.fx * camera.readout_s * truth.omega_body(middle_s + 0.5 * camera.readout_s).norm()),
      cam_from_world_(cam_from_world(truth, T_body_cam_, middle_s + 0.5 * camera.readout_s)) {}

std::optional<Vec2> FrameView::pixel_of(const Vec3& point_world) const {
  std::optional<Vec2> pixel = model_.project(cam_from_world_ * point_world);
  if (!pixel) return std::nullopt;
  if (line_delay_s_ == 0) return in_image(model_, *pixel, 0) ? pixel : std::nullopt;
  // What lies far outside while the middle row is read does not come in while the others are.
  if (!in_image(model_, *pixel, margin_px_)) return std::nullopt;
  // Fixed point: the row says when, when says the row. It contracts as long as the picture moves slower than the
  // readout.
  for (int round = 0; round < 50; ++round) {
    const double row = pixel->y();
    pixel = model_.project(cam_from_world(truth_, T_body_cam_, middle_s_ + row * line_delay_s_) * point_world);
    if (!pixel || !in_image(model_, *pixel, 2 * margin_px_)) return std::nullopt;
    if (std::abs(pixel->y() - row) < 1e-9) return in_image(model_, *pixel, 0) ? pixel : std::nullopt;
  }
  return std::nullopt;
}

TrackStream simulate_tracks(const Trajectory& truth, const SimulatedCamera& camera, const SimulatedTracking& tracking,
                            std::span<const Vec3> landmarks, std::span<const Exposure> exposures, std::uint64_t seed) {
  TrackStream out;
  out.name = "cam0";
  out.clock = "cam0";
  out.timing = camera.timing();
  out.model = camera.model();
  out.pixel_sigma = tracking.pixel_noise_px;
  out.T_body_cam = camera.T_body_cam;

  std::vector<Followed> followed(landmarks.size());
  std::int64_t next_id = 1;
  for (std::size_t frame = 0; frame < exposures.size(); ++frame) {
    // A stream a frame: the noise of one frame does not depend on what was in view before.
    Random random(mix64(seed) + frame, "tracks");
    const FrameView view(truth, camera, out.model, exposures[frame].middle_s);
    std::vector<TrackedFeature> features;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto pixel = view.pixel_of(landmarks[i]);
      Followed& feature = followed[i];
      if (!pixel || random.chance(tracking.miss_fraction)) {
        feature.id = -1;
        continue;
      }
      if (feature.id >= 0 && feature.frames_left-- <= 0) {
        feature.id = -1;  // lost: unseen for this frame at least
        continue;
      }
      Vec2 seen = *pixel + tracking.pixel_noise_px * Vec2(random.normal(), random.normal());
      if (random.chance(tracking.outlier_fraction)) {
        const double angle = random.uniform(0, 2 * std::numbers::pi);
        seen += random.uniform(5, 50) * Vec2(std::cos(angle), std::sin(angle));
      }
      if (!in_image(out.model, seen, 0)) {
        feature.id = -1;
        continue;
      }
      if (feature.id < 0) {
        feature.id = next_id++;
        feature.frames_left = static_cast<int>(-tracking.mean_length * std::log1p(-random.uniform()));
      }
      features.push_back({feature.id, seen});
    }
    std::ranges::sort(features, {}, &TrackedFeature::id);
    out.stamps.push_back(exposures[frame].stamp);
    out.features.push_back(std::move(features));
  }
  return out;
}

}  // namespace takt
