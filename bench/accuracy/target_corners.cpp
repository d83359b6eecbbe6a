// SPDX-License-Identifier: Apache-2.0
// The corners of rendered boards against truth, and what finding them costs.
//   accuracy_target_corners [SECONDS]     length of each film, 10 unless told
// Last figures: bench/accuracy/target_corners.txt
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "takt/signals/target/target_corners.h"
#include "takt/simulation/target_film.h"
#include "takt/simulation/tracks.h"

namespace {

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void run(const std::string& name, takt::TargetFilmOptions options, double duration_s) {
  options.duration_s = duration_s;
  options.threads = 1;
  const takt::TargetFilm film = takt::simulate_target(options);
  takt::CameraStream camera = film.recording.cameras.front();
  // Rendered first, so that only the search is timed.
  auto frames = std::make_shared<std::vector<takt::Frame>>();
  const double start = cpu_s();
  for (auto reader = camera.open(); auto frame = reader->next();) frames->push_back(std::move(*frame));
  const double rendered = cpu_s() - start;
  class Held : public takt::FrameReader {
   public:
    explicit Held(std::shared_ptr<const std::vector<takt::Frame>> f) : frames_(std::move(f)) {}
    std::optional<takt::Frame> next() override {
      return at_ < frames_->size() ? std::optional((*frames_)[at_++]) : std::nullopt;
    }

   private:
    std::shared_ptr<const std::vector<takt::Frame>> frames_;
    std::size_t at_ = 0;
  };
  camera.open = [frames] { return std::make_unique<Held>(frames); };
  const double before = cpu_s();
  const takt::CornerStream found = takt::find_target_corners(camera, options.scene.target, {.threads = 1});
  const double searched = cpu_s() - before;

  double n = 0, visible = 0, seen = 0, du = 0, dv = 0, squares = 0, worst = 0, off = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const takt::FrameView view(*film.trajectory, film.cameras[0], *camera.model, film.exposures[0][i].middle_s);
    for (const takt::Vec3& p : film.board)
      visible +=
          view.pixel_of(film.world_from_board * p) && film.exposures[0][i].middle_s >= options.scene.appears_s ? 1 : 0;
    seen += found.corners[i].empty() ? 0 : 1;
    for (const takt::CornerObservation& c : found.corners[i]) {
      const auto truth = view.pixel_of(film.world_from_board * film.board[static_cast<std::size_t>(c.corner)]);
      if (!truth) continue;
      const takt::Vec2 e = c.pixel - *truth;
      ++n, du += e.x(), dv += e.y(), squares += e.squaredNorm();
      worst = std::max(worst, e.norm());
      off += e.norm() > 0.5 ? 1 : 0;
    }
  }
  std::printf(
      "%-34s %5.1f %% frames %5.1f %% corners | rms %.4f px, mean %+.4f %+.4f, worst %.2f, > 0.5 px %.0f | %5.1f ms to "
      "find, %5.1f to render\n",
      name.c_str(), 100 * seen / static_cast<double>(found.size()), 100 * n / visible, std::sqrt(squares / (2 * n)),
      du / n, dv / n, worst, off, 1e3 * searched / static_cast<double>(frames->size()),
      1e3 * rendered / static_cast<double>(frames->size()));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration = argc > 1 ? std::atof(argv[1]) : 10;
  takt::TargetFilmOptions plain;
  auto exposed = [&](double exposure_s) {
    takt::TargetFilmOptions o = plain;
    o.camera.exposure_s = exposure_s;
    return o;
  };
  if (argc < 3) {
    takt::TargetFilmOptions o = exposed(0);
    o.scene.noise = {0, 0};
    run("aprilgrid, no blur, no noise", o, duration);
  }
  if (argc < 3) run("aprilgrid, no blur", exposed(0), duration);
  run("aprilgrid, 2 ms", exposed(0.002), duration);
  if (argc < 3) run("aprilgrid, 5 ms", exposed(0.005), duration);
  if (argc < 3) run("aprilgrid, 10 ms", exposed(0.010), duration);
  if (argc < 3) {
    takt::TargetFilmOptions o = plain;
    o.camera.readout_s = 480 * 30e-6;
    run("aprilgrid, 2 ms, rolling 30 us/row", o, duration);
  }
  if (argc < 3) {
    takt::TargetFilmOptions o = plain;
    o.scene.target = takt::AprilGrid{.border_cells = 1};
    run("aprilgrid, 1-bit border, 2 ms", o, duration);
  }
  if (argc < 3) {
    takt::TargetFilmOptions o = plain;
    o.motion.turn_calm_rad_s = o.motion.turn_lively_rad_s = 0.2;
    o.motion.speed_calm_m_s = o.motion.speed_lively_m_s = 0.05;
    run("aprilgrid, weak motion, 2 ms", o, duration);
  }
  if (argc < 3) {
    takt::TargetFilmOptions o = plain;
    o.scene.target = takt::Checkerboard{9, 6, 0.07, 0.07};
    run("checkerboard, 2 ms", o, duration);
    o.scene.target = takt::CircleGrid{4, 11, 0.045, true};
    run("circles, asymmetric, 2 ms", o, duration);
    o.scene.target = takt::CircleGrid{7, 6, 0.08, false};
    run("circles, 2 ms", o, duration);
    o.scene.target = takt::Charuco{8, 6, 0.09, 0.066};
    run("charuco, 2 ms", o, duration);
  }
}
