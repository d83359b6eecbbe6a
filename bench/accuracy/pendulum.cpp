// SPDX-License-Identifier: Apache-2.0
// The pendulum's estimators against truth and against the Cramér–Rao bound.
//   accuracy_pendulum [RUNS [SEED]]
// Runs a rig, 300 unless told; every run has its own seed, and the runs of a rig go round the twelve settings of filter
// and output rate.
// Last figures: bench/accuracy/pendulum.txt
#include "takt/estimators/pendulum/pendulum.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "takt/simulation/pendulum_bound.h"

namespace {

/// Errors of one estimator in microseconds.
struct Errors {
  std::vector<double> error_us;
  double squares_of_z = 0;
  int covered = 0;

  void add(const takt::Estimate& e, double truth_s) {
    if (!e.answered()) return;
    const double error = takt::to_seconds(*e.offset) - truth_s, z = error / *e.sigma_s;
    error_us.push_back(error * 1e6);
    squares_of_z += z * z;
    covered += std::abs(z) < 1.959964;
  }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const double e : error_us) sum += e;
    return sum / static_cast<double>(error_us.size());
  }
  [[nodiscard]] double deviation() const {
    double squares = 0;
    for (const double e : error_us) squares += (e - mean()) * (e - mean());
    return std::sqrt(squares / static_cast<double>(error_us.size() - 1));
  }
  [[nodiscard]] double coverage() const { return static_cast<double>(covered) / static_cast<double>(error_us.size()); }
};

double extra(const takt::Estimate& e, const std::string& name) {
  for (const takt::Extra& x : e.extras)
    if (x.name == name) return x.value;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 300;
  std::printf(
      "%d runs a rig, 60 s each; microseconds. The standard error of a mean is std/sqrt(n), of a std %.1f %%,\n"
      "of a coverage near 95 %% %.1f points.\n\n",
      runs, 100 / std::sqrt(2.0 * runs), 100 * std::sqrt(0.95 * 0.05 / runs));
  std::printf("%-9s %5s | %7s %7s %7s %7s %9s %8s | %7s %7s | %8s %7s | %8s\n", "rig", "n", "spline", "std", "bound",
              "std/bnd", "mean z^2", "95% int", "damped", "std", "extrema", "std", "ms/run");
  double all = 0, covered = 0, in_bounds = 0;  // squares of errors over the bound's
  std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  for (const std::string name : {"ordinary", "viscous", "bearing", "drag", "small", "tilted"}) {
    Errors spline, damped, extrema;
    double bound = 0, time_s = 0;
    int refused = 0;
    for (int i = 0; i < runs; ++i) {
      takt::PendulumRig rig = takt::pendulum_rig(name);
      const double filters[] = {2.9e-3, 3.9e-3, 5.9e-3}, rates[] = {1000, 500, 250, 200};
      rig.imus[0].filter_delay_s = filters[i % 3];
      rig.imus[0].output_rate_hz = rates[i / 3 % 4];
      const takt::PendulumRecording run = takt::simulate_pendulum(rig, ++seed);
      takt::PendulumOptions options;
      if (name == "small") options = {.window_from_deg = 6, .window_to_deg = 2};
      const auto before = std::chrono::steady_clock::now();
      const takt::Estimate e = takt::calibrate_pendulum(run.dial, run.imus[0], options);
      time_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
      if (!e.answered()) {
        ++refused;
        continue;
      }
      const double truth = takt::to_seconds(*run.truth[0].offset);
      spline.add(e, truth);
      damped.add(e.estimates[1], truth);
      extrema.add(e.estimates[2], truth);
      // The bound is the same for all settings; a fresh window now and then averages what its ends do to it.
      if (i % 25 == 0)
        bound += 1e6 * takt::pendulum_bound_s(rig, rig.imus[0], extra(e, "window_from_s"), extra(e, "window_to_s")) /
                 ((runs + 24) / 25);
    }
    const double n = static_cast<double>(spline.error_us.size());
    all += n, covered += spline.covered, in_bounds += (n - 1) * std::pow(spline.deviation() / bound, 2);
    std::printf("%-9s %5.0f | %7.2f %7.2f %7.2f %7.3f %9.3f %7.1f%% | %7.2f %7.2f | %8.1f %7.2f | %8.1f%s\n",
                name.c_str(), n, spline.mean(), spline.deviation(), bound, spline.deviation() / bound,
                spline.squares_of_z / n, 100 * spline.coverage(), damped.mean(), damped.deviation(), extrema.mean(),
                extrema.deviation(), 1e3 * time_s / runs, refused ? " (some refused)" : "");
    std::fflush(stdout);
  }
  std::printf(
      "\nOver all %.0f runs the spline's standard deviation is %.3f +- %.3f of the bound and its 95 %% interval "
      "covers\n"
      "%.1f +- %.1f %%.\n",
      all, std::sqrt(in_bounds / (all - 6)), 1 / std::sqrt(2 * all), 100 * covered / all,
      100 * std::sqrt(0.95 * 0.05 / all));
}
