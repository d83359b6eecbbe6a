// SPDX-License-Identifier: Apache-2.0
// Batch calibration against truth, from corners (no pictures): 6 × 6 AprilGrid of 0.088 m, 752 × 480 radtan.
//   accuracy_batch [RUNS]     runs a row, 60 unless told; run i of every row has the seed i
// Last figures: bench/accuracy/batch.txt
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "takt/estimators/batch/batch.h"
#include "takt/motion/rigid.h"
#include "takt/simulation/simulated_corners.h"

namespace {

using namespace takt;

struct Row {
  const char* name;
  double duration_s;
  std::function<void(TargetFilmOptions&)> change;
  std::function<void(SimulatedBoard&)> spoil = [](SimulatedBoard&) {};
  SimulatedDetection detection = {};
};

/// The IMU misses half a second, the camera two.
void gaps(SimulatedBoard& run) {
  for (std::size_t k = 160; k < 200; ++k) run.cameras[0].corners[k].clear();
  ImuStream& imu = run.imus[0];
  const auto cut = [](auto& of) { of.erase(of.begin() + 2700, of.begin() + 2800); };
  cut(imu.stamps), cut(imu.gyro_rad_s), cut(imu.accel_m_s2);
}

void run_row(const Row& row, int runs) {
  double squares = 0, sigma = 0, z2 = 0, turn2 = 0, shift2 = 0, end2 = 0, n = 0;
  int covered = 0, weak = 0, refused = 0;
  for (int seed = 1; seed <= runs; ++seed) {
    TargetFilmOptions o;
    o.seed = static_cast<std::uint64_t>(seed);
    o.duration_s = row.duration_s;
    row.change(o);
    SimulatedBoard run = simulate_board(o, row.detection);
    row.spoil(run);
    run.cameras[0].timing.shutter = Shutter::unknown;
    run.cameras[0].timing.readout_s = 0;
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    if (!e.answered()) {
      ++refused;
      continue;
    }
    weak += e.verdict == Verdict::weak;
    const double error = to_seconds(*e.offset - *run.truth.offset) - o.drift * to_seconds(e.epoch - run.truth.epoch);
    const Rigid found = Rigid::from_matrix(*e.T_reference_sensor),
                is = Rigid::from_matrix(*run.truth.T_reference_sensor);
    squares += error * error;
    sigma += *e.sigma_s;
    z2 += error * error / (*e.sigma_s * *e.sigma_s);
    covered += std::abs(error) < 1.959964 * *e.sigma_s;
    turn2 += log_so3(is.rotation.conjugate() * found.rotation).squaredNorm();
    shift2 += (found.translation - is.translation).squaredNorm();
    const double end = std::abs(error) + 0.5 * o.duration_s * std::abs(*e.drift - o.drift);
    end2 += end * end;
    n += 1;
  }
  const auto rms = [&](double sum) { return std::sqrt(sum / n); };
  std::printf("%-28s %4.0f %8.2f %8.2f %6.2f %6.1f%% %8.2f %9.4f %8.3f %5d %5d\n", row.name, n, 1e6 * rms(squares),
              1e6 * sigma / n, rms(z2), 100 * covered / n, 1e6 * rms(end2), rms(turn2) * 57.29578, 1e3 * rms(shift2),
              weak, refused);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 60;
  std::printf("%d runs a row; offset in µs, its standard error is a factor of 1 ± %.2f; z = error/sigma\n\n", runs,
              1 / std::sqrt(2.0 * runs));
  std::printf("%-28s %4s %8s %8s %6s %7s %8s %9s %8s %5s %5s\n", "case", "n", "rms", "sigma", "rms z", "95%int",
              "at ends", "rot deg", "mm", "weak", "ref.");
  const std::vector<Row> rows{
      {"40 s", 40, [](TargetFilmOptions&) {}},
      {"20 s", 20, [](TargetFilmOptions&) {}},
      {"10 s", 10, [](TargetFilmOptions&) {}},
      {"20 s, weak: 0.2 rad/s", 20, [](TargetFilmOptions& o) { o.motion = TargetFilmOptions::target_motion(0.2); }},
      {"20 s, offset -500 ms", 20, [](TargetFilmOptions& o) { o.offset_s = -0.5; }},
      {"20 s, drift 200 ppm", 20, [](TargetFilmOptions& o) { o.drift = 200e-6; }},
      {"20 s, rolling 30 µs/row", 20, [](TargetFilmOptions& o) { o.camera.readout_s = 30e-6 * 480; }},
      {"20 s, jitter 2 ms", 20, [](TargetFilmOptions& o) { o.camera.jitter_s = 2e-3; }},
      {"20 s, gaps, board from 3 s on", 20, [](TargetFilmOptions&) {}, gaps, {.absent_until_s = 3}},
      {"10 s, 50 Hz, IMU 1 kHz", 10,
       [](TargetFilmOptions& o) {
         o.camera.rate_hz = 50;
         o.imu.rate_hz = 1000;
       }},
  };
  for (const Row& row : rows) run_row(row, runs);
}
