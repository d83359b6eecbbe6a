// SPDX-License-Identifier: Apache-2.0
// takt track IN: a camera's offset against an IMU as it comes to be known, frame by frame.
#include "takt/workflows/track.h"

#include <fmt/core.h>

#include <cstdio>
#include <memory>

#include "cli/interrupt.h"
#include "cli/open_options.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

namespace {

/// One line a frame: {"t_ns", "offset_s", "sigma_s", "verdict"}, and why where it is not trusted.
std::string stream_line(const OffsetNow& now) {
  std::string line = fmt::format("{{\"t_ns\":{}", to_ns(now.stamp));
  if (now.offset)
    line += fmt::format(",\"offset_s\":{:.9f},\"sigma_s\":{:.4g}", to_seconds(*now.offset), *now.sigma_s);
  else
    line += ",\"offset_s\":null,\"sigma_s\":null";
  line += fmt::format(",\"verdict\":\"{}\",\"state\":\"{}\"", to_string(now.verdict), to_string(now.state));
  if (!now.reasons.empty()) line += fmt::format(",\"reason\":\"{}\"", now.reasons.front());
  return line + "}\n";
}

int run_track(TrackJob job, bool stream, const std::string& trajectory, const Common& common) {
  std::string poses;
  if (stream)
    job.on_estimate = [](const OffsetNow& now) {
      std::fputs(stream_line(now).c_str(), stdout);
      std::fflush(stdout);
    };
  if (!trajectory.empty())
    job.on_pose = [&poses](const PoseNow& pose) {
      const Quat& q = pose.R_world_imu;
      const Vec3& p = pose.p_world_imu;
      const std::int64_t ns = to_ns(pose.stamp);
      poses += fmt::format("{}.{:09} {:.6f} {:.6f} {:.6f} {:.7f} {:.7f} {:.7f} {:.7f}\n", ns / 1'000'000'000,
                           ns % 1'000'000'000, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
    };
  const auto bar = std::make_shared<ProgressBar>(common, "of the recording");
  job.progress = [bar](double fraction) { (*bar)(fraction); };
  const Outcome outcome = track(job);
  Estimate e = outcome.estimate;
  e.provenance = make_provenance(common.command, outcome.files, common.seed);
  if (!common.quiet)
    for (const std::string& note : e.notes) fmt::print(stderr, "takt: {}\n", note);
  if (!trajectory.empty()) write_file(trajectory, poses);
  if (!stream) return hand_over(e, common);
  Common quietly = common;
  if (!common.output.empty()) write_result(e, common.output);
  return exit_status(e);
}

}  // namespace

void add_track(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("track", "follow a camera's offset against an IMU, frame by frame");
  const auto job = std::make_shared<TrackJob>();
  const auto stream = std::make_shared<bool>(false);
  const auto trajectory = std::make_shared<std::string>();
  verb.add_option("IN", job->input, "a recording with an IMU and a camera or tracks; - for a live stream on stdin")
      ->required();
  verb.add_option("--sensor", job->sensor, "camera to answer for (default: the first)");
  verb.add_option("--reference", job->reference, "IMU whose clock is right (default: the first)");
  add_options(verb, job->tracking);
  verb.get_option("--method")->check(CLI::IsMember(tracking_methods()));
  verb.add_flag("--stream", *stream, "print a JSON line for every frame as it is used");
  verb.add_option("--trajectory", *trajectory, "write the motion in TUM format: t x y z qx qy qz qw")
      ->type_name("FILE");
  add_open_options(verb, job->open);
  add_common(verb, common);
  add_result_output(verb, common);
  verb.callback([job, stream, trajectory, &common, &action] {
    action = [job, stream, trajectory, &common] { return run_track(*job, *stream, *trajectory, common); };
  });
}

}  // namespace takt::cli
