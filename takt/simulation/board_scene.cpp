// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/board_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "takt/simulation/random.h"
#include "takt/simulation/tracks.h"
#include "takt/version.h"

namespace takt {

Motion BoardOptions::board_motion(double turn_rad_s) {
  Motion m;
  m.name = "board";
  m.says = "turned and moved in front of a calibration board";
  m.turn_calm_rad_s = m.turn_lively_rad_s = turn_rad_s;
  m.turn_low_hz = 0.6;
  m.turn_high_hz = 3;
  m.speed_calm_m_s = m.speed_lively_m_s = 0.35 * turn_rad_s / 1.6;
  m.speed_low_hz = 0.4;
  m.speed_high_hz = 1.5;
  return m;
}

namespace {

/// Where the camera is and how it looks in the mean over a minute.
Eigen::Isometry3d mean_camera(const Trajectory& trajectory, const Mat4& T_body_cam) {
  constexpr int samples = 600;
  Mat3 attitude = Mat3::Zero();
  Vec3 place = Vec3::Zero();
  for (int i = 0; i < samples; ++i) {
    const Eigen::Isometry3d camera = trajectory.world_from_body(0.1 * i) * Eigen::Isometry3d(T_body_cam);
    attitude += camera.linear() / samples;
    place += camera.translation() / samples;
  }
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  mean.linear() = align_vectors(attitude).rotation;
  mean.translation() = place;
  return mean;
}

}  // namespace

BoardScene make_board_scene(const BoardOptions& o, const Vec3& middle, bool z_into_print) {
  BoardScene scene;
  scene.trajectory = make_trajectory(o.motion, o.seed);
  Random random(o.seed, "board");
  // The board's x right and y down (or up) as the camera sees it, its print facing the camera.
  Mat3 facing = Mat3::Identity();
  if (!z_into_print) facing = Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX()).toRotationMatrix();
  const double right = random.normal(), down = random.normal(), about = random.normal();
  const Mat3 leaning = exp_so3(o.tilt_rad * Vec3(right, down, about)).toRotationMatrix();
  Eigen::Isometry3d camera_from_board = Eigen::Isometry3d::Identity();
  camera_from_board.linear() = leaning * facing;
  camera_from_board.translation() = Vec3(0, 0, o.distance_m) - camera_from_board.linear() * middle;
  scene.world_from_board = mean_camera(*scene.trajectory, o.camera.T_body_cam) * camera_from_board;
  return scene;
}

CornerStream simulate_corners(const BoardScene& scene, const SimulatedCamera& camera,
                              const SimulatedDetection& detection, const std::vector<Vec3>& board,
                              std::span<const Exposure> exposures, std::uint64_t seed) {
  CornerStream out;
  out.name = "cam0";
  out.clock = "cam0";
  out.timing = camera.timing();
  out.model = camera.model();
  out.T_body_cam = camera.T_body_cam;
  out.board = board;
  std::vector<Vec3> points;
  for (const Vec3& p : board) points.push_back(scene.world_from_board * p);
  for (std::size_t frame = 0; frame < exposures.size(); ++frame) {
    Random random(mix64(seed) + frame, "corners");
    const FrameView view(*scene.trajectory, camera, *out.model, exposures[frame].middle_s);
    std::vector<CornerObservation> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double u = random.normal(), v = random.normal();
      const bool missed = random.chance(detection.miss_fraction), strays = random.chance(detection.outlier_fraction);
      const double angle = random.uniform(0, 2 * std::numbers::pi), stray = random.uniform(2, 20);
      const auto pixel = view.pixel_of(points[i]);
      if (!pixel || missed || exposures[frame].middle_s < detection.absent_until_s) continue;
      Vec2 at = *pixel + detection.noise_px * Vec2(u, v);
      if (strays) at += stray * Vec2(std::cos(angle), std::sin(angle));
      seen.push_back({static_cast<std::int32_t>(i), at});
    }
    out.stamps.push_back(exposures[frame].stamp);
    out.exposures_s.push_back(exposures[frame].exposure_s);
    out.corners.push_back(std::move(seen));
  }
  return out;
}

Estimate board_truth(const BoardOptions& o, const BoardScene& scene) {
  SimulatedClocks clocks;
  clocks.offset_s = o.offset_s;
  clocks.drift = o.drift;
  const auto map = clocks.sensor_to_reference(o.duration_s);
  const auto& piece = map.pieces().front();
  Estimate e;
  e.method = "truth";
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = piece.offset + from_seconds(o.imu.delay_s());
  e.sigma_s = 0;
  e.epoch = as_stamp(piece.epoch);
  e.drift = piece.drift;
  e.drift_sigma = 0;
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.line_delay_s = o.camera.timing().line_delay_s();
  e.line_delay_sigma_s = 0;
  e.T_reference_sensor = o.camera.T_body_cam;
  const Vec3 gravity = scene.world_from_board.linear().transpose() * gravity_world();
  e.extras = {{"clock_offset_s", o.offset_s, 0.0},
              {"imu_delay_s", o.imu.delay_s(), 0.0},
              {"gravity_board_x_m_s2", gravity.x(), 0.0},
              {"gravity_board_y_m_s2", gravity.y(), 0.0},
              {"gravity_board_z_m_s2", gravity.z(), 0.0}};
  e.provenance.version = version;
  e.provenance.seed = o.seed;
  return e;
}

SimulatedBoard simulate_board(const BoardOptions& o, const SimulatedDetection& detection,
                              const std::vector<Vec3>& board) {
  Vec3 low = board.at(0), high = board.at(0);
  for (const Vec3& p : board) low = low.cwiseMin(p), high = high.cwiseMax(p);
  SimulatedClocks clocks;
  clocks.offset_s = o.offset_s;
  clocks.drift = o.drift;
  SimulatedBoard out;
  out.scene = make_board_scene(o, 0.5 * (low + high));
  out.exposures = simulate_exposures(o.camera, clocks, o.duration_s, o.seed);
  out.corners = simulate_corners(out.scene, o.camera, detection, board, out.exposures, o.seed);
  out.imu = simulate_imu(*out.scene.trajectory, o.imu, clocks, o.duration_s, o.seed);
  out.truth = board_truth(o, out.scene);
  return out;
}

}  // namespace takt
