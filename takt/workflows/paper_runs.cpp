// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/paper_runs.h"

#include <atomic>
#include <cmath>
#include <numbers>

#include "takt/estimators/pendulum/pendulum.h"
#include "takt/math/parallel.h"
#include "takt/signals/dial/dial_angle.h"
#include "takt/simulation/pendulum_film.h"

namespace takt::paper {
namespace {

Delays delays_of(const Estimate& e, const Estimate& truth) {
  Delays d;
  d.truth = to_seconds(*truth.offset) * 1e3;
  if (e.estimates.size() != 3 || !e.answered()) return d;
  d.spline = to_seconds(*e.offset) * 1e3;
  d.sigma = *e.sigma_s * 1e3;
  if (e.estimates[1].answered()) d.damped = to_seconds(*e.estimates[1].offset) * 1e3;
  if (e.estimates[2].answered()) d.extrema = to_seconds(*e.estimates[2].offset) * 1e3;
  for (const Extra& x : e.estimates[2].extras)
    if (x.name == "swing_scatter_s") d.swing_variance = x.value * x.value * 1e6;
  return d;
}

/// All three estimators on the same swings.
Estimate calibrate_between(const AngleStream& dial, const ImuStream& imu, double from_deg, double to_deg) {
  return calibrate_pendulum(dial, imu,
                            {.window_from_deg = from_deg, .window_to_deg = to_deg, .window_is_required = true});
}

/// Runs jobs on all cores and reports how far they are, between two fractions of the whole.
class Jobs {
 public:
  Jobs(const PaperExperimentOptions& options, double from, double to) : options_(options), from_(from), to_(to) {}
  void add(std::function<void()> job) { jobs_.push_back(std::move(job)); }
  void run() {
    std::atomic<int> done = 0;
    parallel_for(static_cast<int>(jobs_.size()), options_.threads, [&](int i) {
      jobs_[static_cast<std::size_t>(i)]();
      const int so_far = ++done;
      if (options_.progress) options_.progress(from_ + (to_ - from_) * so_far / static_cast<double>(jobs_.size()));
    });
  }

 private:
  const PaperExperimentOptions& options_;
  double from_, to_;
  std::vector<std::function<void()>> jobs_;
};

/// From 17° to about 8°.
constexpr double short_s = 120;

/// Every recording has a seed of its own.
std::uint64_t seed_of(const PaperExperimentOptions& options, std::size_t experiment, std::size_t run) {
  return options.seed * 1'000'000 + experiment * 10'000 + run;
}

/// What a rig's camera sees: a bob may carry gyros of many settings before one film.
AngleStream read_film(const PendulumRig& rig, std::uint64_t seed) {
  const DialScene scene = dial_scene(DialKind::coded);
  const PendulumFilm film = film_pendulum(rig, scene, seed, 1);
  DialOptions options;
  options.threads = 1;  // films are read side by side
  return dial_angles(film.camera, scene.dial, scene.view, options).angles;
}

PendulumRig rig_of(double duration_s) {
  PendulumRig rig = pendulum_rig("paper");
  if (duration_s > 0) rig.duration_s = duration_s;
  return rig;
}

/// The pictures' angles, where they are asked for: the long film, one an exposure, one a repeat.
struct Films {
  AngleStream filters;
  std::array<AngleStream, 3> exposures;
  std::vector<AngleStream> repeats;
};

Films read_films(const PaperExperimentOptions& options) {
  Films films;
  if (!options.images) return films;
  films.repeats.resize(static_cast<std::size_t>(options.repeats));
  Jobs jobs(options, 0, 0.9);
  jobs.add([&] { films.filters = read_film(rig_of(0), seed_of(options, 50, 0)); });
  for (std::size_t x = 0; x < 3; ++x)
    jobs.add([&, x] {
      PendulumRig rig = rig_of(short_s);
      rig.camera.exposure_s = exposures_ms[x] * 1e-3;
      films.exposures[x] = read_film(rig, seed_of(options, 51, x));
    });
  for (std::size_t k = 0; k < films.repeats.size(); ++k)
    jobs.add([&, k] { films.repeats[k] = read_film(rig_of(short_s), seed_of(options, 52, k)); });
  jobs.run();
  return films;
}

void add_windows(Jobs& jobs, Runs& out, const Films& films, const PaperExperimentOptions& options) {
  out.swings.resize(3);
  for (std::size_t f = 0; f < 3; ++f)
    for (std::size_t r = 0; r < 4; ++r)
      jobs.add([&, f, r] {
        PendulumRig rig = rig_of(0);
        rig.imus[0].filter_delay_s = filters_ms[f] * 1e-3;
        rig.imus[0].output_rate_hz = rates_hz[r];
        const PendulumRecording run = simulate_pendulum(rig, seed_of(options, 0, 4 * f + r));
        const AngleStream& dial = options.images ? films.filters : run.dial;
        for (std::size_t w = 0; w < 3; ++w)
          out.windows[f][r][w] =
              delays_of(calibrate_between(dial, run.imus[0], windows_deg[w][0], windows_deg[w][1]), run.truth[0]);
        if (r > 0) return;
        for (const Panel& p : calibrate_between(dial, run.imus[0], 15, 2).evidence.panels)
          if (p.name == "delay_by_amplitude") out.swings[f] = p;
      });
}

/// Tables 4 and 5: `extrema` and `damped` on 15° to 9°, `spline` on every swing.
void add_rates(Jobs& jobs, Runs& out, const Films& films, const PaperExperimentOptions& options) {
  const auto n = static_cast<std::size_t>(options.runs);
  for (std::size_t f = 0; f < 3; ++f)
    for (std::size_t r = 0; r < 4; ++r) {
      out.rates[f][r].resize(n);
      for (std::size_t k = 0; k < n; ++k)
        jobs.add([&, f, r, k] {
          PendulumRig rig = rig_of(short_s);
          rig.imus[0].filter_delay_s = filters_ms[f] * 1e-3;
          rig.imus[0].output_rate_hz = rates_hz[r];
          const PendulumRecording run = simulate_pendulum(rig, seed_of(options, 1 + 4 * f + r, k));
          const AngleStream& dial = options.images ? films.repeats[k % films.repeats.size()] : run.dial;
          out.rates[f][r][k] = delays_of(calibrate_pendulum(dial, run.imus[0]), run.truth[0]);
        });
    }
}

void add_exposures(Jobs& jobs, Runs& out, const Films& films, const PaperExperimentOptions& options) {
  const auto n = static_cast<std::size_t>(options.runs);
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t m = 0; m < 3; ++m) {
      out.exposures[x][m].resize(n);
      for (std::size_t k = 0; k < n; ++k)
        jobs.add([&, x, m, k] {
          PendulumRig rig = rig_of(short_s);
          rig.camera.exposure_s = exposures_ms[x] * 1e-3;
          rig.camera.stamp = static_cast<ExposureInstant>(m);
          const PendulumRecording run = simulate_pendulum(rig, seed_of(options, 20 + 3 * x + m, k));
          AngleStream dial = run.dial;
          if (options.images) {
            dial = films.exposures[x];
            for (Stamp& t : dial.stamps) t -= from_seconds(run.dial.timing.to_exposure_middle_s(rig.camera.exposure_s));
          }
          dial.timing.instant = ExposureInstant::middle;  // as the paper takes every stamp
          out.exposures[x][m][k] = delays_of(calibrate_pendulum(dial, run.imus[0]), run.truth[0]);
        });
    }
}

void add_repeats(Jobs& jobs, Runs& out, const Films& films, const PaperExperimentOptions& options) {
  for (std::size_t c = 0; c < 5; ++c) {
    for (auto& imu : out.repeats) imu[c].resize(static_cast<std::size_t>(options.repeats));
    for (std::size_t k = 0; k < static_cast<std::size_t>(options.repeats); ++k)
      jobs.add([&, c, k] {
        PendulumRig rig = rig_of(short_s);
        rig.imus.push_back(rig.imus[0]);
        rig.imus[1].name = "imu1";
        for (std::size_t i = 0; i < 2; ++i) rig.imus[i].temperature_c = temperatures_c[i][c];
        const PendulumRecording run = simulate_pendulum(rig, seed_of(options, 40 + c, k));
        const AngleStream& dial = options.images ? films.repeats[k] : run.dial;
        for (std::size_t i = 0; i < 2; ++i)
          out.repeats[i][c][k] = delays_of(calibrate_between(dial, run.imus[i], 15, 9), run.truth[i]);
      });
  }
}

/// The Kalibr-class column of tables 4 to 7. Its own random numbers, so that it moves no other column.
void add_batches(Jobs& jobs, Runs& out, const PaperExperimentOptions& options) {
  const auto add = [&](const PendulumRig& rig, BatchDelay& to, std::size_t setting) {
    jobs.add([&options, rig, &to, setting] { to = batch_delay(rig, seed_of(options, 60, setting)); });
  };
  for (std::size_t f = 0; f < 3; ++f)
    for (std::size_t r = 0; r < 4; ++r) {
      PendulumRig rig = rig_of(0);
      rig.imus[0].filter_delay_s = filters_ms[f] * 1e-3;
      rig.imus[0].output_rate_hz = rates_hz[r];
      add(rig, out.batch_rates[f][r], 4 * f + r);
    }
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t m = 0; m < 3; ++m) {
      PendulumRig rig = rig_of(0);
      rig.camera.exposure_s = exposures_ms[x] * 1e-3;
      rig.camera.stamp = static_cast<ExposureInstant>(m);
      add(rig, out.batch_exposures[x][m], 12 + 3 * x + m);
    }
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t c = 0; c < 5; ++c) {
      PendulumRig rig = rig_of(0);
      rig.imus[0].temperature_c = temperatures_c[i][c];
      add(rig, out.batch_repeats[i][c], 21 + 5 * i + c);
    }
}

}  // namespace

Delays mean_of(const std::vector<Delays>& runs) {
  const auto n = static_cast<double>(runs.size());
  Delays mean{0, 0, 0, 0, 0, 0};
  for (const Delays& d : runs) {
    mean.extrema += d.extrema / n, mean.damped += d.damped / n, mean.spline += d.spline / n;
    mean.truth += d.truth / n, mean.swing_variance += d.swing_variance / n;
  }
  double squares = 0;
  for (const Delays& d : runs) squares += (d.spline - mean.spline) * (d.spline - mean.spline);
  mean.sigma = runs.size() > 1 ? std::sqrt(squares / (n - 1) / n) : runs.front().sigma;
  return mean;
}

Runs run_experiments(const PaperExperimentOptions& options) {
  const Films films = read_films(options);
  Runs out;
  Jobs jobs(options, options.images ? 0.9 : 0, 1);
  add_windows(jobs, out, films, options);
  add_rates(jobs, out, films, options);
  add_exposures(jobs, out, films, options);
  add_repeats(jobs, out, films, options);
  add_batches(jobs, out, options);
  jobs.run();
  return out;
}

}  // namespace takt::paper
