// SPDX-License-Identifier: Apache-2.0
// takt pendulum IN | --angle A.csv --imu I.csv: the output delay of the IMUs on a pendulum's bob.
#include "takt/workflows/pendulum.h"

#include <fmt/core.h>

#include <memory>

#include "cli/open_options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/provenance.h"
#include "takt/workflows/report.h"

namespace takt::cli {

namespace {

struct Line {
  std::vector<std::string> inputs;
  std::vector<double> window;
  PendulumJob job;
};

/// One result for all IMUs of a run: the first one's, with what was found for the others beside it.
Estimate together(std::vector<Estimate> found) {
  Estimate e = std::move(found.front());
  for (std::size_t i = 1; i < found.size(); ++i) {
    found[i].evidence = {};
    found[i].estimates.clear();
    e.estimates.push_back(std::move(found[i]));
  }
  return e;
}

Estimate calibrate_one(const std::string& input, const Line& line, const Common& common) {
  PendulumJob job = line.job;
  job.input = input;
  job.threads = common.threads;
  ProgressBar bar(common, "pictures");
  job.progress = [&bar](std::size_t done, std::size_t total) {
    bar(static_cast<double>(done) / static_cast<double>(total));
  };
  PendulumOutcome out = calibrate_pendulum(job);
  if (!common.quiet)
    for (const std::string& note : out.notes) fmt::print(stderr, "{}\n", note);
  if (!common.json && out.estimates.size() > 1)
    for (const Estimate& e : out.estimates) fmt::print("{}\n", sentence(e));
  Estimate e = together(std::move(out.estimates));
  e.provenance = make_provenance(common.command, out.files, std::nullopt);
  return e;
}

/// Several runs: each one's sentence, and how far they agree.
int repeats(const std::vector<Estimate>& results, const Line& line, const Common& common) {
  if (!common.json)
    for (std::size_t i = 0; i < results.size(); ++i) fmt::print("{}: {}\n", line.inputs[i], sentence(results[i]));
  fmt::print("{}", common.json ? repeatability_json(results) : repeatability_words(results));
  int status = 0;
  for (const Estimate& e : results) status = std::max(status, exit_status(e));
  return status;
}

int pendulum(const Line& line, const Common& common) {
  const bool files = !line.job.angle_file.empty() || !line.job.imu_file.empty();
  if (line.inputs.empty() != files || line.job.angle_file.empty() != line.job.imu_file.empty()) {
    fmt::print(stderr, "takt pendulum: give a recording, or both --angle FILE and --imu FILE\n");
    return 2;
  }
  if (line.inputs.size() < 2) return hand_over(calibrate_one(files ? "" : line.inputs.front(), line, common), common);
  if (!common.output.empty() || !common.report.empty()) {
    fmt::print(stderr, "takt pendulum: -o and --report take one recording; write each, then: takt report RESULT...\n");
    return 2;
  }
  std::vector<Estimate> results;
  for (const std::string& input : line.inputs) results.push_back(calibrate_one(input, line, common));
  return repeats(results, line, common);
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
