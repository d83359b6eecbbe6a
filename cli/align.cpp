// SPDX-License-Identifier: Apache-2.0
// takt align IN, takt align A.csv B.csv: the offset between a camera (or poses, or a second gyro) and a gyro.
#include "takt/workflows/align.h"

#include <fmt/core.h>

#include <memory>
#include <numbers>

#include "cli/open_options.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

namespace {

int run_align(AlignJob job, const Common& common) {
  const auto bar = std::make_shared<ProgressBar>(common, "frames");
  job.progress = [bar](std::size_t done, std::size_t total) {
    (*bar)(total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 0);
  };
  const Outcome outcome = align(job);
  Estimate e = outcome.estimate;
  e.provenance = make_provenance(common.command, outcome.files, common.seed);
  if (!common.quiet)
    for (const std::string& note : e.notes) fmt::print(stderr, "takt: {}\n", note);
  return hand_over(e, common);
}

}  // namespace

void add_align(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb =
      *app.add_subcommand("align", "find the offset between a camera or gyro and a gyro, from motion alone");
  const auto job = std::make_shared<AlignJob>();
  const auto fov_deg = std::make_shared<double>(job->assumed_fov_rad * 180 / std::numbers::pi);
  verb.add_option("IN", job->inputs, "a recording with both streams, or two: the sensor's and the reference's")
      ->required()
      ->expected(1, 2);
  verb.add_option("--sensor", job->sensor, "stream whose stamps are to be corrected (default: the camera)");
  verb.add_option("--reference", job->reference, "stream whose clock is right (default: the gyro)");
  verb.add_option("--intrinsics", job->intrinsics, "camera file: ASL sensor.yaml or Kalibr camchain");
  verb.add_option("--fov", *fov_deg, "horizontal field of view, where no intrinsics are known (degrees)")
      ->check(CLI::Range(5.0, 175.0))
      ->capture_default_str();
  add_options(verb, job->alignment);
  verb.get_option("--method")->check(CLI::IsMember({"auto", "correlation", "phase", "tdicp", "ml"}));
  verb.get_option("--search")->check(above_zero());
  add_open_options(verb, job->open);
  add_common(verb, common);
  add_result_output(verb, common);
  verb.callback([job, fov_deg, &common, &action] {
    action = [job, fov_deg, &common] {
      job->assumed_fov_rad = *fov_deg * std::numbers::pi / 180;
      return run_align(*job, common);
    };
  });
}

}  // namespace takt::cli
