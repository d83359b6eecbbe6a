// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <string>

#include "takt/estimators/online/method.h"

namespace takt::online {

/// What is known before the first motion is sought.
struct BeforehandKnown {
  Vec3 gyro_bias = Vec3::Zero(), accel_bias = Vec3::Zero();
  double gyro_bias_sigma = 0.03, accel_bias_sigma = 0.15;
  std::vector<FirstMotion::Camera> cameras;
};

/// The motion that explains a second or two of frames, with its covariance; or why there is none yet.
struct FoundMotion {
  std::optional<FirstMotion> motion;
  std::string why_not;
  double misfit = 0;  ///< rms residual over the pixel's sigma
};

/// Velocity and gravity from a linear system in which points are eliminated (as [DongSi2012]), then Gauss–Newton over
/// the motion at the first frame, the biases and the offsets, points eliminated again. The IMU is taken as exact over
/// so short a time, so the covariance serves to start a filter that sees the same frames again, not as an answer.
/// Frames in order of t_s + offset; `pixel_sigma` one a camera.
[[nodiscard]] FoundMotion find_first_motion(std::span<const BearingFrame* const> frames, const ImuHistory& imu,
                                            const BeforehandKnown& known, std::span<const double> pixel_sigma);

}  // namespace takt::online
