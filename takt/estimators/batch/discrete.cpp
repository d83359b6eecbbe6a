// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/discrete.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/math/arrow_system.h"
#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

constexpr int state_size = 9;  // rotation, position, velocity
constexpr int tasks = 8;
constexpr int most_iterations = 25;
/// Steps this small against what is known are the end.
constexpr double settled = 5e-3;
constexpr double small_change = 0.02, large_change = 0.3;
/// A frame whose pose is further off than this chi² (6 degrees of freedom) is not of this motion; nor is one this many
/// times as far off as half of the frames are: stamps that jitter bring chi² of one degree of freedom, and are kept.
constexpr double stranger_chi2 = 200, stranger_ratio = 60;

using Vec9 = Eigen::Matrix<double, 9, 1>;

/// Weights and, after a pass, squares of the three sorts of residuals.
struct Groups {
  static constexpr int camera = 0, rotation = 1, translation = 2;
  double weight[3] = {1, 1, 1};
  double squares[3] = {0, 0, 0};  ///< of residuals whitened by the noise assumed, weights not applied
  double count[3] = {0, 0, 0};
};

class Discrete {
 public:
  Discrete(const CameraSession& camera, const ImuSession& imu, const Start& start, const DiscreteOptions& options)
      : camera_(camera), imu_(imu), options_(options), fit_() {
    CameraLink link;
    link.T_imu_cam.rotation = Quat(start.R_imu_cam);
    link.offset_s = start.offset_s;
    link.drift = options.drift ? start.drift : 0;
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
    lay_out();
    fit_.noise = {{{camera_.poses.corner_sigma_px, 0}}, {imu_.high_pass}};
    Groups groups;
    for (int round = 0; round < 4; ++round) {
      if (!settle(groups)) return std::move(fit_);
      if (round == 0 && drop_strangers()) {
        lay_out();
        continue;
      }
      // A little more or less noise leaves the answer where it is; much more asks for another look.
      const double changed = measure_noise(groups);
      if (changed < small_change) break;
      if (changed < large_change) {
        if (!settle(groups)) return std::move(fit_);
        break;
      }
    }
    finish(groups);
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
  [[nodiscard]] int frames() const { return static_cast<int>(fit_.chain.size()); }

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

  void lay_out() {
    BorderLayout& at = fit_.layout;
    at = {};
    BorderLayout::Camera cam;
    cam.rotation = 0, cam.translation = 3, cam.offset = 6;
    int next = 7;
    if (options_.drift) cam.drift = next++;
    at.cameras = {cam};
    at.gravity = next;
    at.board_scale = next + 3;
    at.imus = {{.bias = next + 4}};
    at.size = next + 4 + 6 * fit_.calibration.imus[0].bias.points();
  }

  /// Everything of one frame and of its join to the next, into the system.
  void add_frame(std::size_t k, const Groups& groups, ArrowSystem& system, Groups& sums) const {
    add_view(k, groups, system, sums);
    if (fit_.chain[k].joined) add_join(k, groups, system, sums);
  }

  /// ξ that takes the pose measured on the board to the one that the state predicts.
  [[nodiscard]] Vec6 pose_error(std::size_t k) const {
    const BodyState& s = fit_.states[k];
    const Rigid T_board_cam = Rigid{s.R_board_imu, s.position} * link().T_imu_cam;
    const Rigid predicted = T_board_cam.inverse(), &seen = fit_.chain[k].view->T_cam_board;
    const Quat turn = predicted.rotation * seen.rotation.conjugate();
    Vec6 xi;
    xi << predicted.translation - turn * seen.translation, log_so3(turn);
    return xi;
  }

  void add_view(std::size_t k, const Groups& groups, ArrowSystem& system, Groups& sums) const {
    const BodyState& s = fit_.states[k];
    const Mat3 R_cam_imu = link().T_imu_cam.rotation.conjugate().toRotationMatrix();
    const Mat3 R_cam_board = R_cam_imu * s.R_board_imu.conjugate().toRotationMatrix();
    Eigen::Matrix<double, 6, 12> j = Eigen::Matrix<double, 6, 12>::Zero();
    j.block<3, 3>(0, 0) = R_cam_imu * hat(link().T_imu_cam.translation);
    j.block<3, 3>(3, 0) = -R_cam_imu;
    j.block<3, 3>(0, 3) = -R_cam_board;
    j.block<3, 3>(3, 6).diagonal().setConstant(-1);  // camera's rotation
    j.block<3, 3>(0, 9) = -R_cam_imu;                // camera's place
    const Vec6 xi = pose_error(k);
    const Mat6 information = fit_.chain[k].view->information / (corner_noise() * corner_noise());
    sums.squares[Groups::camera] += xi.dot(information * xi);
    sums.count[Groups::camera] += 6;
    const Mat6 w = groups.weight[Groups::camera] * information;
    const int band = state_size * frames();
    const ArrowSystem::Block blocks[] = {{state_size * static_cast<int>(k), 6}, {band, 6}};
    system.accumulate(blocks, j.transpose() * w * j, j.transpose() * (w * xi));
  }

  void add_join(std::size_t k, const Groups& groups, ArrowSystem& system, Groups& sums) const {
    const BodyState &a = fit_.states[k], &b = fit_.states[k + 1];
    const double t0 = imu_time(k), t1 = imu_time(k + 1), dt = t1 - t0;
    const BiasCurve::Place bias = fit_.calibration.imus[0].bias.at(0.5 * (t0 + t1));
    const Preintegrated p = preintegrate(imu_.curve, t0, t1, fit_.calibration.imus[0].bias.gyro(bias),
                                         fit_.calibration.imus[0].bias.accel(bias), imu_noise());
    const Vec3& g = fit_.calibration.gravity_board;
    const Mat3 back = a.R_board_imu.conjugate().toRotationMatrix();
    const Quat turn = a.R_board_imu.conjugate() * b.R_board_imu;
    const double scale = fit_.calibration.board_scale;
    const Vec3 speeding = b.velocity - a.velocity, going = b.position - a.position - dt * a.velocity;
    const Vec3 dv = back * (scale * speeding - dt * g);
    const Vec3 dp = back * (scale * going - 0.5 * dt * dt * g);
    Vec9 r;
    r << log_so3(p.rotation.conjugate() * turn), dv - p.velocity, dp - p.position;
    const Mat3 unwind = right_jacobian_inverse(r.head<3>());
    const Mat3 unwind_left = -unwind.transpose();

    // Columns: state k, state k+1 | offset, drift | gravity | bias (three control points)
    constexpr int offset = 18, drift = 19, gravity = 20, board_scale = 23, first_bias = 24, columns = 42;
    Eigen::Matrix<double, 9, columns> j = Eigen::Matrix<double, 9, columns>::Zero();
    j.block<3, 3>(0, 0) = -unwind * turn.conjugate().toRotationMatrix();
    j.block<3, 3>(3, 0) = hat(dv);
    j.block<3, 3>(6, 0) = hat(dp);
    j.block<3, 3>(6, 3) = -scale * back;
    j.block<3, 3>(3, 6) = -scale * back;
    j.block<3, 3>(6, 6) = -scale * dt * back;
    j.block<3, 3>(0, 9) = unwind;
    j.block<3, 3>(6, 12) = scale * back;
    j.block<3, 3>(3, 15) = scale * back;
    j.block<3, 3>(3, gravity) = -dt * back;
    j.block<3, 3>(6, gravity) = -0.5 * dt * dt * back;
    j.block<3, 1>(3, board_scale) = back * speeding;
    j.block<3, 1>(6, board_scale) = back * going;
    const auto slides = [&](const Preintegrated::Change& c) {
      Vec9 d;
      d << unwind_left * c.rotation, -c.velocity, -c.position;
      return d;
    };
    const Vec9 start = slides(p.to_start), end = slides(p.to_end);
    j.col(offset) = start + end;
    const double c0 = fit_.chain[k].time_s - link().centre_s, c1 = fit_.chain[k + 1].time_s - link().centre_s;
    Vec9 longer;  // Δt grows with the drift
    longer << Vec3::Zero(), -back * g, -back * (scale * a.velocity + dt * g);
    j.col(drift) = c0 * start + c1 * end + (c1 - c0) * longer;
    for (int i = 0; i < BiasCurve::order; ++i) {
      j.block<3, 3>(0, first_bias + 6 * i) = bias.w[i] * unwind_left * p.rotation_to_gyro;
      j.block<3, 3>(3, first_bias + 6 * i) = -bias.w[i] * p.velocity_to_gyro;
      j.block<3, 3>(6, first_bias + 6 * i) = -bias.w[i] * p.position_to_gyro;
      j.block<3, 3>(3, first_bias + 6 * i + 3) = -bias.w[i] * p.velocity_to_accel;
      j.block<3, 3>(6, first_bias + 6 * i + 3) = -bias.w[i] * p.position_to_accel;
    }

    const Eigen::LLT<Mat9> factor(p.covariance);
    Vec9 white = factor.matrixL().solve(r);
    factor.matrixL().solveInPlace(j);
    sums.squares[Groups::rotation] += white.head<3>().squaredNorm();
    sums.squares[Groups::translation] += white.tail<6>().squaredNorm();
    sums.count[Groups::rotation] += 3;
    sums.count[Groups::translation] += 6;
    const double w_r = std::sqrt(groups.weight[Groups::rotation]), w_t = std::sqrt(groups.weight[Groups::translation]);
    j.topRows<3>() *= w_r, white.head<3>() *= w_r;
    j.bottomRows<6>() *= w_t, white.tail<6>() *= w_t;

    const int band = state_size * frames();
    const BorderLayout& at = fit_.layout;
    const int bias_at = band + at.imus[0].bias + 6 * bias.first;
    Eigen::Matrix<double, columns, columns> h;
    h.noalias() = j.transpose() * j;
    const Eigen::Matrix<double, columns, 1> gradient = j.transpose() * white;
    if (at.cameras[0].drift >= 0) {
      const ArrowSystem::Block blocks[] = {{state_size * static_cast<int>(k), 18},
                                           {band + at.cameras[0].offset, 2},
                                           {band + at.gravity, 4},
                                           {bias_at, 18}};
      system.accumulate(blocks, h, gradient);
    } else {
      // The drift's column is left out.
      Eigen::Matrix<double, columns - 1, columns - 1> rest;
      rest << h.topLeftCorner<drift, drift>(), h.topRightCorner<drift, columns - gravity>(),
          h.bottomLeftCorner<columns - gravity, drift>(), h.bottomRightCorner<columns - gravity, columns - gravity>();
      Eigen::Matrix<double, columns - 1, 1> g_rest;
      g_rest << gradient.head<drift>(), gradient.tail<columns - gravity>();
      const ArrowSystem::Block blocks[] = {{state_size * static_cast<int>(k), 18},
                                           {band + at.cameras[0].offset, 1},
                                           {band + at.gravity, 4},
                                           {bias_at, 18}};
      system.accumulate(blocks, rest, g_rest);
    }
  }

  void add_priors(ArrowSystem& system) const {
    batch::add_priors(fit_.calibration, fit_.layout, state_size * frames(), system);
  }

  [[nodiscard]] ArrowSystem normal_equations(const Groups& groups, Groups& sums) const {
    // Stretches of frames have systems of their own, so that the sum does not depend on who was first.
    const int n = frames(), band = state_size * n;
    std::vector<ArrowSystem> parts;
    for (int part = 0; part < 2; ++part) parts.emplace_back(band, 2 * state_size - 1, fit_.layout.size);
    std::vector<Groups> part_sums(2);
    parallel_for(2, options_.threads, [&](int part) {
      const auto from = static_cast<std::size_t>(part * n / 2), to = static_cast<std::size_t>((part + 1) * n / 2);
      for (std::size_t k = from; k < to; ++k) add_frame(k, groups, parts[part], part_sums[part]);
    });
    sums = part_sums[0];
    for (int g = 0; g < 3; ++g) sums.squares[g] += part_sums[1].squares[g], sums.count[g] += part_sums[1].count[g];
    parts[0].add(parts[1]);
    add_priors(parts[0]);
    return std::move(parts[0]);
  }

  void take(const Eigen::VectorXd& step) {
    for (int k = 0; k < frames(); ++k) {
      BodyState& s = fit_.states[static_cast<std::size_t>(k)];
      s.R_board_imu = (s.R_board_imu * exp_so3(Vec3(step.segment<3>(state_size * k)))).normalized();
      s.position += step.segment<3>(state_size * k + 3);
      s.velocity += step.segment<3>(state_size * k + 6);
    }
    retract(fit_.calibration, fit_.layout, step.tail(fit_.layout.size));
  }

  [[nodiscard]] bool within_reach() const {
    for (std::size_t k = 0; k + 1 < fit_.chain.size(); ++k)
      if (fit_.chain[k].joined && !imu_.curve.covers(imu_time(k), imu_time(k + 1))) return false;
    return true;
  }

  /// Gauss–Newton until the calibration moves by far less than is known of it.
  bool settle(Groups& groups) {
    for (int round = 0; round < most_iterations; ++round) {
      Groups sums;
      ArrowSystem system = normal_equations(groups, sums);
      const ArrowSystem::Solution solution = std::move(system).solve();
      ++fit_.iterations;
      if (!solution.ok()) {
        fit_.failure = "the motion does not determine the calibration";
        return false;
      }
      take(solution.step());
      if (!solution.step().allFinite() || !within_reach()) {
        fit_.failure = "the fit left the recording: camera and IMU contradict each other";
        return false;
      }
      fit_.covariance = solution.border_covariance();
      last_ = sums;
      last_log_determinant_ = solution.log_determinant();
      const double moved = solution.step()
                               .tail(fit_.layout.size)
                               .cwiseQuotient(fit_.covariance.diagonal().cwiseSqrt())
                               .cwiseAbs()
                               .maxCoeff();
      if (moved < settled) return fit_.converged = true;
    }
    fit_.converged = false;
    fit_.failure = "the fit did not settle";
    return false;
  }

  /// Frames with a pose that the motion before and after does not allow: the board seen in a mirror image, a wrong tag.
  bool drop_strangers() {
    const double sigma2 = corner_noise() * corner_noise();
    std::vector<double> chi2;
    for (std::size_t k = 0; k < fit_.chain.size(); ++k) {
      const Vec6 xi = pose_error(k);
      chi2.push_back(xi.dot(fit_.chain[k].view->information * xi) / sigma2);
    }
    std::vector<double> sorted = chi2;
    const auto mid = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), mid, sorted.end());
    const double limit = std::max(stranger_chi2, stranger_ratio * *mid);
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
  /// tr(H⁻¹·H_group) = ∂ log det H / ∂ log weight. Residuals and H are those before
  /// the last step, which was next to nothing; the degrees hardly depend on the noise and are counted once. Returns the
  /// largest relative change.
  double measure_noise(const Groups& groups) {
    constexpr double nudge = 1e-3;
    if (taken_[Groups::camera] == 0) {
      for (const int g : {Groups::camera, Groups::rotation}) {
        Groups nudged = groups, ignored;
        nudged.weight[g] *= 1 + nudge;
        const ArrowSystem::Solution moved = normal_equations(nudged, ignored).solve();
        if (!moved.ok()) return 0;
        taken_[g] = (moved.log_determinant() - last_log_determinant_) / std::log1p(nudge);
      }
      const int unknowns = state_size * frames() + fit_.layout.size;
      taken_[Groups::translation] = unknowns - taken_[Groups::camera] - taken_[Groups::rotation];
    }
    double factor[3];
    for (int g = 0; g < 3; ++g) {
      const double left = last_.count[g] - taken_[g];
      // Residuals that are almost wholly fitted say nothing about their noise.
      factor[g] = left > 0.03 * last_.count[g] ? std::sqrt(last_.squares[g] / left) : 1;
    }
    corner_noise() *= factor[Groups::camera];
    imu_noise().gyro *= factor[Groups::rotation];
    imu_noise().accel *= factor[Groups::translation];
    double largest = 0;
    for (const double f : factor) largest = std::max(largest, std::abs(f - 1));
    return largest;
  }

  /// What time shift along the rows the corners' residuals ask for: none where the shutter is global.
  void finish(const Groups&) {
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
  DiscreteOptions options_;
  DiscreteFit fit_;
  Groups last_;  ///< of the last step
  double last_log_determinant_ = 0;
  double taken_[3] = {0, 0, 0};  ///< degrees of freedom that the fit took from each sort
};

}  // namespace

DiscreteFit fit_discrete(const CameraSession& camera, const ImuSession& imu, const Start& start,
                         const DiscreteOptions& options) {
  return Discrete(camera, imu, start, options).run();
}

}  // namespace takt::batch
