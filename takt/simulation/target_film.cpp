// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/target_film.h"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "takt/simulation/random.h"
#include "takt/version.h"

namespace takt {

namespace {

class FilmReader : public FrameReader {
 public:
  FilmReader(std::shared_ptr<const BoardRenderer> renderer, std::shared_ptr<const std::vector<Exposure>> exposures,
             int threads)
      : renderer_(std::move(renderer)), exposures_(std::move(exposures)), threads_(threads) {}

  std::optional<Frame> next() override {
    if (at_ >= exposures_->size()) return std::nullopt;
    const Exposure& e = (*exposures_)[at_];
    Frame frame{at_, e.stamp, e.exposure_s, renderer_->render(at_, e, threads_)};
    ++at_;
    return frame;
  }
  void skip_to(std::size_t index) override { at_ = std::max(at_, index); }

 private:
  std::shared_ptr<const BoardRenderer> renderer_;
  std::shared_ptr<const std::vector<Exposure>> exposures_;
  int threads_;
  std::size_t at_ = 0;
};

/// Where the first camera is in the mean, over the whole recording.
Eigen::Isometry3d mean_camera(const Trajectory& truth, const Mat4& T_body_cam, double duration_s) {
  constexpr int looks = 200;
  Mat3 sum = Mat3::Zero();
  Vec3 place = Vec3::Zero();
  for (int i = 0; i < looks; ++i) {
    const Eigen::Isometry3d pose =
        truth.world_from_body(duration_s * (i + 0.5) / looks) * Eigen::Isometry3d(T_body_cam);
    sum += pose.linear();
    place += pose.translation() / looks;
  }
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  mean.linear() = svd.matrixU() * svd.matrixV().transpose();
  mean.translation() = place;
  return mean;
}

/// Upright before the mean camera, then tilted about a seeded axis in its own plane.
Eigen::Isometry3d place_board(const TargetFilmOptions& o, const Trajectory& truth, const Mat4& T_body_cam) {
  const BoardExtent extent = board_extent(o.scene.target);
  const Vec2 middle = 0.5 * (extent.low + extent.high);
  const Eigen::Matrix2d front = seen_from_front(o.scene.target);
  Mat3 cam_from_board = Mat3::Zero();  // camera x is right, y down, z away from who looks
  cam_from_board.row(0).head<2>() = front.row(0);
  cam_from_board.row(1).head<2>() = -front.row(1);
  cam_from_board(2, 2) = -front.determinant();
  Random random(o.seed, "board");
  const double direction = random.uniform(0, 2 * std::numbers::pi);
  Eigen::Isometry3d in_camera = Eigen::Isometry3d::Identity();
  in_camera.translation() = Vec3(0, 0, o.distance_m);
  in_camera.linear() =
      exp_so3(o.tilt_rad * Vec3(std::cos(direction), std::sin(direction), 0)).toRotationMatrix() * cam_from_board;
  return mean_camera(truth, T_body_cam, o.duration_s) * in_camera * Eigen::Translation3d(-middle.x(), -middle.y(), 0);
}

/// Further cameras stand beside the first and are turned a little.
SimulatedCamera camera_number(const TargetFilmOptions& o, int number) {
  SimulatedCamera camera = o.camera;
  if (number == 0) return camera;
  Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
  step.translation() = Vec3(o.baseline_m * number, 0.002 * number, -0.001 * number);
  step.linear() = exp_so3(Vec3(0.01, -0.015, 0.008) * number).toRotationMatrix();
  camera.T_body_cam = (Eigen::Isometry3d(camera.T_body_cam) * step).matrix();
  return camera;
}

SimulatedClocks clocks_of(const TargetFilmOptions& o, int camera) {
  SimulatedClocks clocks;
  clocks.offset_s = o.offset_s + camera * o.camera_offset_step_s;
  clocks.drift = o.drift;
  return clocks;
}

std::uint64_t camera_seed(const TargetFilmOptions& o, int camera) {
  return camera == 0 ? o.seed : Random(o.seed, fmt::format("cam{}", camera)).bits();
}

CameraStream stream_of(const TargetFilmOptions& o, const TargetFilm& film, int number) {
  const auto k = static_cast<std::size_t>(number);
  CameraStream out;
  out.name = fmt::format("cam{}", number);
  out.clock = out.name;
  for (const Exposure& e : film.exposures[k]) {
    out.stamps.push_back(e.stamp);
    out.exposures_s.push_back(e.exposure_s);
  }
  out.timing = film.cameras[k].timing();
  out.model = film.cameras[k].model();
  out.T_body_cam = film.cameras[k].T_body_cam;
  PrintedBoard scene = o.scene;
  scene.world_from_board = film.world_from_board;
  const auto renderer =
      std::make_shared<const BoardRenderer>(film.trajectory, film.cameras[k], scene, camera_seed(o, number));
  const auto schedule = std::make_shared<const std::vector<Exposure>>(film.exposures[k]);
  out.open = [renderer, schedule, threads = o.threads] {
    return std::make_unique<FilmReader>(renderer, schedule, threads);
  };
  return out;
}

Estimate truth_of(const TargetFilmOptions& o, const SimulatedCamera& camera, int number) {
  const ClockMap<> map = clocks_of(o, number).sensor_to_reference(o.duration_s);
  const auto& piece = map.pieces().front();
  Estimate e;
  e.method = "truth";
  e.sensor = fmt::format("cam{}", number);
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = piece.offset + from_seconds(o.imu.delay_s());
  e.sigma_s = 0;
  e.epoch = as_stamp(piece.epoch);
  e.drift = piece.drift;
  e.drift_sigma = 0;
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.line_delay_s = camera.timing().line_delay_s();
  e.line_delay_sigma_s = 0;
  e.T_reference_sensor = camera.T_body_cam;
  return e;
}

}  // namespace

Motion TargetFilmOptions::target_motion() {
  Motion m;
  m.name = "target";
  m.says = "excited before a board";
  m.turn_calm_rad_s = m.turn_lively_rad_s = 1.6;
  m.turn_low_hz = 0.4, m.turn_high_hz = 3;
  m.speed_calm_m_s = m.speed_lively_m_s = 0.4;
  m.speed_low_hz = 0.3, m.speed_high_hz = 2;
  return m;
}

SimulatedCamera TargetFilmOptions::target_camera() {
  SimulatedCamera c;
  CameraModel lens;
  lens.width = 752, lens.height = 480;
  lens.fx = 458.654, lens.fy = 457.296, lens.cx = 367.215, lens.cy = 248.375;
  lens.distortion = Distortion::radtan;
  lens.coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  c.exactly = lens;
  c.rate_hz = 20;
  c.exposure_s = 0.002;
  return c;
}

TargetFilm simulate_target(const TargetFilmOptions& o) {
  if (o.cameras < 1 || o.cameras > 8) throw std::invalid_argument(fmt::format("{} cameras: 1 to 8 of them", o.cameras));
  check(o.scene.target);
  TargetFilm film;
  film.trajectory = make_trajectory(o.motion, o.seed);
  film.world_from_board = place_board(o, *film.trajectory, o.camera.T_body_cam);
  film.board = board_points(o.scene.target);
  film.recording.format = "simulated";
  film.recording.notes.push_back("simulated: a board, seed " + std::to_string(o.seed));
  film.recording.imus.push_back(simulate_imu(*film.trajectory, o.imu, clocks_of(o, 0), o.duration_s, o.seed));
  std::vector<Estimate> truths;
  for (int k = 0; k < o.cameras; ++k) {
    film.cameras.push_back(camera_number(o, k));
    film.exposures.push_back(simulate_exposures(film.cameras.back(), clocks_of(o, k), o.duration_s, camera_seed(o, k)));
    film.recording.cameras.push_back(stream_of(o, film, k));
    truths.push_back(truth_of(o, film.cameras.back(), k));
  }
  film.truth = truths.front();
  if (o.cameras > 1) film.truth.estimates = std::move(truths);
  film.truth.extras = {{"clock_offset_s", o.offset_s, 0.0}, {"imu_delay_s", o.imu.delay_s(), 0.0}};
  film.truth.provenance.version = version;
  film.truth.provenance.seed = o.seed;
  return film;
}

}  // namespace takt
