// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/verdict.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "takt/estimators/batch/lens_rival.h"
#include "takt/estimators/batch/residual_field.h"

namespace takt::batch {

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double significant_sigmas = 5;
/// Less than this about an axis is no excitation of it (rad/s rms), nor is this share of the strongest.
constexpr double least_turn = 0.02, least_share = 0.05;
constexpr double known_rotation_rad = 0.5 * degree, known_translation_m = 0.02;
/// Accelerometers are calibrated to a percent or so; a board that is off by more is not the one in the file.
constexpr double wrong_board = 0.02, noted_scale = 0.003;
constexpr double least_systematic_px = 0.02, systematic_share = 0.5;
/// A better lens that would leave the camera within this of where it is changes nothing that is claimed.
constexpr double elsewhere_sigmas = 2;
constexpr std::size_t fewest_frames = 40;
constexpr double shortest_s = 4;

/// Of rates in the camera's frame, whose noise has this variance.
TurnExcitation excitation_of(const std::vector<Vec3>& rates, double noise2) {
  TurnExcitation out;
  if (rates.size() < 2) return out;
  Vec3 mean = Vec3::Zero();
  Mat3 squares = Mat3::Zero();
  for (const Vec3& w : rates) mean += w, squares += w * w.transpose();
  const auto n = static_cast<double>(rates.size());
  mean /= n;
  const Mat3 covariance = squares / n - mean * mean.transpose();
  out.about_axes = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(covariance);
  // What noise alone shows is no turn.
  out.weakest = std::sqrt(std::max(0.0, eigen.eigenvalues()[0] - noise2));
  out.strongest = std::sqrt(std::max(0.0, eigen.eigenvalues()[2] - noise2));
  eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&out.weakest_axis);
  return out;
}

}  // namespace

std::string camera_axis(int axis) {
  static constexpr const char* names[] = {"x (right)", "y (down)", "z (forward)"};
  return names[axis];
}

TurnExcitation turn_excitation(const ImuSession& imu, const Mat3& R_imu_cam, double from_s, double to_s) {
  const auto times = imu.curve.times_s();
  std::vector<Vec3> rates;
  for (std::size_t i = 0; i < times.size(); ++i)
    if (times[i] >= from_s && times[i] <= to_s) rates.push_back(R_imu_cam.transpose() * imu.curve.gyro()[i]);
  return excitation_of(rates, imu.high_pass.gyro * imu.high_pass.gyro * imu.rate_hz);
}

TurnExcitation turn_excitation(const CameraSession& camera) {
  const std::vector<BoardView>& views = camera.poses.views;
  std::vector<Vec3> rates;
  for (std::size_t i = 1; i < views.size(); ++i) {
    const Quat turn = views[i - 1].T_cam_board.rotation * views[i].T_cam_board.rotation.conjugate();
    const double dt = camera.time_s[views[i].frame] - camera.time_s[views[i - 1].frame];
    if (dt <= longest_join_s) rates.push_back(log_so3(turn) / dt);
  }
  return excitation_of(rates, 0);
}

bool WindowCheck::scatter() const {
  // Wilson and Hilferty: the cube root of chi²/dof is nearly normal.
  if (dof < 2) return false;
  const double v = 2.0 / (9 * dof);
  return std::cbrt(chi2_per_dof) > 1 - v + 3.09 * std::sqrt(v);
}

WindowCheck check_windows(const std::vector<WindowOffset>& windows) {
  WindowCheck out;
  const auto mean_of = [](auto first, auto last, double& sigma) {
    double sum = 0, weight = 0;
    for (auto w = first; w != last; ++w)
      sum += w->offset_s / (w->sigma_s * w->sigma_s), weight += 1 / (w->sigma_s * w->sigma_s);
    sigma = 1 / std::sqrt(weight);
    return sum / weight;
  };
  if (windows.size() < 2) return out;
  double sigma = 0, sigma_first = 0, sigma_second = 0;
  const double mean = mean_of(windows.begin(), windows.end(), sigma);
  double chi2 = 0;
  for (const WindowOffset& w : windows) chi2 += std::pow((w.offset_s - mean) / w.sigma_s, 2);
  out.dof = static_cast<int>(windows.size()) - 1;
  out.chi2_per_dof = chi2 / out.dof;
  const auto middle = windows.begin() + static_cast<std::ptrdiff_t>(windows.size() / 2);
  const double first = mean_of(windows.begin(), middle, sigma_first),
               second = mean_of(middle, windows.end(), sigma_second);
  out.halves_apart_s = second - first;
  out.halves_sigma_s = std::hypot(sigma_first, sigma_second);
  return out;
}

PoseSigma pose_sigma(const Eigen::MatrixXd& covariance, const BorderLayout::Camera& at) {
  const Eigen::SelfAdjointEigenSolver<Mat3> rotation(Mat3(covariance.block<3, 3>(at.rotation, at.rotation)));
  const Eigen::SelfAdjointEigenSolver<Mat3> place(Mat3(covariance.block<3, 3>(at.translation, at.translation)));
  return {std::sqrt(std::max(0.0, rotation.eigenvalues()[2])), std::sqrt(std::max(0.0, place.eigenvalues()[2])),
          rotation.eigenvectors().col(2)};
}

std::string turn_advice(const TurnExcitation& turn) {
  const bool still = turn.strongest < least_turn;  // which is another matter
  if (still || turn.weakest >= std::max(least_turn, least_share * turn.strongest)) return "";
  return fmt::format(
      "the rig hardly turned about one direction ({:.3f} rad/s rms against {:.2f} about the liveliest): rotate it "
      "about the camera's {} axis too",
      turn.weakest, turn.strongest, camera_axis(turn.weakest_axis));
}

void doubt_geometry(Estimate& e, const PoseSigma& sigma, const TurnExcitation& turn) {
  if (const std::string advice = turn_advice(turn); !advice.empty()) e.doubt(Verdict::weak, advice);
  if (sigma.rotation_rad > known_rotation_rad) {
    int axis = 0;
    sigma.rotation_direction.cwiseAbs().maxCoeff(&axis);
    e.doubt(Verdict::weak,
            fmt::format("the rotation about the camera's {} axis is known to {:.1f}° only: rotate the rig "
                        "about the other axes more",
                        camera_axis(axis), sigma.rotation_rad / degree));
  }
  if (sigma.translation_m > known_translation_m)
    e.doubt(Verdict::weak,
            fmt::format("the camera's place on the IMU is known to {:.0f} mm only: rotate the rig faster, "
                        "about all axes",
                        1e3 * sigma.translation_m));
}

void doubt_views(Estimate& e, const CameraSession& camera, std::size_t used, std::size_t strangers, double length_s,
                 double corner_noise_px) {
  const BoardViews& poses = camera.poses;
  if (used < fewest_frames || length_s < shortest_s)
    e.doubt(Verdict::weak,
            fmt::format("only {} frames over {:.1f} s show the board: record 20 s or more", used, length_s));
  const double seen = static_cast<double>(std::max<std::size_t>(1, poses.seen));
  if (static_cast<double>(poses.failed) > 0.2 * seen)
    e.doubt(Verdict::weak,
            fmt::format("in {} of {} frames with corners no pose of the board explains them: is the target "
                        "file the right one, and the camera model?",
                        poses.failed, poses.seen));
  if (strangers > 0) {
    const std::string words =
        fmt::format("{} of {} frames show the board where the motion cannot have taken it, and were left out",
                    strangers, used + strangers);
    if (strangers > used / 10)
      e.doubt(Verdict::weak, words);
    else
      e.reasons.push_back(words);
  }
  if (corner_noise_px > 1)
    e.doubt(Verdict::weak,
            fmt::format("corners miss the board's shape by {:.1f} px: the camera model does not fit (takt "
                        "calibrate --cameras-only finds one)",
                        poses.corner_sigma_px));
}

void doubt_scale(Estimate& e, const Calibration& c, double scale_sigma, double gravity_sigma) {
  const double accelerometer = c.gravity_board.norm() / earth_gravity,
               accelerometer_sigma = gravity_sigma / earth_gravity;
  const double ratio = c.board_scale / accelerometer, sigma = std::hypot(scale_sigma, accelerometer_sigma);
  if (std::abs(ratio - 1) > significant_sigmas * sigma && std::abs(ratio - 1) > noted_scale) {
    const std::string words = fmt::format(
        "by the accelerometer the board is {:.4f} ± {:.4f} times as large as the target file says", ratio, sigma);
    if (std::abs(ratio - 1) > wrong_board)
      e.doubt(Verdict::weak, words +
                                 ": measure it; the offset and the rotation do not depend on it, and the translation "
                                 "is given in the accelerometer's metres");
    else
      e.reasons.push_back(words);
  }
  if (std::abs(accelerometer - 1) > significant_sigmas * accelerometer_sigma && std::abs(accelerometer - 1) > 0.01)
    e.reasons.push_back(fmt::format("gravity comes out as {:.3f} ± {:.3f} m/s²: the accelerometer's scale is off",
                                    c.gravity_board.norm(), gravity_sigma));
}

void doubt_lens(Estimate& e, const CameraResiduals& residuals, const CameraSession& camera, double corner_noise_px,
                const PoseSigma& sigma, int threads) {
  const CameraModel& model = camera.model();
  const ResidualField field =
      residual_field(residuals.at_px, residuals.off_px, model.width, model.height, corner_noise_px);
  e.extras.push_back({"systematic_corner_error_px", field.is_clear() ? field.systematic_px : 0, std::nullopt});
  if (!field.is_clear()) return;
  const auto rival = find_lens_rival(model, camera.poses.views, camera.stream->board, corner_noise_px, threads);
  if (rival && (rival->turn_rad > elsewhere_sigmas * sigma.rotation_rad ||
                rival->shift_m > elsewhere_sigmas * sigma.translation_m))
    e.doubt(Verdict::weak,
            fmt::format("a {} lens fits these corners better (χ² less by {:.0f}) and would stand {:.2f} mm and {:.3f}° "
                        "elsewhere: the intrinsics are of another kind of lens (takt calibrate --cameras-only); the "
                        "offset hardly depends on it",
                        rival->name, rival->gain, 1e3 * rival->shift_m, rival->turn_rad / degree));
  if (field.systematic_px > std::max(least_systematic_px, systematic_share * corner_noise_px))
    e.doubt(
        Verdict::weak,
        fmt::format("corners miss by {:.3f} px in the same way wherever they are seen in one part of the picture: the "
                    "intrinsics do not fit this camera (takt calibrate --cameras-only finds them), or the board is "
                    "not flat",
                    field.systematic_px));
}

void doubt_imu(Estimate& e, const ImuLink& imu, const BorderLayout::Imu& at, const ImuEvidence& asks) {
  if (at.matrices >= 0) {
    const auto most = [](const Mat3& m) { return 100 * (m - Mat3::Identity()).cwiseAbs().maxCoeff(); };
    e.reasons.push_back(
        fmt::format("scales and axes of the IMU are off by up to {:.2f} % (gyro) and {:.2f} % (accelerometer), which "
                    "is part of the "
                    "model",
                    most(imu.gyro_matrix), most(imu.accel_matrix)));
  }
  if (at.response >= 0)
    e.reasons.push_back(
        fmt::format("the IMU filters its readings (second order {:.2f} and {:.2f} ms², accelerometer {:.1f} µs later "
                    "than the gyro), which is part of the model; the offset is for the gyro",
                    1e6 * imu.gyro_bend_s2, 1e6 * imu.accel_bend_s2, 1e6 * imu.accel_lag_s));
  if (at.matrices < 0 && asks.matrices > ImuEvidence::clear_matrices)
    e.doubt(Verdict::weak,
            "the IMU's scales or axes are not what its data sheet says, and the residuals show it: --imu-model "
            "scale-misalignment");
  if (at.response < 0 && asks.response > ImuEvidence::clear_response)
    e.doubt(Verdict::weak, "the IMU's readings are filtered in a way that the model does not describe");
}

}  // namespace takt::batch
