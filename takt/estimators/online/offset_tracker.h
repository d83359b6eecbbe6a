// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/online/sensors.h"
#include "takt/estimators/online/tracking_options.h"
#include "takt/streams/rotation_signal.h"

/// Online estimation of cameras' offsets against an IMU, from samples as they come. docs/methods/online.md.
namespace takt {

/// How tracks become rotations (takt::track_rotation): the search for the first offset needs them.
using TurnMeasure = std::function<RotationSignal(const TrackStream&)>;

enum class TrackingState {
  searching,  ///< for the first offset and motion, or for new ones after a loss
  tracking,
  holding,  ///< the motion does not tell the offset: it is held
};
[[nodiscard]] const char* to_string(TrackingState s);

/// What is known of a camera's offset now: t_imu = stamp + offset.
struct OffsetNow {
  Stamp stamp;                     ///< of the latest frame of that camera that was used, or seen
  std::optional<Duration> offset;  ///< at `stamp`; empty while it is refused
  std::optional<double> sigma_s;
  double drift = 0, drift_sigma = 0;  ///< s/s
  TrackingState state = TrackingState::searching;
  Verdict verdict = Verdict::refused;
  std::vector<std::string> reasons;
};

/// Where the IMU is: the world has z up, its origin and heading are the first motion's.
struct PoseNow {
  Stamp stamp;  ///< on the IMU's clock
  Quat R_world_imu = Quat::Identity();
  Vec3 p_world_imu = Vec3::Zero();
};

/// Give it samples in the order in which they come; streams may run apart by seconds. Memory and the time for a sample
/// are bounded. Bad data never throw: they are left out, counted, and said.
class OffsetTracker {
 public:
  /// Throws std::invalid_argument for a rig without cameras, a camera without intrinsics, a method that is not there.
  OffsetTracker(TrackingRig rig, TrackingOptions options, TurnMeasure turns);
  ~OffsetTracker();
  OffsetTracker(OffsetTracker&&) noexcept;
  OffsetTracker& operator=(OffsetTracker&&) noexcept;

  void observe_imu(const ImuSample& sample);
  void observe_frame(std::size_t camera, const TrackedFrame& frame);
  /// No more samples will come: what waits for later ones is used as it is.
  void finish();

  [[nodiscard]] OffsetNow estimate(std::size_t camera = 0) const;
  [[nodiscard]] std::optional<PoseNow> pose() const;
  /// As a result, without provenance, evidence and history.
  [[nodiscard]] Estimate result(std::size_t camera = 0) const;
  /// Frames used, motions begun (1 unless it was lost), offset steps seen.
  struct Counts {
    std::size_t frames = 0, starts = 0, steps = 0;
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The methods that `TrackingOptions::method` may name.
[[nodiscard]] std::vector<std::string> tracking_methods();

}  // namespace takt
