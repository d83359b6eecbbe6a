// SPDX-License-Identifier: Apache-2.0
// How far the alignment's answers are from the truth, and whether their σ says so. Prints Markdown.
//   accuracy_alignment [--runs N] [--first N] [--images N] [--only NAME] [--each]
//     --runs    seeds a scenario (default 14)
//     --first   the first of them (default 1)
//     --images  seeds a scenario of rendered pictures (default 20)
//     --only    scenarios whose name contains this
//     --each    one line a run to stderr
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "takt/estimators/alignment/alignment.h"
#include "takt/math/parallel.h"
#include "tests/alignment_cases.h"

namespace {

using namespace takt;
using cases::Scenario;
using cases::Sensor;

struct Arguments {
  int runs = 14, images = 20, first = 1;
  std::string only;
  bool each = false;
};

std::vector<Scenario> answerable() {
  constexpr double readout_s = 0.02;
  return {
      {.name = "gyro, handheld", .sensor = Sensor::gyro},
      {.name = "gyro, rig", .motion = "rig", .sensor = Sensor::gyro, .duration_s = 60},
      {.name = "gyro, fast", .motion = "fast", .sensor = Sensor::gyro},
      {.name = "gyro, weak", .motion = "weak", .sensor = Sensor::gyro},
      {.name = "gyro, single axis", .motion = "single_axis", .sensor = Sensor::gyro},
      {.name = "gyro, drift 50 ppm", .sensor = Sensor::gyro, .duration_s = 120, .drift = 50e-6},
      {.name = "gyro, second-order low-pass", .sensor = Sensor::gyro, .low_pass = LowPassKind::second_order},
      {.name = "gyro, FIR low-pass", .sensor = Sensor::gyro, .low_pass = LowPassKind::fir},
      {.name = "tracks, handheld"},
      {.name = "tracks, rig", .motion = "rig", .duration_s = 60},
      {.name = "tracks, fast", .motion = "fast"},
      {.name = "tracks, weak", .motion = "weak"},
      {.name = "tracks, single axis", .motion = "single_axis"},
      {.name = "tracks, drift 50 ppm", .duration_s = 120, .drift = 50e-6},
      {.name = "tracks, outliers 5 %", .outliers = 0.05},
      {.name = "tracks, FIR low-pass", .low_pass = LowPassKind::fir},
      {.name = "tracks, known rolling shutter", .readout_s = readout_s},
      {.name = "tracks, unknown rolling shutter", .readout_s = readout_s, .readout_known = false},
      {.name = "tracks, dropped frames 5 %", .frame_drop = 0.05},
      {.name = "images, handheld", .sensor = Sensor::images, .duration_s = 12},
      {.name = "images, unknown rolling shutter",
       .sensor = Sensor::images,
       .duration_s = 12,
       .readout_s = readout_s,
       .readout_known = false},
  };
}

std::vector<Scenario> unanswerable() {
  std::vector<Scenario> out;
  for (const Sensor sensor : {Sensor::gyro, Sensor::tracks})
    for (const char* motion : {"still", "single_tone", "translation_only", "constant_rate"})
      out.push_back({.name = fmt::format("{}, {}", sensor == Sensor::gyro ? "gyro" : "tracks", motion),
                     .motion = motion,
                     .sensor = sensor});
  return out;
}

struct Run {
  Estimate found;
  double error_s = 0;                           ///< of the answer
  std::optional<double> drift_z, line_delay_z;  ///< error/σ where both are there
};

std::optional<double> z_of(std::optional<double> found, std::optional<double> sigma, std::optional<double> truth) {
  if (!found || !sigma || !(*sigma > 0) || !truth) return std::nullopt;
  return (*found - *truth) / *sigma;
}

/// Every method's error, and what the chosen one says of itself.
std::string line_of(const Scenario& scenario, std::uint64_t seed, const Run& run, const Estimate& truth,
                    double took_s) {
  std::string line =
      fmt::format("{:<32} {:>3} {:>8} {:.2f} s", scenario.name, seed, to_string(run.found.verdict), took_s);
  for (const Estimate& e : run.found.estimates) {
    if (!e.answered() || !e.sigma_s) continue;
    const double error_s = cases::offset_error_s(e, truth);
    line += fmt::format("  {} {:+.2f} µs z {:+.2f}", e.method, 1e6 * error_s, error_s / *e.sigma_s);
  }
  for (const Extra& x : run.found.extras) line += fmt::format("  {} {:.4g}", x.name, x.value);
  if (run.drift_z) line += fmt::format("  drift {:+.2f} ppm z {:+.2f}", 1e6 * *run.found.drift, *run.drift_z);
  if (run.line_delay_z) line += fmt::format("  line delay z {:+.2f}", *run.line_delay_z);
  for (const std::string& why : run.found.reasons) line += "  [" + why + "]";
  return line;
}

Run run(const Scenario& scenario, std::uint64_t seed, bool each) {
  const cases::Recorded r = cases::record(scenario, seed);
  Run out;
  const auto begin = std::chrono::steady_clock::now();
  out.found = align_rotation(r.sensor, r.reference);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (out.found.answered()) out.error_s = cases::offset_error_s(out.found, r.truth);
  out.drift_z = z_of(out.found.drift, out.found.drift_sigma, r.truth.drift);
  out.line_delay_z = z_of(out.found.line_delay_s, out.found.line_delay_sigma_s, r.truth.line_delay_s);
  if (each) std::fprintf(stderr, "%s\n", line_of(scenario, seed, out, r.truth, took_s).c_str());
  return out;
}

std::vector<Run> run_all(const Scenario& scenario, int runs, const Arguments& a) {
  std::vector<Run> out(static_cast<std::size_t>(runs));
  parallel_for(runs, 0, [&](int i) {
    out[static_cast<std::size_t>(i)] = run(scenario, static_cast<std::uint64_t>(a.first + i), a.each);
  });
  return out;
}

struct Moments {
  double n = 0, sum = 0, squares = 0;
  void add(double x) { n += 1, sum += x, squares += x * x; }
  [[nodiscard]] double mean() const { return n > 0 ? sum / n : 0; }
  [[nodiscard]] double rms() const { return n > 0 ? std::sqrt(squares / n) : 0; }
  [[nodiscard]] double deviation() const {
    return n > 1 ? std::sqrt(std::max(0.0, (squares - n * mean() * mean()) / (n - 1))) : 0;
  }
};

std::string z_words(const Moments& z) {
  return z.n > 1 ? fmt::format("{:+.2f}, {:.2f}", z.mean(), z.deviation()) : std::string("–");
}

/// One row of the table; adds the trusted answers' error/σ to `all`.
void print_row(const Scenario& scenario, const std::vector<Run>& runs, Moments& all, int& beyond) {
  int answered = 0, trusted = 0;
  Moments error, sigma, z, drift, line;
  int drifting = 0;
  double worst = 0;
  for (const Run& r : runs) {
    if (!r.found.answered()) continue;
    ++answered;
    const double this_z = r.error_s / *r.found.sigma_s;
    error.add(r.error_s), sigma.add(*r.found.sigma_s), z.add(this_z);
    if (r.drift_z && scenario.drift != 0) drift.add(*r.drift_z);
    drifting += scenario.drift == 0 && r.found.drift.value_or(0) != 0;
    if (r.line_delay_z) line.add(*r.line_delay_z);
    if (r.found.verdict != Verdict::trusted) continue;
    ++trusted;
    all.add(this_z);
    worst = std::max(worst, std::abs(this_z));
    beyond += std::abs(this_z) > 4;
  }
  fmt::print("| {} | {:.0f} | {} | {} | {} | {:.1f} | {:.1f} | {:+.2f} | {:.2f} | {:.1f} | {} | {} |\n", scenario.name,
             scenario.duration_s, runs.size(), answered, trusted, 1e6 * error.rms(), 1e6 * sigma.rms(), z.mean(),
             z.deviation(), worst, scenario.drift != 0 ? z_words(drift) : fmt::format("{} claimed", drifting),
             z_words(line));
  std::fflush(stdout);
}

void print_answerable(const Arguments& a) {
  fmt::print(
      "| scenario | s | runs | answered | trusted | rms error µs | rms σ µs | mean of error/σ | its deviation | worst "
      "trusted | drift: mean, deviation of error/σ, or how many were claimed where there is none | line delay: mean, "
      "deviation of error/σ |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  Moments all;
  int beyond = 0;
  for (const Scenario& s : answerable()) {
    if (s.name.find(a.only) == std::string::npos) continue;
    const int runs = s.sensor == Sensor::images ? a.images : a.runs;
    if (runs > 0) print_row(s, run_all(s, runs, a), all, beyond);
  }
  fmt::print(
      "\nOver the {:.0f} trusted runs together error/σ has mean {:+.3f} and standard deviation {:.3f}; {} of them are "
      "beyond 4σ.\n",
      all.n, all.mean(), all.deviation(), beyond);
}

void print_unanswerable(const Arguments& a) {
  fmt::print("\n| scenario | runs | refused | weak | trusted | said most often |\n|---|---|---|---|---|---|\n");
  for (const Scenario& s : unanswerable()) {
    if (s.name.find(a.only) == std::string::npos) continue;
    std::map<Verdict, int> verdicts;
    std::map<std::string, int> words;
    const int runs = std::min(a.runs, 10);
    for (const Run& r : run_all(s, runs, a)) {
      ++verdicts[r.found.verdict];
      for (const std::string& why : r.found.reasons) ++words[why.substr(0, why.find_first_of(":;,0123456789"))];
    }
    std::string most;
    for (const auto& [why, times] : words)
      if (most.empty() || times > words[most]) most = why;
    fmt::print("| {} | {} | {} | {} | {} | {} |\n", s.name, runs, verdicts[Verdict::refused], verdicts[Verdict::weak],
               verdicts[Verdict::trusted], most);
    std::fflush(stdout);
  }
}

Arguments read_arguments(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool more = i + 1 < argc;
    if (word == "--each")
      a.each = true;
    else if (word == "--runs" && more)
      a.runs = std::stoi(argv[++i]);
    else if (word == "--first" && more)
      a.first = std::stoi(argv[++i]);
    else if (word == "--images" && more)
      a.images = std::stoi(argv[++i]);
    else if (word == "--only" && more)
      a.only = argv[++i];
    else
      throw std::invalid_argument(
          "accuracy_alignment [--runs N] [--first N] [--images N] [--only NAME] [--each]; not " + word);
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) try {
  const Arguments a = read_arguments(argc, argv);
  print_answerable(a);
  print_unanswerable(a);
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
