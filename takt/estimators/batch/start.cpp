// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/start.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/estimators/alignment/correlation.h"
#include "takt/estimators/alignment/evidence.h"
#include "takt/estimators/alignment/excitation.h"
#include "takt/math/median.h"

namespace takt::batch {

namespace {

constexpr std::size_t fewest_steps = 20;
/// Steps between frames further apart than this many usual ones are left out.
constexpr double longest_step = 2.5;
/// The rival must explain the data worse by this much (nats).
constexpr double clear_margin = 12;
constexpr double least_correlation = 0.6;

/// How the camera turned from frame to frame, as seen on the board.
RotationSignal board_rotations(const CameraSession& camera) {
  RotationSignal signal;
  signal.name = camera.stream->name;
  signal.clock = camera.stream->clock;
  signal.source = "attitude";
  signal.timing = camera.stream->timing;
  const auto& views = camera.poses.views;
  std::vector<double> steps;
  for (std::size_t i = 1; i < views.size(); ++i)
    steps.push_back(camera.time_s[views[i].frame] - camera.time_s[views[i - 1].frame]);
  if (steps.empty()) return signal;
  const double usual = median(std::move(steps));
  const double sigma2 = camera.poses.corner_sigma_px * camera.poses.corner_sigma_px;
  const auto stamp = [&](const BoardView& v) { return camera.epoch + from_seconds(camera.time_s[v.frame]); };
  for (std::size_t i = 1; i < views.size(); ++i) {
    if (camera.time_s[views[i].frame] - camera.time_s[views[i - 1].frame] > longest_step * usual) continue;
    RotationIncrement step;
    step.from = stamp(views[i - 1]);
    step.to = stamp(views[i]);
    const Quat turn = views[i - 1].T_cam_board.rotation * views[i].T_cam_board.rotation.conjugate();
    step.rotation = step.apparent = log_so3(turn);
    // The rotations' share of both poses' covariances; a floor keeps a perfect picture finite.
    const Mat3 covariance = (sigma2 + 1e-8) * (views[i].information.inverse().bottomRightCorner<3, 3>() +
                                               views[i - 1].information.inverse().bottomRightCorner<3, 3>());
    step.information = covariance.inverse();
    signal.increments.push_back(step);
  }
  return signal;
}

/// Slope of the gyro's rates over the camera's.
double turn_ratio(const alignment::Problem& problem, const alignment::Coarse& at) {
  double both = 0, camera = 0;
  for (const alignment::Step& step : problem.steps) {
    const double t = 0.5 * (step.t0 + step.t1), dt = step.t1 - step.t0;
    const double there = t + at.offset_s + at.drift * (t - at.centre_s);
    if (!problem.reference.covers(there, there)) continue;
    both += (at.R_reference_sensor.transpose() * problem.reference.rate(there)).dot(step.rotation / dt);
    camera += step.rotation.squaredNorm() / (dt * dt);
  }
  return camera > 0 ? both / camera : 1;
}

std::string no_start(const alignment::Excitation& x, const alignment::Correlation& c, double base_s) {
  if (x.sensor_still())
    return fmt::format("the camera hardly turns ({:.4f} rad/s): rotate it about all three axes", x.sensor_rms[0]);
  if (x.reference_still())
    return fmt::format("the IMU hardly turns ({:.4f} rad/s): is it the IMU of this recording?", x.reference_rms[0]);
  if (!c.refusal.empty()) return c.refusal;
  if (c.peaks.front().r < least_correlation)
    return fmt::format(
        "camera and IMU do not show the same motion at any offset between {:.3f} and {:.3f} s (they share {:.0f} % of "
        "the rotation at best): are they rigidly joined, of the same time, the gyro in rad/s?",
        c.searched_from_s + base_s, c.searched_to_s + base_s, 100 * c.peaks.front().r * c.peaks.front().r);
  if (c.peaks.front().evidence < c.significance)
    return fmt::format("no offset between {:.3f} and {:.3f} s stands out: the recording is too short or too still",
                       c.searched_from_s + base_s, c.searched_to_s + base_s);
  if (c.rival_margin < clear_margin)
    return fmt::format(
        "two offsets fit about equally well, {:.4f} and {:.4f} s: the motion repeats itself; move less regularly",
        c.peaks[0].offset_s + base_s, c.peaks[1].offset_s + base_s);
  return "";
}

}  // namespace

Start find_start(const CameraSession& camera, const ImuSession& imu) {
  Start out;
  const RotationSignal signal = board_rotations(camera);
  if (signal.increments.size() < fewest_steps) {
    out.refusal = fmt::format("the board was found in {} of {} frames only, too few that follow each other",
                              camera.poses.views.size(), camera.stream->size());
    return out;
  }
  const alignment::Problem problem(signal, *imu.stream);
  if (problem.steps.size() < fewest_steps) {
    out.refusal = "too few of the board's views can be used";
    return out;
  }
  const double widest = std::numeric_limits<double>::infinity();
  const alignment::RateGrids grids = alignment::rate_grids(problem);
  const alignment::Correlation c = alignment::correlate(problem, grids, -widest, widest);
  if (!c.curve_r.empty()) out.curve = alignment::correlation_panel(problem, c);
  out.refusal = no_start(alignment::measure_excitation(problem), c, to_seconds(problem.between_epochs()));
  if (!out.refusal.empty()) return out;
  const alignment::Coarse coarse = alignment::follow_drift(problem, grids, c);
  // From the epochs of the alignment's problem to ours.
  const double shift = to_seconds(problem.sensor_epoch - camera.epoch);
  out.offset_s = coarse.offset_s - shift + to_seconds(problem.reference_epoch - imu.epoch);
  out.drift = coarse.drift;
  out.centre_s = coarse.centre_s + shift;
  out.lobe_s = coarse.lobe_s;
  out.correlation = c.peaks.front().r;
  out.turn_ratio = turn_ratio(problem, coarse);
  out.R_imu_cam = coarse.R_reference_sensor;
  if (!(out.turn_ratio > 0.5 && out.turn_ratio < 2))
    out.refusal = fmt::format("the gyro turned {:.3g} times as far as the camera{}", out.turn_ratio,
                              out.turn_ratio > 40 && out.turn_ratio < 80
                                  ? ": its rates look like degrees a second, not radians (--rate-unit deg_s)"
                                  : ": are its rates in rad/s, and is this the right camera model?");
  return out;
}

}  // namespace takt::batch
