// SPDX-License-Identifier: Apache-2.0
// The delay from rendered pictures against truth: 640×480, 50 frames/s, exposures, meanings of the stamp, roll, rolling
// shutter, both dials.
//   accuracy_pendulum_film [SECONDS [FIRST [LAST]]]     length of a run, 30 unless told; which of the 20 runs
// Last figures: bench/accuracy/pendulum_film.txt
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "takt/estimators/pendulum/pendulum.h"
#include "takt/signals/dial/dial_angle.h"
#include "takt/simulation/pendulum_film.h"

int main(int argc, char** argv) {
  using namespace takt;
  const double duration = argc > 1 ? std::atof(argv[1]) : 30;
  const int first = argc > 2 ? std::atoi(argv[2]) : 0, last = argc > 3 ? std::atoi(argv[3]) : 20;
  const double exposures[] = {1.0e-3, 1.5e-3, 2.0e-3};
  const ExposureInstant stamps[] = {ExposureInstant::start, ExposureInstant::middle, ExposureInstant::end};
  const char* const stamp_names[] = {"start", "middle", "end"};
  std::printf("%3s %5s %8s %6s %5s %7s | %8s %8s %6s %8s | %s\n", "run", "dial", "exposure", "stamp", "roll", "rolling",
              "error us", "sigma us", "z", "pictures", "line delay error, sigma (us/row)");
  double squares = 0, worst = 0, worst_z = 0;
  for (int k = first; k < last; ++k) {
    PendulumRig rig = pendulum_rig("ordinary");
    rig.duration_s = duration;
    rig.camera.exposure_s = exposures[k % 3];
    rig.camera.stamp = stamps[k / 3 % 3];
    const bool plain = k % 4 == 3, rolled = k >= 9 && k % 2 == 0, rolling = k >= 14;
    if (rolling) rig.camera.line_delay_s = 20e-6;
    DialScene scene = dial_scene(plain ? DialKind::plain : DialKind::coded);
    scene.view.roll_rad = rolled ? std::numbers::pi / 6 : 0;
    const auto seed = static_cast<std::uint64_t>(1000 + k);
    const PendulumFilm film = film_pendulum(rig, scene, seed, 1);
    const PendulumRecording run = simulate_pendulum(rig, seed);
    DialOptions read;
    read.method = plain ? DialMethod::keyframes : DialMethod::coded;
    read.rest_reading_rad = std::numbers::pi / 4;
    AngleStream angles = dial_angles(film.camera, scene.dial, scene.view, read).angles;
    angles.timing.readout_s = 0;  // to be found
    PendulumOptions options;
    options.estimate_line_delay = rolling;
    const Estimate e = calibrate_pendulum(angles, run.imus[0], options);
    // The same gyro with angles that are exact: what is left of the difference is the pictures' doing.
    rig.camera.angle_noise_rad = 0;
    rig.camera.bands = rolling ? 4 : 1;
    const Estimate exact = calibrate_pendulum(simulate_pendulum(rig, seed).dial, run.imus[0], options);
    if (!e.answered() || !exact.answered()) {
      std::printf("%3d refused: %s\n", k, e.reasons.front().c_str());
      continue;
    }
    const double error = to_seconds(*e.offset - *run.truth[0].offset), z = error / *e.sigma_s;
    squares += z * z;
    worst = std::max(worst, std::abs(error));
    worst_z = std::max(worst_z, std::abs(z));
    std::printf("%3d %5s %5.1f ms %6s %5d %7s | %8.2f %8.2f %6.2f %8.2f |", k, plain ? "plain" : "coded",
                1e3 * rig.camera.exposure_s, stamp_names[k / 3 % 3], rolled ? 30 : 0, rolling ? "yes" : "no",
                1e6 * error, 1e6 * *e.sigma_s, z, 1e6 * to_seconds(*e.offset - *exact.offset));
    if (rolling) std::printf(" %.3f %.3f", 1e6 * (*e.line_delay_s - 20e-6), 1e6 * *e.line_delay_sigma_s);
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("worst %.2f us, %.2f sigma; mean z^2 %.2f over %d runs\n", 1e6 * worst, worst_z, squares / (last - first),
              last - first);
}
