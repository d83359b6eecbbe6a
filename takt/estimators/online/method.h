// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/online/imu_motion.h"
#include "takt/estimators/online/sensors.h"
#include "takt/estimators/online/sighting.h"
#include "takt/estimators/online/tracking_options.h"

/// The contract between the tracker, which keeps the streams in order, finds the first offset and the first motion and
/// judges the answer, and a method, which estimates offset and motion from there on.
namespace takt::online {

/// Times inside: IMU seconds after the IMU's epoch, camera seconds after the camera's; t_imu = t_cam + offset.
struct SeenFeature {
  std::int64_t id;
  Sighting sighting;
};
struct BearingFrame {
  std::size_t camera = 0;
  double t_s = 0;            ///< exposure middle of the middle row, by the camera's clock and the rig's line delay
  double stamp_sigma_s = 0;  ///< of this stamp by itself (jitter)
  std::vector<SeenFeature> features;
  bool still = false;      ///< the rig stands still: pictures and IMU say so
  bool observable = true;  ///< the motion tells the offset; else the method must hold it
};

/// Offset and drift of two clocks that run apart, with their covariance.
struct OffsetAndDrift {
  double offset_s = 0, drift = 0;
  double offset_variance = 0, covariance = 0, drift_variance = 0;
};

/// What is known of a camera's clock, and how well.
struct OffsetBelief {
  double offset_s = 0;
  double sigma_s = 0;
  /// What a usual drift, had the clocks one, would make this answer miss by without having shown yet. 0 once it would.
  double hidden_drift_s = 0;
  OffsetAndDrift apart;  ///< if the clocks do run apart
  double drift = 0;      ///< s/s; 0 unless the data ask for one
  double drift_sigma = 0;
  double line_delay_s = 0;
  double line_delay_sigma_s = 0;
  Extrinsics extrinsics;
  /// Of the mounting's rotation (in the camera's frame, rad) and position (m); 0 where it is kept as given.
  Vec3 turn_sigma = Vec3::Zero(), shift_sigma = Vec3::Zero();
  /// fx, fy, cx, cy less the given ones (px); sigmas 0 where they are kept as given.
  Eigen::Vector4d intrinsics = Eigen::Vector4d::Zero(), intrinsics_sigma = Eigen::Vector4d::Zero();
};

/// How well intrinsics are known that are to be refined.
constexpr double intrinsics_sigma_px = 5;

/// Where to start: the motion at an IMU time, how sure it is, and what is known of each camera.
struct FirstMotion {
  double t_s = 0;
  Motion motion;
  Mat15 covariance = Mat15::Zero();
  struct Camera {
    double offset_s = 0, offset_sigma_s = 0;
    double drift = 0;
    double drift_sigma = 0;  ///< 0: as far as clocks run apart before there are data
    double line_delay_s = 0, line_delay_sigma_s = 0;
    double pixel_sigma = 1;
    double half_readout_s = 0;                             ///< 0 for a global shutter
    Eigen::Vector4d intrinsics = Eigen::Vector4d::Zero();  ///< fx, fy, cx, cy less the given ones (px)
    double intrinsics_sigma_px = 0;                        ///< 0: they are kept as given
    Extrinsics extrinsics;
  };
  std::vector<Camera> cameras;
};

/// How a frame went.
struct FrameReport {
  bool used = false;     ///< false where it came too late or the IMU has a hole
  bool lost = false;     ///< the state can no longer be believed: start again
  bool stepped = false;  ///< the offset jumped
  double doubt = 0;      ///< by how many sigmas the offset seems to have jumped, were it decided now
  double t_imu_s = 0;    ///< where the motion now stands
};

class OffsetMethod {
 public:
  virtual ~OffsetMethod() = default;
  /// Begins at `first`; what an earlier run learned comes in by it.
  virtual void start(const FirstMotion& first) = 0;
  /// Frames come in order of t_s + offset, from `first.t_s` on. `imu` covers the frame and its readout.
  virtual FrameReport observe(const BearingFrame& frame, const ImuHistory& imu) = 0;
  [[nodiscard]] virtual OffsetBelief belief(std::size_t camera) const = 0;
  [[nodiscard]] virtual Motion motion() const = 0;
  /// Mean of the squared normalised misfits of late: 1 where noise is what it is said to be.
  [[nodiscard]] virtual double misfit() const = 0;
};

/// One row a method.
struct MethodRow {
  const char* name;
  std::unique_ptr<OffsetMethod> (*make)(const TrackingRig& rig, const TrackingOptions& options);
};

}  // namespace takt::online
