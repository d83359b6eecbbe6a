// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/pendulum_film.h"

#include <algorithm>
#include <numbers>

#include "takt/simulation/random.h"

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

/// All that the pictures need, shared by the readers.
struct Set {
  PendulumRig rig;
  PendulumMotion motion;
  DialRenderer renderer;
  double rest_rad;
  std::vector<double> middles_s;  ///< of the first row
  std::vector<Stamp> stamps;
  int threads;

  [[nodiscard]] double reading(double t) const {
    const double inside = std::clamp(t, 0.0, motion.duration_s());
    return rest_rad + motion.at(inside).angle + rig.wobble.dial_share * wobble_angle(rig.wobble, inside);
  }
};

class FilmReader final : public FrameReader {
 public:
  explicit FilmReader(std::shared_ptr<const Set> set) : set_(std::move(set)) {}

  std::optional<Frame> next() override {
    if (index_ >= set_->middles_s.size()) return std::nullopt;
    const DialCameraModel& camera = set_->rig.camera;
    Frame frame{index_, set_->stamps[index_], camera.exposure_s, {}};
    frame.image = set_->renderer.render(
        index_, [this](double t) { return set_->reading(t); }, set_->middles_s[index_], camera.exposure_s,
        camera.line_delay_s, set_->threads);
    ++index_;
    return frame;
  }
  void skip_to(std::size_t index) override { index_ = std::max(index_, index); }

 private:
  std::shared_ptr<const Set> set_;
  std::size_t index_ = 0;
};

}  // namespace

PendulumFilm film_pendulum(const PendulumRig& rig, const DialScene& scene, std::uint64_t seed, int threads) {
  const DialCameraModel& model = rig.camera;
  const CameraModel& lens = scene.view.camera;
  auto set = std::make_shared<Set>(Set{rig,
                                       PendulumMotion(rig.pendulum, rig.start_angle_rad, 0, rig.duration_s),
                                       DialRenderer(scene, seed),
                                       scene.rest_deg * deg + model.rest_reading_rad,
                                       {},
                                       {},
                                       threads});
  PendulumFilm film;
  film.camera.name = model.name;
  film.camera.clock = "rig";
  film.camera.model = lens;
  film.camera.timing = {.instant = model.stamp,
                        .shutter = model.line_delay_s == 0 ? Shutter::global : Shutter::rolling,
                        .exposure_s = model.exposure_s,
                        .readout_s = model.line_delay_s * lens.height,
                        .rows = lens.height};
  const double half = 0.5 * model.exposure_s, interval = 1 / model.frame_rate_hz;
  const double to_stamp = -film.camera.timing.to_exposure_middle_s(model.exposure_s);
  const double last = rig.duration_s - half - film.camera.timing.readout_s;
  Random random(seed, "dial");
  for (double t = half + interval * random.uniform(); t < last; t += interval) {
    set->middles_s.push_back(t);
    set->stamps.push_back(from_ns(rig.epoch_ns) + from_seconds(t + to_stamp));
    film.reading_rad.push_back(set->rest_rad + set->motion.mean_angle(t - half, t + half) +
                               rig.wobble.dial_share * wobble_angle(rig.wobble, t));
  }
  film.camera.stamps = set->stamps;
  film.camera.open = [set = std::shared_ptr<const Set>(std::move(set))]() -> std::unique_ptr<FrameReader> {
    return std::make_unique<FilmReader>(set);
  };
  return film;
}

}  // namespace takt
