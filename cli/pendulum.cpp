// SPDX-License-Identifier: Apache-2.0
// takt pendulum IN | --angle A.csv --imu I.csv: the output delay of the IMUs on a pendulum's bob.
#include "takt/workflows/pendulum.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/open_options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/error.h"
#include "takt/workflows/pendulum_repeats.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

namespace {

struct Line {
  std::vector<std::string> inputs;
  std::vector<double> window;
  PendulumJob job;
};

/// One result for all IMUs of a run: the first one's, with what was found for the others beside it.
Estimate together(const std::vector<Estimate>& found) {
  Estimate e = found.front();
  for (std::size_t i = 1; i < found.size(); ++i) {
    Estimate other = found[i];
    for (Panel panel : other.evidence.panels) {
      panel.name += "_" + other.reference;
      panel.title += ", " + other.reference;
      e.evidence.panels.push_back(std::move(panel));
    }
    other.evidence = {};
    other.estimates.clear();
    other.notes.clear();  // the result's own
    e.estimates.push_back(std::move(other));
  }
  return e;
}

PendulumOutcome calibrate_one(const std::string& input, const Line& line, const Common& common) {
  PendulumJob job = line.job;
  job.input = input;
  job.threads = common.threads;
  ProgressBar bar(common, "pictures");
  job.progress = [&bar](std::size_t done, std::size_t total) {
    bar(static_cast<double>(done) / static_cast<double>(total));
  };
  PendulumOutcome out = calibrate_pendulum(job);
  if (!common.quiet)
    for (const std::string& note : out.notes) fmt::print(stderr, "takt: {}\n", note);
  return out;
}

int worst_status(const std::vector<Estimate>& found) {
  int status = 0;
  for (const Estimate& e : found) status = std::max(status, exit_status(e));
  return status;
}

int one_run(const std::string& input, const Line& line, const Common& common) {
  const PendulumOutcome out = calibrate_one(input, line, common);
  Estimate whole = together(out.estimates);
  whole.provenance = make_provenance(common.command, out.files, std::nullopt);
  write_outputs(whole, common);
  if (common.json) {
    fmt::print("{}", to_json(whole));
  } else {
    for (const Estimate& e : out.estimates) fmt::print("{}", in_words(e, common.quiet, colour_welcome(1)));
  }
  return worst_status(out.estimates);
}

/// Several runs: each one's sentences, how far they agree, and the mean.
int repeats(const Line& line, const Common& common) {
  std::vector<PendulumRun> runs;
  std::vector<std::string> files;
  for (const std::string& input : line.inputs)
    if (std::error_code failed; !std::filesystem::exists(input, failed))
      throw Error("no such file or folder", input, "check the path");
  for (const std::string& input : line.inputs) {
    PendulumOutcome out = calibrate_one(input, line, common);
    const std::filesystem::path path(input);
    const std::string name = (path.has_filename() ? path : path.parent_path()).filename().string();
    if (!common.json && !common.quiet)
      for (const Estimate& e : out.estimates) fmt::print("{}: {}\n", name, sentence(e));
    files.insert(files.end(), out.files.begin(), out.files.end());
    runs.push_back({name, std::move(out.estimates)});
  }
  Estimate whole = repeat_estimate(runs);
  whole.provenance = make_provenance(common.command, files, std::nullopt);
  write_outputs(whole, common);
  if (common.json)
    fmt::print("{}", repeat_json(whole, runs));
  else
    fmt::print("{}{}", common.quiet ? "" : "\n" + repeat_words(runs) + "\n", in_words(whole, true, colour_welcome(1)));
  return exit_status(whole);
}

int pendulum(const Line& line, const Common& common) {
  const bool files = !line.job.angle_file.empty() || !line.job.imu_file.empty();
  if (line.inputs.empty() != files || line.job.angle_file.empty() != line.job.imu_file.empty()) {
    fmt::print(stderr, "takt pendulum: give a recording, or both --angle FILE and --imu FILE\n");
    return 2;
  }
  if (line.inputs.size() > 1) return repeats(line, common);
  return one_run(files ? "" : line.inputs.front(), line, common);
}

}  // namespace

void add_pendulum(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("pendulum", "output delay of an IMU on a pendulum in front of a dial");
  const auto line = std::make_shared<Line>();
  verb.add_option("IN", line->inputs,
                  "recordings of a dial (pictures or angles) and IMU; several are compared as repeats");
  verb.add_option("--angle", line->job.angle_file, "log of the dial's angle: t,angle");
  verb.add_option("--imu", line->job.imu_file, "log of the gyro: t,wx,wy,wz");
  verb.add_option("--sensor", line->job.sensor, "name of the angle's stream");
  verb.add_option("--reference", line->job.reference, "name of the IMU; else all are calibrated");
  verb.add_option("--estimator", line->job.estimator, "spline, damped, extrema, or all: spline with the others beside")
      ->check(CLI::IsMember({"all", "spline", "damped", "extrema"}))
      ->default_str("all");
  verb.add_option("--window", line->window, "amplitudes from which to which swings are used, degrees")
      ->delimiter(',')
      ->expected(2)
      ->default_str("15,9");
  verb.add_option("--rig", line->job.rig_file, "rig file: exposure, stamp, dial; else the recording's rig.yaml");
  verb.add_option("--dial-method", line->job.dial_method, "how pictures are read; coded, or keyframes on a plain dial")
      ->check(CLI::IsMember({"coded", "keyframes", "neighbours"}));
  verb.add_flag("--line-delay", line->job.pendulum.estimate_line_delay, "find the rolling shutter's line delay");
  verb.add_flag("--trigger", line->job.pendulum.stamps_are_triggers,
                "the IMU is triggered: tell the result as the trigger's lead too");
  add_open_options(verb, line->job.open);
  add_common(verb, common);
  add_result_output(verb, common);
  verb.callback([line, &common, &action] {
    if (line->window.size() == 2) {
      line->job.pendulum.window_from_deg = line->window[0];
      line->job.pendulum.window_to_deg = line->window[1];
      line->job.pendulum.window_is_required = true;
      if (!(line->window[0] > line->window[1] && line->window[1] >= 0))
        throw CLI::ValidationError("--window", "runs from the larger to the smaller amplitude: 15,9");
    }
    action = [line, &common] { return pendulum(*line, common); };
  });
}

}  // namespace takt::cli
