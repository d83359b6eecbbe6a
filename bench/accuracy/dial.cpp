// SPDX-License-Identifier: Apache-2.0
// The dial's reading against truth, method by method, in pixels.
//   accuracy_dial [SECONDS]     length of each film, 20 unless told
// Last figures: bench/accuracy/dial.txt
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>

#include "takt/signals/dial/dial_angle.h"
#include "takt/simulation/pendulum_film.h"

namespace {

struct Case {
  const char* name;
  takt::DialKind kind;
  takt::DialMethod method;
  double exposure_s, roll_deg, scale_error;
};

void run(const Case& c, double duration_s, std::uint64_t seed) {
  takt::PendulumRig rig = takt::pendulum_rig("ordinary");
  rig.duration_s = duration_s;
  rig.camera.exposure_s = c.exposure_s;
  takt::DialScene scene = takt::dial_scene(c.kind);
  scene.view.roll_rad = c.roll_deg * std::numbers::pi / 180;
  const takt::PendulumFilm film = takt::film_pendulum(rig, scene, seed, 1);
  takt::DialView told = scene.view;
  told.camera.fx *= 1 + c.scale_error;
  told.camera.fy *= 1 + c.scale_error;
  takt::DialOptions options;
  options.method = c.method;
  options.rest_reading_rad = 45.5 * std::numbers::pi / 180;
  const auto before = std::chrono::steady_clock::now();
  const takt::DialAngles read = takt::dial_angles(film.camera, scene.dial, told, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  // Constant, and drift in time, and the rest.
  double n = 0, mean = 0, squares = 0, t1 = 0, t2 = 0, e1 = 0, sigma = 0;
  for (std::size_t i = 0; i < read.frame.size(); ++i) {
    const double e = (read.angles.angle_rad[i] - film.reading_rad[read.frame[i]]) / read.pixel_rad;
    const double t = static_cast<double>(read.frame[i]) / 50;
    ++n, mean += e, squares += e * e, t1 += t, t2 += t * t, e1 += e * t, sigma += read.sigma_rad[i] / read.pixel_rad;
  }
  const double slope = (e1 - mean * t1 / n) / (t2 - t1 * t1 / n);
  std::printf("%-22s %6.0f %4zu | %9.4f %8.4f %10.5f %8.4f %8.4f | %6.1f s\n", c.name, n, read.left_out, mean / n,
              std::sqrt(squares / n - mean * mean / n / n), slope * 60, sigma / n, read.scale, seconds);
  for (const std::string& note : read.notes) std::printf("    %s\n", note.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration = argc > 1 ? std::atof(argv[1]) : 20;
  using takt::DialKind, takt::DialMethod;
  std::printf("%-22s %6s %4s | %9s %8s %10s %8s %8s |\n", "film", "frames", "out", "mean px", "rms px", "drift/min",
              "sigma", "scale");
  std::uint64_t seed = 0;
  for (const Case& c : {Case{"coded 1 ms", DialKind::coded, DialMethod::coded, 1e-3, 0, 0},
                        Case{"coded 2 ms", DialKind::coded, DialMethod::coded, 2e-3, 0, 0},
                        Case{"coded roll 30", DialKind::coded, DialMethod::coded, 1e-3, 30, 0},
                        Case{"coded focal +2 %", DialKind::coded, DialMethod::coded, 1e-3, 0, 0.02},
                        Case{"plain keyframes", DialKind::plain, DialMethod::keyframes, 1e-3, 0, 0},
                        Case{"plain keyframes 2 ms", DialKind::plain, DialMethod::keyframes, 2e-3, 0, 0},
                        Case{"plain keyframes roll", DialKind::plain, DialMethod::keyframes, 1e-3, 30, 0},
                        Case{"plain neighbours", DialKind::plain, DialMethod::neighbours, 1e-3, 0, 0}})
    run(c, duration, ++seed);
}
