// SPDX-License-Identifier: Apache-2.0
// The delay from rendered pictures against truth: 640×480, 50 frames/s, released at 17°; exposures, meanings of the
// stamp, roll, rolling shutter, both dials; each film with a gyro of the MPU9250's noise and one of the ICM-42688's.
//   accuracy_pendulum_film [SECONDS [FIRST [LAST]]]     length of a run, 60 unless told; which of the 24 runs
// Last figures: bench/accuracy/pendulum_film.txt
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "takt/estimators/pendulum/pendulum.h"
#include "takt/signals/dial/dial_angle.h"
#include "takt/simulation/pendulum_film.h"

namespace {

using namespace takt;
constexpr double deg = std::numbers::pi / 180, us = 1e6;
constexpr double line_delay_s = 20e-6;
constexpr std::array<double, 2> densities_deg_s{0.01, 0.0028};  // MPU9250, ICM-42688-P: of their data sheets

struct Case {
  PendulumRig rig = pendulum_rig("ordinary");
  DialScene scene;
  bool plain, rolled, rolling;
};

Case case_of(int k, double duration_s) {
  constexpr double exposures[] = {1.0e-3, 1.5e-3, 2.0e-3};
  constexpr ExposureInstant stamps[] = {ExposureInstant::start, ExposureInstant::middle, ExposureInstant::end};
  Case c;
  c.plain = k % 4 == 3, c.rolled = k >= 9 && k % 2 == 0, c.rolling = k >= 14;
  c.rig.start_angle_rad = 17 * deg;
  c.rig.duration_s = duration_s;
  c.rig.camera.exposure_s = exposures[k % 3];
  c.rig.camera.stamp = stamps[k / 3 % 3];
  c.rig.camera.line_delay_s = c.rolling ? line_delay_s : 0;
  c.scene = dial_scene(c.plain ? DialKind::plain : DialKind::coded);
  c.scene.view.roll_rad = c.rolled ? 30 * deg : 0;
  return c;
}

struct Tally {
  int runs = 0;
  double worst_us = 0, worst_z = 0, squares = 0, pictures_us = 0;
};

/// Error and what the pictures have added to it, for one gyro.
void judge(const Case& c, const AngleStream& angles, double density_deg_s, std::uint64_t seed, Tally& tally) {
  PendulumRig rig = c.rig;
  rig.imus[0].noise_density = density_deg_s * deg;
  const PendulumRecording run = simulate_pendulum(rig, seed);
  const PendulumOptions options{.estimate_line_delay = c.rolling};
  const Estimate e = calibrate_pendulum(angles, run.imus[0], options);
  // The same gyro with angles that are exact: what is left of the difference is the pictures' doing.
  rig.camera.angle_noise_rad = 1e-9;
  rig.camera.bands = c.rolling ? 2 : 1;
  const Estimate exact = calibrate_pendulum(simulate_pendulum(rig, seed).dial, run.imus[0], options);
  if (!e.answered() || !exact.answered()) {
    std::printf(" | refused: %s", e.reasons.empty() ? "" : e.reasons.front().c_str());
    return;
  }
  const double error = us * to_seconds(*e.offset - *run.truth[0].offset), z = error / (us * *e.sigma_s);
  const double pictures = us * to_seconds(*e.offset - *exact.offset);
  std::printf(" | %7.2f %6.2f %5.2f %6.2f", error, us * *e.sigma_s, z, pictures);
  if (c.rolling && density_deg_s == densities_deg_s.back())
    std::printf(" | %6.3f %6.3f", us * (*e.line_delay_s - line_delay_s), us * *e.line_delay_sigma_s);
  ++tally.runs;
  tally.squares += z * z;
  tally.worst_us = std::max(tally.worst_us, std::abs(error));
  tally.worst_z = std::max(tally.worst_z, std::abs(z));
  tally.pictures_us = std::max(tally.pictures_us, std::abs(pictures));
}

double rms_px(const DialAngles& read, const PendulumFilm& film, const Case& c) {
  const PendulumMotion motion(c.rig.pendulum, c.rig.start_angle_rad, 0, c.rig.duration_s);
  double n = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < read.angles.size(); ++i) {
    double truth = film.reading_rad[read.frame[i]];
    if (c.rolling) {
      const double exposure = c.rig.camera.exposure_s;
      const double t = seconds_since(from_ns(c.rig.epoch_ns), read.angles.stamps[i]) +
                       read.angles.timing.to_exposure_middle_s(exposure) + read.angles.rows[i] * line_delay_s;
      truth = c.scene.rest_deg * deg + motion.mean_angle(t - 0.5 * exposure, t + 0.5 * exposure);
    }
    const double e = (read.angles.angle_rad[i] - truth) / read.pixel_rad;
    ++n, sum += e, squares += e * e;
  }
  return std::sqrt(squares / n - sum * sum / n / n);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration = argc > 1 ? std::atof(argv[1]) : 60;
  const int first = argc > 2 ? std::atoi(argv[2]) : 0, last = argc > 3 ? std::atoi(argv[3]) : 24;
  const char* const stamp_names[] = {"start", "middle", "end"};
  std::printf("%3s %5s %8s %6s %4s %7s %6s | %7s %6s %5s %6s | %7s %6s %5s %6s | %s\n", "run", "dial", "exposure",
              "stamp", "roll", "rolling", "rms px", "0.01: e", "sigma", "z", "pict.", "0.0028:", "sigma", "z", "pict.",
              "line delay: error, sigma (us/row)");
  Tally tallies[2];
  for (int k = first; k < last; ++k) {
    const Case c = case_of(k, duration);
    const auto seed = static_cast<std::uint64_t>(2000 + k);
    const PendulumFilm film = film_pendulum(c.rig, c.scene, seed, 1);
    DialOptions options;
    options.method = c.plain ? DialMethod::keyframes : DialMethod::coded;
    options.rest_reading_rad = c.scene.rest_deg * deg;
    const DialAngles read = dial_angles(film.camera, c.scene.dial, c.scene.view, options);
    std::printf("%3d %5s %5.1f ms %6s %4d %7s %6.4f", k, c.plain ? "plain" : "coded", 1e3 * c.rig.camera.exposure_s,
                stamp_names[static_cast<int>(k / 3 % 3)], c.rolled ? 30 : 0, c.rolling ? "yes" : "no",
                rms_px(read, film, c));
    for (std::size_t g = 0; g < 2; ++g) judge(c, read.angles, densities_deg_s[g], seed, tallies[g]);
    std::printf("\n");
    std::fflush(stdout);
  }
  for (std::size_t g = 0; g < 2; ++g)
    std::printf("gyro %.4f deg/s/sqrt(Hz): worst %.2f us, %.2f sigma; mean z^2 %.2f over %d runs; pictures %.2f us\n",
                densities_deg_s[g], tallies[g].worst_us, tallies[g].worst_z, tallies[g].squares / tallies[g].runs,
                tallies[g].runs, tallies[g].pictures_us);
}
