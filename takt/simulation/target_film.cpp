// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/target_film.h"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "takt/simulation/camera_truth.h"
#include "takt/simulation/random.h"

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
  const auto schedule = std::make_shared<const std::vector<Exposure>>(film.exposures[k]);
  out.open = [trajectory = film.trajectory, camera = film.cameras[k], scene, seed = camera_seed(o, number), schedule,
              threads = o.threads] {
    return std::make_unique<FilmReader>(std::make_shared<const BoardRenderer>(trajectory, camera, scene, seed),
                                        schedule, threads);
  };
  return out;
}

/// Further IMUs sit aside and askew, and have clocks of their own.
SimulatedImu imu_number(const TargetFilmOptions& o, int number) {
  SimulatedImu imu = o.imu;
  if (number == 0) return imu;
  Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
  step.translation() = Vec3(0.05, -0.03, 0.02) * number;
  step.linear() = exp_so3(Vec3(0.4, -0.3, 0.9) * number).toRotationMatrix();
  imu.T_body_imu = (Eigen::Isometry3d(o.imu.T_body_imu) * step).matrix();
  return imu;
}

void add_imu(const TargetFilmOptions& o, int number, TargetFilm& film) {
  const SimulatedImu imu = imu_number(o, number);
  const double offset_s = number * o.imu_offset_step_s;
  SimulatedClocks clocks = clocks_of(o, 0);
  clocks.reference_start -= from_seconds(offset_s);
  const std::uint64_t seed = number == 0 ? o.seed : Random(o.seed, fmt::format("imu{}", number)).bits();
  ImuStream stream = simulate_imu(*film.trajectory, imu, clocks, o.duration_s, seed);
  stream.name = stream.clock = fmt::format("imu{}", number);
  film.recording.imus.push_back(std::move(stream));
  if (number == 0) return;
  Estimate truth;
  truth.method = "truth";
  truth.sensor = film.recording.imus.back().name;
  truth.reference = "imu0";
  truth.verdict = Verdict::trusted;
  truth.offset = from_seconds(offset_s);
  truth.sigma_s = truth.drift = truth.drift_sigma = 0;
  truth.epoch = as_stamp(clocks.at(0.5 * o.duration_s));
  truth.T_reference_sensor =
      (Eigen::Isometry3d(o.imu.T_body_imu).inverse() * Eigen::Isometry3d(imu.T_body_imu)).matrix();
  film.truth.estimates.push_back(std::move(truth));
}

}  // namespace

Motion TargetFilmOptions::target_motion(double turn_rad_s) {
  Motion m;
  m.name = "target";
  m.says = "excited before a board";
  m.turn_calm_rad_s = m.turn_lively_rad_s = turn_rad_s;
  m.turn_low_hz = 0.4, m.turn_high_hz = 3;
  m.speed_calm_m_s = m.speed_lively_m_s = 0.25 * turn_rad_s;
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
  if (o.imus < 1 || o.imus > 8) throw std::invalid_argument(fmt::format("{} IMUs: 1 to 8 of them", o.imus));
  check(o.scene.target);
  TargetFilm film;
  film.trajectory = make_trajectory(o.motion, o.seed);
  film.world_from_board = place_board(o, *film.trajectory, o.camera.T_body_cam);
  film.board = board_points(o.scene.target);
  film.recording.format = "simulated";
  film.recording.notes.push_back("simulated: a board, seed " + std::to_string(o.seed));
  for (int k = 0; k < o.cameras; ++k) {
    const std::string name = fmt::format("cam{}", k);
    film.cameras.push_back(camera_number(o, k));
    film.exposures.push_back(simulate_exposures(film.cameras.back(), clocks_of(o, k), o.duration_s,
                                                o.triggered_together ? o.seed : camera_seed(o, k)));
    film.recording.cameras.push_back(stream_of(o, film, k));
    Estimate truth = camera_truth(name, film.cameras.back(), o.imu, clocks_of(o, k), o.duration_s, o.seed);
    if (k == 0) film.truth = truth;
    if (o.cameras > 1) film.truth.estimates.push_back(std::move(truth));
  }
  for (int k = 0; k < o.imus; ++k) add_imu(o, k, film);
  const Vec3 gravity = film.world_from_board.linear().transpose() * gravity_world();
  for (int i = 0; i < 3; ++i)
    film.truth.extras.push_back({fmt::format("gravity_board_{}_m_s2", "xyz"[i]), gravity[i], 0.0});
  return film;
}

}  // namespace takt
