// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/simulated_corners.h"

#include <cmath>
#include <numbers>

#include "takt/simulation/random.h"
#include "takt/simulation/tracks.h"

namespace takt {

namespace {

CornerStream corners_of(const TargetFilm& film, std::size_t number, const SimulatedDetection& detection,
                        std::uint64_t seed) {
  const CameraStream& camera = film.recording.cameras[number];
  CornerStream out = without_corners(camera, film.board);
  std::vector<Vec3> points;
  for (const Vec3& p : film.board) points.push_back(film.world_from_board * p);
  const auto& exposures = film.exposures[number];
  for (std::size_t frame = 0; frame < exposures.size(); ++frame) {
    Random random(mix64(seed + number) + frame, "corners");
    const FrameView view(*film.trajectory, film.cameras[number], *out.model, exposures[frame].middle_s);
    std::vector<CornerObservation> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double u = random.normal(), v = random.normal();
      const bool missed = random.chance(detection.miss_fraction), strays = random.chance(detection.outlier_fraction);
      const double angle = random.uniform(0, 2 * std::numbers::pi), stray = random.uniform(2, 20);
      const auto pixel = view.pixel_of(points[i]);
      if (!pixel || missed || exposures[frame].middle_s < detection.absent_until_s) continue;
      Vec2 at = *pixel + detection.noise_px * Vec2(u, v);
      if (strays) at += stray * Vec2(std::cos(angle), std::sin(angle));
      seen.push_back({static_cast<std::int32_t>(i), at});
    }
    out.corners[frame] = std::move(seen);
  }
  return out;
}

}  // namespace

SimulatedBoard simulate_board(const TargetFilmOptions& o, const SimulatedDetection& detection) {
  SimulatedBoard out;
  out.film = simulate_target(o);
  out.imus = out.film.recording.imus;
  out.truth = out.film.truth;
  for (std::size_t k = 0; k < out.film.cameras.size(); ++k)
    out.cameras.push_back(corners_of(out.film, k, detection, o.seed));
  return out;
}

}  // namespace takt
