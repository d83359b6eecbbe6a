// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/estimators/batch/spline_model.h"

/// What may be believed of a calibration, and why not.
namespace takt::batch {

/// How much the body turned about each of the camera's axes, rad/s rms, the mean taken off.
struct TurnExcitation {
  Vec3 about_axes = Vec3::Zero();
  double weakest = 0, strongest = 0;  ///< along the principal axes
  int weakest_axis = 0;               ///< the camera's axis nearest to the weakest principal one
};
[[nodiscard]] TurnExcitation turn_excitation(const ImuSession& imu, const Mat3& R_imu_cam, double from_s, double to_s);
/// The same by the board's views alone, where no IMU can be compared with them.
[[nodiscard]] TurnExcitation turn_excitation(const CameraSession& camera);
/// What to do about an axis that hardly turned; empty where all did.
[[nodiscard]] std::string turn_advice(const TurnExcitation& turn);

/// Offsets of the windows among each other.
struct WindowCheck {
  double chi2_per_dof = 1;
  int dof = 0;
  double halves_apart_s = 0, halves_sigma_s = 0;  ///< second half minus first
  [[nodiscard]] bool scatter() const;             ///< more than chance does once in a thousand times
};
[[nodiscard]] WindowCheck check_windows(const std::vector<WindowOffset>& windows);

/// Sigmas of rotation and translation along their least known directions, and that direction of the rotation in the
/// camera's frame.
struct PoseSigma {
  double rotation_rad = 0, translation_m = 0;
  Vec3 rotation_direction = Vec3::Zero();
};
[[nodiscard]] PoseSigma pose_sigma(const Eigen::MatrixXd& covariance, const BorderLayout::Camera& at);

/// "x (right)" …
[[nodiscard]] std::string camera_axis(int axis);

/// Doubts that both models share.
void doubt_geometry(Estimate& e, const PoseSigma& sigma, const TurnExcitation& turn);
void doubt_views(Estimate& e, const CameraSession& camera, std::size_t used, std::size_t strangers, double length_s,
                 double corner_noise_px);
/// Board and accelerometer must agree on how long a metre is.
void doubt_scale(Estimate& e, const Calibration& c, double scale_sigma, double gravity_sigma);
/// Corners that miss in the same way in one part of the picture: intrinsics that do not fit, or of a kind of lens that
/// another one puts elsewhere by more than `sigma` allows.
void doubt_lens(Estimate& e, const CameraResiduals& residuals, const CameraSession& camera, double corner_noise_px,
                const PoseSigma& sigma, int threads);
/// What an IMU turned out to be beyond its data sheet, and whether it asks for more than it was given.
void doubt_imu(Estimate& e, const ImuLink& imu, const BorderLayout::Imu& at, const ImuEvidence& asks);

}  // namespace takt::batch
