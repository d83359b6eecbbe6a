// SPDX-License-Identifier: Apache-2.0
// Batch calibration from corners to result: CPU time of each step, by length. One thread.
// Last figures: bench/speed/batch.txt
#include <cstdio>
#include <ctime>
#include <vector>

#include "takt/estimators/batch/batch.h"
#include "takt/estimators/batch/spline_model.h"
#include "takt/simulation/simulated_corners.h"

namespace {

double cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main() {
  using namespace takt;
  std::printf("CPU ms   %7s %7s %7s %9s %7s %10s\n", "poses", "start", "IMU", "discrete", "spline", "whole auto");
  for (const double length : {10.0, 40.0, 160.0}) {
    TargetFilmOptions o;
    o.duration_s = length;
    const SimulatedBoard run = simulate_board(o);
    const double t0 = cpu_s();
    const auto camera = batch::open_camera(run.cameras[0], 1);
    const double t1 = cpu_s();
    const auto imu = batch::open_imu(run.imus[0]);
    const double t2 = cpu_s();
    const auto start = batch::find_start(camera, imu);
    const double t3 = cpu_s();
    const auto fast = batch::fit_discrete(camera, imu, start, 1);
    const double t4 = cpu_s();
    batch::SplineOptions wanted;
    wanted.threads = 1;
    batch::SplineModel model({{&camera}, {&imu}}, batch::join_pairs({&fast}, {}), wanted);
    const bool solved = model.solve();
    const double t5 = cpu_s();
    BatchOptions whole;
    whole.threads = 1;
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0], whole);
    const double t6 = cpu_s();
    std::printf("%5.0f s  %7.0f %7.0f %7.0f %9.0f %7.0f %10.0f%s\n", length, 1e3 * (t1 - t0), 1e3 * (t3 - t2),
                1e3 * (t2 - t1), 1e3 * (t4 - t3), 1e3 * (t5 - t4), 1e3 * (t6 - t5),
                solved && e.answered() ? "" : "  (no answer)");
  }
}
