// SPDX-License-Identifier: Apache-2.0
// Many simulated recordings a scenario through the online estimator: is the offset right, and is its sigma honest?
//   accuracy_online [seeds] [method] [scenario...]
// TAKT_BENCH_SECONDS: how long the recordings are. TAKT_BENCH_LIES=1 lists every answer beyond 3 sigmas.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "takt/estimators/online/offset_tracker.h"
#include "takt/signals/track_rotation.h"
#include "takt/simulation/handheld.h"

namespace {

using namespace takt;

struct Scenario {
  const char* name;
  std::function<void(HandheldOptions&)> set;
};

const std::vector<Scenario> scenarios{
    {"handheld", [](HandheldOptions&) {}},
    {"fast",
     [](HandheldOptions& o) {
       o.motion = find_motion("fast");
       o.camera.rate_hz = 30;
     }},
    {"slow", [](HandheldOptions& o) { o.motion = find_motion("weak"); }},
    {"stereo",
     [](HandheldOptions& o) {
       o.stereo = true;
       o.stereo_offset_s = 0.0015;
     }},
    {"robot", [](HandheldOptions& o) { o.motion = find_motion("rig"); }},
    {"car", [](HandheldOptions& o) { o.motion = find_motion("car"); }},
    {"stops", [](HandheldOptions& o) { o.motion = find_motion("stops"); }},
    {"rolling", [](HandheldOptions& o) { o.camera.readout_s = 0.025; }},
    {"fisheye",
     [](HandheldOptions& o) {
       o.camera.lens = Distortion::equidistant;
       o.camera.fov_rad = 3.1;
       o.camera.width = o.camera.height = 512;
     }},
    {"drift-75", [](HandheldOptions& o) { o.drift = 75e-6; }},
    {"step-5ms", [](HandheldOptions& o) { o.step_s = 0.005, o.step_at_s = 30; }},
    {"jitter-2ms", [](HandheldOptions& o) { o.camera.jitter_s = 0.002; }},
    {"75ppm-jitter-drops",
     [](HandheldOptions& o) {
       o.drift = 75e-6;
       o.camera.jitter_s = 0.001, o.camera.drop_fraction = 0.05, o.imu.drop_fraction = 0.02;
     }},
    {"plus-500ms", [](HandheldOptions& o) { o.offset_s = 0.5; }},
    {"minus-500ms", [](HandheldOptions& o) { o.offset_s = -0.5; }},
    {"one-axis", [](HandheldOptions& o) { o.motion = find_motion("single_axis"); }},
    {"still", [](HandheldOptions& o) { o.motion = find_motion("still"); }},
    {"constant-velocity", [](HandheldOptions& o) { o.motion = find_motion("constant_velocity"); }},
    {"constant-rate", [](HandheldOptions& o) { o.motion = find_motion("constant_rate"); }},
};

/// One answer against its truth.
struct Told {
  double t_s, error_s, sigma_s;
  Verdict verdict;
};

double truth_at(const SimulatedRecording& made, Stamp stamp) {
  return to_seconds(made.truth.clock_map().offset_at(as<SensorClock>(stamp)));
}

std::vector<Told> run(const SimulatedRecording& made, const std::string& method) {
  TrackingRig rig;
  const ImuStream& imu = made.recording.imus.front();
  rig.imu_name = imu.name;
  rig.imu_noise = imu.noise;
  for (const TrackStream& t : made.recording.tracks)
    rig.cameras.push_back({t.name, t.model, t.timing, *t.T_body_cam, t.pixel_sigma});
  TrackingOptions options;
  options.method = method;
  OffsetTracker tracker(rig, options, [](const TrackStream& t) { return track_rotation(t); });
  // As they arrive: camera frames by true time, which the simulator's order is.
  std::vector<std::size_t> at(rig.cameras.size(), 0);
  std::vector<Told> told;
  std::size_t used = 0;
  const Stamp first = made.recording.tracks.front().stamps.front();
  const auto tell = [&] {
    if (tracker.counts().frames == used) return;
    used = tracker.counts().frames;
    const OffsetNow now = tracker.estimate(0);
    if (!now.offset) return;
    told.push_back({seconds_since(first, now.stamp), to_seconds(*now.offset) - truth_at(made, now.stamp), *now.sigma_s,
                    now.verdict});
  };
  for (std::size_t i = 0; i < imu.size(); ++i) {
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      const TrackStream& t = made.recording.tracks[c];
      while (at[c] < t.size() && t.stamps[at[c]] <= imu.stamps[i]) {
        tracker.observe_frame(c, {t.stamps[at[c]], 0, t.features[at[c]]});
        ++at[c];
        tell();
      }
    }
    tracker.observe_imu({imu.stamps[i], imu.gyro_rad_s[i], imu.accel_m_s2[i]});
    tell();
  }
  tracker.finish();
  tell();
  return told;
}

double quantile(std::vector<double> v, double q) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}

void study(const Scenario& s, int seeds, const std::string& method, double duration_s) {
  const std::vector<double> after{2, 10, duration_s - 4};
  std::vector<std::vector<double>> nees(after.size()), error(after.size()), sigma(after.size());
  std::vector<double> converged, bias;
  int answered = 0, lies = 0;
  double cpu_s = 0, beyond = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    HandheldOptions o;
    o.seed = static_cast<std::uint64_t>(seed);
    o.duration_s = duration_s;
    o.footage = Footage::tracks;
    o.tracking.pixel_noise_px = 1;
    s.set(o);
    const SimulatedRecording made = simulate_handheld(o);
    const auto start = std::clock();
    const std::vector<Told> told = run(made, method);
    cpu_s += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (told.empty()) continue;
    ++answered;
    double last_bad = told.front().t_s;
    int outside = 0;
    bool lied = false;
    for (const Told& t : told) {
      if (std::getenv("TAKT_BENCH_LIES") && std::abs(t.error_s) > 3 * t.sigma_s)
        fmt::print(stderr, "{} seed {}: after {:.2f} s (at {:.2f}) {:+.4f} ms, sigma {:.4f}, {}\n", s.name, seed,
                   t.t_s - told.front().t_s, t.t_s, 1e3 * t.error_s, 1e3 * t.sigma_s, to_string(t.verdict));
      if (std::abs(t.error_s) > 1e-3) last_bad = t.t_s;
      if (std::abs(t.error_s) > 3 * t.sigma_s) ++outside;
      if (t.verdict == Verdict::trusted && std::abs(t.error_s) > 4 * t.sigma_s) lied = true;
    }
    lies += lied;
    beyond += static_cast<double>(outside) / static_cast<double>(told.size());
    converged.push_back(last_bad - told.front().t_s);
    for (std::size_t k = 0; k < after.size(); ++k)
      for (const Told& t : told)
        if (t.t_s - told.front().t_s >= std::min(after[k], told.back().t_s - told.front().t_s - 0.1)) {
          nees[k].push_back(t.error_s * t.error_s / (t.sigma_s * t.sigma_s));
          error[k].push_back(t.error_s), sigma[k].push_back(t.sigma_s);
          break;
        }
  }
  const double n = std::max(answered, 1);
  fmt::print("{:<20} {:>2}/{:<2}  within 1 ms {:>4.1f}/{:>5.1f} s ", s.name, answered, seeds, quantile(converged, 0.5),
             quantile(converged, 1));
  for (std::size_t k = 0; k < after.size(); ++k) {
    double mean = 0, squares = 0, mean_nees = 0, mean_sigma = 0;
    for (std::size_t i = 0; i < nees[k].size(); ++i)
      mean += error[k][i] / n, squares += error[k][i] * error[k][i] / n, mean_nees += nees[k][i] / n,
          mean_sigma += sigma[k][i] / n;
    fmt::print("| {:>2.0f} s: rms {:.4f} σ {:.4f} bias {:+.4f} NEES {:.2f} ", after[k], 1e3 * std::sqrt(squares),
               1e3 * mean_sigma, 1e3 * mean, mean_nees);
  }
  fmt::print("| beyond 3σ {:.1f} %, trusted beyond 4σ {}, {:.2f} CPU-s\n", 100 * beyond / n, lies, cpu_s / seeds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 50;
  const std::string method = argc > 2 ? argv[2] : "filter";
  const char* length = std::getenv("TAKT_BENCH_SECONDS");
  const double duration_s = length ? std::atof(length) : 64;
  const double half = 1.96 * std::sqrt(2.0 / seeds);
  fmt::print("{} seeds of {:.0f} s, {}: errors in ms; NEES of a good filter lies in {:.2f} to {:.2f}\n", seeds,
             duration_s, method, 1 - half, 1 + half);
  for (const Scenario& s : scenarios) {
    bool wanted = argc <= 3;
    for (int i = 3; i < argc; ++i) wanted = wanted || std::string(argv[i]) == s.name;
    if (wanted) study(s, seeds, method, duration_s);
  }
}
