// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "takt/estimators/online/imu_history.h"
#include "takt/estimators/online/sensors.h"

namespace takt::online {

/// Whether the motion tells the offset. At a constant rate and a constant velocity every offset fits, for the pose
/// then only slides along itself [Li2014]; so what counts is how rate and specific force change.
class Excitation {
 public:
  explicit Excitation(const ImuNoise& noise) : noise_(noise) {}
  void observe(double t_s, const Reading& reading);

  /// RMS of the rate (rad/s) and of the specific force (m/s²) about their means over the last seconds, noise taken off.
  [[nodiscard]] double rate_change() const { return rate_change_; }
  [[nodiscard]] double force_change() const { return force_change_; }
  [[nodiscard]] bool observable() const;
  /// The IMU rests as far as it can tell.
  [[nodiscard]] bool resting() const;
  /// All turning of late (half a minute) was about one axis.
  [[nodiscard]] bool one_axis() const;

 private:
  struct Bin {
    double start_s = 0;
    double n = 0;
    Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero();
  };
  void close(const Bin& bin);

  ImuNoise noise_;
  Bin open_;
  std::deque<Bin> bins_;  ///< means
  double rate_change_ = 0, force_change_ = 0;
  double gyro_spread_late_ = 0, accel_spread_late_ = 0, rate_late_ = 0;
  Mat3 turning_ = Mat3::Zero();
  double turning_weight_ = 0;
};

/// Whether the picture stands still: features where they were some tenths of a second ago.
class PictureRest {
 public:
  /// Features by id; σ in px, where known.
  void observe(double t_s, const std::vector<TrackedFeature>& features, std::optional<double> pixel_sigma);
  [[nodiscard]] bool resting() const { return resting_; }

 private:
  struct Seen {
    double t_s;
    std::vector<TrackedFeature> features;  ///< by id
  };
  std::deque<Seen> seen_;
  bool resting_ = false;
};

}  // namespace takt::online
