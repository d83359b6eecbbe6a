// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "takt/estimators/online/imu_motion.h"
#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"

/// What one observation of one point says about the camera's pose, and how points are found from several of them.
namespace takt::online {

using Mat2x3 = Eigen::Matrix<double, 2, 3>;
using Mat2x6 = Eigen::Matrix<double, 2, 6>;
using Mat2x4 = Eigen::Matrix<double, 2, 4>;

/// One pixel as a bearing and what turns a predicted bearing into its misfit:
///   residual = misfit · predicted unit bearing      (pixels; zero at the measured bearing)
struct Sighting {
  Vec3 bearing = Vec3::UnitZ();
  Mat2x3 misfit = Mat2x3::Zero();
  double rows_from_middle = 0;  ///< rows between this one and the image's middle row
  Vec2 from_centre{0, 0};       ///< (u − cx)/fx, (v − cy)/fy: what a change of focal length moves
};

/// Derivative of a sighting's residual to the true fx, fy, cx, cy less the given ones.
[[nodiscard]] Mat2x4 to_intrinsics(const Sighting& z);

/// Nothing where the camera model has no bearing.
[[nodiscard]] std::optional<Sighting> see(const CameraModel& model, const Vec2& pixel);

struct Extrinsics {
  Mat3 R_imu_cam = Mat3::Identity();
  Vec3 p_imu_cam = Vec3::Zero();
};

/// How the IMU moves while a rolling shutter reads, seen from where it was at the middle row.
class ReadoutMotion {
 public:
  ReadoutMotion() = default;
  /// `middle`: the motion at the middle row, which was read at `t_s`.
  ReadoutMotion(const ImuHistory& imu, const Motion& middle, double t_s, double half_s);

  struct Moved {
    Mat3 turn;   ///< R_middle_row
    Vec3 shift;  ///< of the position, in the world
    Vec3 rate;   ///< rad/s, in the IMU's frame at the row
    Vec3 velocity;
  };
  /// `s` seconds after the middle row.
  [[nodiscard]] Moved at(double s) const;
  [[nodiscard]] bool empty() const { return knots_.empty(); }

 private:
  struct Knot {
    Vec3 turn, shift, rate, velocity;
  };
  std::vector<Knot> knots_;
  double first_s_ = 0, step_s_ = 1;
};

/// Where the IMU was when a frame was taken. Jacobians are taken at the first estimate ("FEJ", [Huang2010]): so that
/// directions which no measurement can see stay unseen.
struct Clone {
  Quat R = Quat::Identity(), R_first = Quat::Identity();
  Vec3 p = Vec3::Zero(), p_first = Vec3::Zero();
  ReadoutMotion readout;  ///< empty for a global shutter
};

/// A point by the direction from a fixed origin and its inverse distance: well behaved at infinity.
struct Landmark {
  Vec3 origin = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  double inverse_distance = 0;  ///< 1/m
};

/// One observation's residual (px) and its Jacobians, residual(x) ≈ residual + H·error.
struct Observed {
  Vec2 residual;
  Mat2x6 pose;        ///< to the clone's θ and p
  Mat2x3 landmark;    ///< to the direction's two tangents (see tangents) and the inverse distance
  Mat2x6 extrinsics;  ///< to R_imu_cam (right perturbation) and p_imu_cam
  Vec2 line_delay;    ///< to the line delay, the middle row's time held
};

[[nodiscard]] Eigen::Matrix<double, 3, 2> tangents(const Vec3& direction);

/// Nothing where the point would be seen from behind. `first`: poses at their first estimates.
[[nodiscard]] std::optional<Vec2> residual(const Sighting& z, const Clone& clone, const Extrinsics& extrinsics,
                                           double line_delay_s, const Landmark& landmark);
[[nodiscard]] std::optional<Observed> observe(const Sighting& z, const Clone& clone, const Extrinsics& extrinsics,
                                              double line_delay_s, const Landmark& landmark, bool first);

struct SeenFrom {
  const Sighting* sighting;
  const Clone* clone;
  const Extrinsics* extrinsics;
  double line_delay_s;
};
/// The point that fits best, by Gauss–Newton. Nothing where none lies in front of the cameras.
/// `rms_px` receives what is left, per axis; `covariance` that of the tangents and the inverse distance for pixels of
/// unit sigma, poses taken as exact.
[[nodiscard]] std::optional<Landmark> triangulate(std::span<const SeenFrom> seen, double* rms_px = nullptr,
                                                  Mat3* covariance = nullptr);

/// Takes the landmark out of stacked rows: multiplies all by the left null space of `landmark` [Mourikis2007].
/// On return the last rows − 3 rows of `states` and `residual` are free of it.
void project_out(Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, 3>> landmark, Eigen::Ref<Eigen::MatrixXd> states,
                 Eigen::Ref<Eigen::VectorXd> residual);

}  // namespace takt::online
