// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/discrete.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/estimators/batch/discrete_system.h"
#include "takt/math/median.h"

namespace takt::batch {

namespace {

constexpr int most_iterations = 25;
/// Steps this small against what is known: residuals tell of noise and of strangers, and with these known it is the
/// end, as the next step would be a fifth of this at most.
constexpr double settled = 0.1;
/// A little more or less noise leaves the answer where it is; if it changes by more, it is measured again.
constexpr double large_change = 0.3;
constexpr int most_measurements = 4;
/// A frame whose pose is further off than this chi² (6 degrees of freedom) is not of this motion; nor is one this many
/// times as far off as half of the frames are: stamps that jitter bring chi² of one degree of freedom, and are kept.
constexpr double stranger_chi2 = 200, stranger_ratio = 60;

class Discrete {
 public:
  Discrete(const CameraSession& camera, const ImuSession& imu, const Start& start, int threads)
      : camera_(camera), imu_(imu), threads_(threads), fit_() {
    CameraLink link;
    link.T_imu_cam.rotation = Quat(start.R_imu_cam);
    link.offset_s = start.offset_s;
    link.drift = start.drift;
    link.centre_s = start.centre_s;
    link.line_delay_s = camera.line_delay_s();
    fit_.calibration.cameras = {link};
    fit_.calibration.imus.resize(1);
    fit_.chain = make_chain(camera, imu.curve, link);
  }

  DiscreteFit run() {
    if (fit_.chain.size() < 10) {
      fit_.failure = "too few frames of the board lie within the IMU's recording";
      return std::move(fit_);
    }
    start_states();
    fit_.layout = discrete_layout(fit_.calibration.imus[0].bias.points());
    fit_.noise = {{{camera_.poses.corner_sigma_px, 0}}, {imu_.high_pass}};
    if (settle()) look_along_rows();
    return std::move(fit_);
  }

 private:
  [[nodiscard]] CameraLink& link() { return fit_.calibration.cameras[0]; }
  [[nodiscard]] const CameraLink& link() const { return fit_.calibration.cameras[0]; }
  [[nodiscard]] double& corner_noise() { return fit_.noise.cameras[0].corner_px; }
  [[nodiscard]] double corner_noise() const { return fit_.noise.cameras[0].corner_px; }
  [[nodiscard]] ImuDensity& imu_noise() { return fit_.noise.imus[0]; }
  [[nodiscard]] const ImuDensity& imu_noise() const { return fit_.noise.imus[0]; }
  [[nodiscard]] double imu_time(std::size_t k) const {
    return link().imu_time(fit_.chain[k].time_s, fit_.chain[k].mean_row);
  }

  /// Poses from the board; velocities from their differences; gravity from the mean specific force.
  void start_states() {
    const Quat R_cam_imu = link().T_imu_cam.rotation.conjugate();
    auto& states = fit_.states;
    states.resize(fit_.chain.size());
    Vec3 force = Vec3::Zero();
    double joined = 0;
    for (std::size_t k = 0; k < states.size(); ++k) {
      const Rigid T_board_cam = fit_.chain[k].view->T_cam_board.inverse();
      states[k].R_board_imu = T_board_cam.rotation * R_cam_imu;
      states[k].position = T_board_cam.translation;
    }
    for (std::size_t k = 0; k < states.size(); ++k) {
      const bool ahead = fit_.chain[k].joined, behind = k > 0 && fit_.chain[k - 1].joined;
      const std::size_t from = behind ? k - 1 : k, to = ahead ? k + 1 : k;
      const double dt = imu_time(to) - imu_time(from);
      states[k].velocity = (states[to].position - states[from].position) / dt;
      force += states[k].R_board_imu * imu_.curve.at(imu_time(k)).accel;
      joined += 1;
    }
    // Over a bounded motion the accelerations average out.
    fit_.calibration.gravity_board = -earth_gravity * force.normalized();
    const double begin = imu_time(0), end = imu_time(states.size() - 1);
    fit_.calibration.imus[0].bias = BiasCurve(begin, end, std::max(5.0, (end - begin) / 12));
  }

  [[nodiscard]] bool within_reach() const {
    for (std::size_t k = 0; k + 1 < fit_.chain.size(); ++k)
      if (fit_.chain[k].joined && !imu_.curve.covers(imu_time(k), imu_time(k + 1))) return false;
    return true;
  }

  /// Gauss–Newton until the calibration moves by far less than is known of it.
  bool settle() {
    double noise_changed = std::numeric_limits<double>::infinity();
    int measurements = 0;
    for (int round = 0; round < most_iterations; ++round) {
      const DiscreteSystem system(fit_, imu_.curve, threads_);
      const DiscreteStep step = system.solve();
      ++fit_.iterations;
      if (!step.ok) {
        fit_.failure = "the motion does not determine the calibration";
        return false;
      }
      const double moved = step.border.cwiseQuotient(step.covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
      // The first states are the board's own poses, which say nothing of strangers.
      if (round > 0 && moved < settled && drop_strangers()) {
        round = 0;  // it is another chain now
        continue;
      }
      const bool measures = moved < settled && noise_changed > large_change && measurements < most_measurements;
      if (measures) {
        noise_changed = measure_noise(system, step);
        ++measurements;
      }
      if (!take(step)) {
        fit_.failure = "the fit left the recording: camera and IMU contradict each other";
        return false;
      }
      if (!measures && moved < settled) return fit_.converged = true;
    }
    fit_.failure = "the fit did not settle";
    return false;
  }

  /// False where it leads out of the recording.
  bool take(const DiscreteStep& step) {
    if (!step.border.allFinite() || !step.states.allFinite()) return false;
    for (int k = 0; k < static_cast<int>(fit_.states.size()); ++k) {
      BodyState& s = fit_.states[static_cast<std::size_t>(k)];
      s.R_board_imu = (s.R_board_imu * exp_so3(Vec3(step.states.segment<3>(state_size * k)))).normalized();
      s.position += step.states.segment<3>(state_size * k + 3);
      s.velocity += step.states.segment<3>(state_size * k + 6);
    }
    retract(fit_.calibration, fit_.layout, step.border);
    fit_.covariance = step.covariance;
    return within_reach();
  }

  /// Frames with a pose that the motion before and after does not allow: the board seen in a mirror image, a wrong tag.
  bool drop_strangers() {
    const double sigma2 = corner_noise() * corner_noise();
    std::vector<double> chi2;
    for (std::size_t k = 0; k < fit_.chain.size(); ++k) {
      const Vec6 xi = pose_error(fit_, k);
      chi2.push_back(xi.dot(fit_.chain[k].view->information * xi) / sigma2);
    }
    const double limit = std::max(stranger_chi2, stranger_ratio * median(chi2));
    std::vector<ChainFrame> kept;
    std::vector<BodyState> states;
    for (std::size_t k = 0; k < chi2.size(); ++k) {
      if (chi2[k] > limit) {
        ++fit_.strangers;
        if (!kept.empty()) kept.back().joined = false;
        continue;
      }
      kept.push_back(fit_.chain[k]);
      states.push_back(fit_.states[k]);
    }
    if (kept.size() == fit_.chain.size() || kept.size() < 10) return false;
    // Across a frame left out its neighbours are joined again where the IMU allows.
    for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
      const double from = link().imu_time(kept[k].time_s, kept[k].mean_row),
                   to = link().imu_time(kept[k + 1].time_s, kept[k + 1].mean_row);
      kept[k].joined = to - from <= longest_join_s && imu_.curve.covers(from - 0.01, to + 0.01);
    }
    kept.back().joined = false;
    fit_.chain = std::move(kept);
    fit_.states = std::move(states);
    return true;
  }

  /// Each sort's noise from its own residuals and the degrees of freedom that the fit left it:
  /// tr(H⁻¹·H_sort) = ∂ log det H / ∂ log weight, with H where `at` was solved. The degrees hardly depend on the noise
  /// and are counted once. Returns the largest relative change.
  double measure_noise(const DiscreteSystem& system, const DiscreteStep& at) {
    if (taken_[camera_sort] == 0) {
      constexpr double nudge = 1e-3;
      for (const int g : {camera_sort, rotation_sort}) {
        SortWeights nudged{1, 1, 1};
        nudged[g] += nudge;
        const DiscreteStep moved = system.solve(nudged);
        if (!moved.ok) return 0;
        taken_[g] = (moved.log_determinant - at.log_determinant) / std::log1p(nudge);
      }
      const auto unknowns = static_cast<double>(at.states.size() + at.border.size());
      taken_[translation_sort] = unknowns - taken_[camera_sort] - taken_[rotation_sort];
    }
    double factor[residual_sorts];
    for (int g = 0; g < residual_sorts; ++g) {
      const double left = at.sums.count[g] - taken_[g];
      // Residuals that are almost wholly fitted say nothing about their noise.
      factor[g] = left > 0.03 * at.sums.count[g] ? std::sqrt(at.sums.squares[g] / left) : 1;
    }
    corner_noise() *= factor[camera_sort];
    imu_noise().gyro *= factor[rotation_sort];
    imu_noise().accel *= factor[translation_sort];
    double largest = 0;
    for (const double f : factor) largest = std::max(largest, std::abs(f - 1));
    return largest;
  }

  /// What time shift along the rows the corners' residuals ask for: none where the shutter is global.
  void look_along_rows() {
    double slope = 0, information = 0;
    for (std::size_t k = 0; k < fit_.chain.size(); ++k) {
      const ChainFrame& frame = fit_.chain[k];
      const BodyState& s = fit_.states[k];
      const CameraLink& l = link();
      const ImuCurve::Reading reading = imu_.curve.at(imu_time(k));
      const Vec3 omega =
          reading.gyro - fit_.calibration.imus[0].bias.gyro(fit_.calibration.imus[0].bias.at(imu_time(k)));
      const Mat3 R_cam_imu = l.T_imu_cam.rotation.conjugate().toRotationMatrix();
      Vec6 rate;  // of ξ in time
      rate << R_cam_imu * (l.T_imu_cam.translation.cross(omega) - s.R_board_imu.conjugate() * s.velocity),
          -(R_cam_imu * omega);
      // Corners against the frame's own pose; what the pose can follow is taken off.
      PoseNormals plain;
      Vec6 pose_row = Vec6::Zero();
      double row_row = 0, row_r = 0;
      const Rigid& pose = frame.view->T_cam_board;
      const Mat3 R = pose.rotation.toRotationMatrix();
      for (const CornerObservation& c : frame.view->corners) {
        const Vec3 p = R * camera_.stream->board[static_cast<std::size_t>(c.corner)] + pose.translation;
        const auto at = project_with_jacobians(camera_.model(), p);
        if (!at) continue;
        Eigen::Matrix<double, 2, 6> j;
        j << at->to_point, -at->to_point * hat(p);
        const Vec2 along = (camera_.row(c) - frame.mean_row) * (j * rate), r = at->pixel - c.pixel;
        plain.information += j.transpose() * j;
        plain.gradient += j.transpose() * r;
        pose_row += j.transpose() * along;
        row_row += along.squaredNorm();
        row_r += along.dot(r);
      }
      const Vec6 followed = plain.information.ldlt().solve(pose_row);
      information += row_row - followed.dot(pose_row);
      slope -= row_r - followed.dot(plain.gradient);
    }
    if (!(information > 0)) return;
    fit_.row_slope_s = slope / information;
    fit_.row_slope_sigma_s = corner_noise() / std::sqrt(information);
  }

  const CameraSession& camera_;
  const ImuSession& imu_;
  int threads_;
  DiscreteFit fit_;
  SortWeights taken_{};  ///< degrees of freedom that the fit took from each sort
};

}  // namespace

DiscreteFit fit_discrete(const CameraSession& camera, const ImuSession& imu, const Start& start, int threads) {
  return Discrete(camera, imu, start, threads).run();
}

}  // namespace takt::batch
