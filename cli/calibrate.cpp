// SPDX-License-Identifier: Apache-2.0
// takt calibrate IN --target T.yaml: cameras against IMUs with a known board, Kalibr's job.
#include "takt/workflows/calibrate.h"

#include <fmt/core.h>

#include <memory>

#include "cli/interrupt.h"
#include "cli/open_options.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/verbs.h"
#include "takt/workflows/calibrate_cameras.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

namespace {

struct CalibrateLine {
  CalibrateJob job;
  std::string kalibr;  ///< prefix of Kalibr's result files
  bool opencv = false;
  bool cameras_only = false;
  std::vector<std::string> lenses;
};

void write_kalibr(const CalibrateLine& line, const Calibrated& found) {
  const KalibrFiles files = kalibr_files(found, line.opencv);
  write_file(line.kalibr + "-camchain-imucam.yaml", files.camchain);
  write_file(line.kalibr + "-imu.yaml", files.imu);
  write_file(line.kalibr + "-results-imucam.txt", files.results);
}

int run_calibrate(CalibrateLine line, const Common& common) {
  const auto bar = std::make_shared<ProgressBar>(common, "frames");
  line.job.progress = [bar](double done) { (*bar)(done); };
  line.job.batch.threads = common.threads;
  Calibrated found = calibrate(line.job);
  Estimate& e = found.estimate;
  e.provenance = make_provenance(common.command, found.files, common.seed);
  if (!common.quiet)
    for (const std::string& note : e.notes) fmt::print(stderr, "takt: {}\n", note);
  if (!line.kalibr.empty() && e.answered()) write_kalibr(line, found);
  return hand_over(e, common);
}

void write_kalibr(const CalibrateLine& line, const CalibratedCameras& found) {
  const KalibrCameraFiles files = kalibr_camera_files(found, line.opencv);
  write_file(line.kalibr + "-camchain.yaml", files.camchain);
  write_file(line.kalibr + "-results-cam.txt", files.results);
}

int run_cameras_only(const CalibrateLine& line, const Common& common) {
  const auto bar = std::make_shared<ProgressBar>(common, "frames");
  CalibratedCameras found = calibrate_cameras({line.job.input, line.job.target, line.job.sensor, line.lenses,
                                               line.job.open, common.threads, [bar](double done) { (*bar)(done); }});
  found.provenance = make_provenance(common.command, found.files, common.seed);
  if (!common.quiet)
    for (const std::string& note : found.notes) fmt::print(stderr, "takt: {}\n", note);
  if (!line.kalibr.empty() && found.verdict != Verdict::refused) write_kalibr(line, found);
  if (!common.output.empty())
    write_file(common.output, common.output.ends_with(".json") ? to_json(found) : to_yaml(found));
  if (!common.report.empty()) write_file(common.report, report_page(found));
  fmt::print("{}", common.json ? to_json(found) : in_words(found));
  return found.verdict == Verdict::trusted ? 0 : 3;
}

std::vector<std::string> lens_names() {
  std::vector<std::string> out;
  for (const LensKind& kind : lens_kinds()) out.emplace_back(kind.name);
  return out;
}

}  // namespace

void add_calibrate(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb =
      *app.add_subcommand("calibrate", "camera against IMU with a calibration board: offset, rotation, place");
  const auto line = std::make_shared<CalibrateLine>();
  CalibrateJob& job = line->job;
  verb.add_option("IN", job.input, "a recording with camera and IMU, moved before the board; or cameras alone")
      ->required();
  verb.add_option("--target", job.target, "the board: Kalibr's target file")->required();
  verb.add_option("--camchain", job.camchain, "intrinsics: Kalibr's camchain, or an ASL sensor.yaml");
  verb.add_option("--imu", job.imu, "Kalibr's imu file, whose noise figures are compared with the measured ones");
  verb.add_option("--sensor", job.sensor, "camera (default: all of them)");
  verb.add_option("--reference", job.reference, "IMU (default: all of them, the first being the reference)");
  verb.add_option("--kalibr", line->kalibr, "also write PREFIX-camchain-imucam.yaml, -imu.yaml, -results-imucam.txt")
      ->type_name("PREFIX");
  verb.add_flag("--opencv", line->opencv, "write them so that OpenCV's FileStorage reads them too");
  CLI::Option* alone = verb.add_flag("--cameras-only", line->cameras_only,
                                     "lenses and how cameras stand to each other, without any IMU; with --kalibr: "
                                     "PREFIX-camchain.yaml, -results-cam.txt");
  verb.add_option("--lens", line->lenses, "with --cameras-only: the lens model, once for all cameras or once for each")
      ->check(CLI::IsMember(lens_names()))
      ->needs(alone)
      ->type_name("MODEL")
      ->allow_extra_args(false)
      ->default_str(lens_names().front());
  add_options(verb, job.batch);
  verb.get_option("--model")->check(CLI::IsMember({"auto", "discrete", "spline"}));
  verb.get_option("--imu-model")->check(CLI::IsMember({"auto", "calibrated", "scale-misalignment"}));
  verb.get_option("--knots")->check(CLI::Range(1e-3, 1.0));
  add_open_options(verb, job.open);
  add_common(verb, common);
  add_result_output(verb, common);
  for (const char* other : {"--camchain", "--imu", "--reference"}) alone->excludes(verb.get_option(other));
  verb.callback([line, &common, &action] {
    action = [line, &common] {
      return line->cameras_only ? run_cameras_only(*line, common) : run_calibrate(*line, common);
    };
  });
}

}  // namespace takt::cli
