// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "takt/signals/gyro_rotation.h"
#include "takt/signals/track_rotation.h"
#include "takt/signals/visual_rotation.h"
#include "takt/simulation/handheld.h"
#include "takt/simulation/random.h"
#include "takt/streams/audit.h"

/// Simulated recordings whose offset is known, for the law suite, the statistical test and bench/accuracy.
namespace takt::cases {

enum class Sensor { gyro, tracks, images };

/// What is recorded. Whatever differs from run to run (motion, noise, offset, phase of the sampling) is the seed's.
struct Scenario {
  std::string name;
  std::string motion = "handheld";
  Sensor sensor = Sensor::tracks;
  double duration_s = 30;
  double drift = 0;
  double readout_s = 0;  ///< rolling shutter
  bool readout_known = true;
  double outliers = 0;
  /// σ of how far beside its feature a tracker's window has its centre of contrast: as the picture turns, so does the
  /// error, for as long as the feature is followed (px).
  double window_error_px = 0;
  double frame_drop = 0, imu_drop = 0;
  LowPassKind low_pass = LowPassKind::none;  ///< of the reference
};

/// The two streams before anything is measured in them, and the truth.
struct Recorded {
  RotationSignal sensor;
  ImuStream reference;
  Estimate truth;
};

/// A trajectory as a device feels it that is turned against the body and starts its sampling some moment later.
class Mounted : public Trajectory {
 public:
  Mounted(std::shared_ptr<const Trajectory> body, const Quat& body_from_device, double later_s)
      : body_(std::move(body)), turned_(body_from_device), later_s_(later_s) {}
  Eigen::Isometry3d world_from_body(double t) const override { return body_->world_from_body(t + later_s_) * turned_; }
  Vec3 omega_body(double t) const override { return turned_.conjugate() * body_->omega_body(t + later_s_); }
  Vec3 velocity_world(double t) const override { return body_->velocity_world(t + later_s_); }
  Vec3 acceleration_world(double t) const override { return body_->acceleration_world(t + later_s_); }

 private:
  std::shared_ptr<const Trajectory> body_;
  Quat turned_;
  double later_s_;
};

inline Quat random_turn(Random& random) {
  const Vec3 axis = Vec3(random.normal(), random.normal(), random.normal()).normalized();
  return Quat(Eigen::AngleAxisd(random.uniform(0, std::numbers::pi), axis));
}

/// A second gyro of another make (noisier, another rate) on the same body, stamped by the sensor's clock.
inline ImuStream second_gyro(const Scenario& s, const SimulatedRecording& run, Random random) {
  const double rate_hz = random.uniform(150, 250), later_s = random.uniform(0, 1 / rate_hz);
  const Quat turn = random_turn(random);
  SimulatedImu gyro;
  gyro.rate_hz = rate_hz;
  gyro.noise.gyro_density = 3e-4;
  gyro.drop_fraction = s.frame_drop;
  const Mounted felt(run.trajectory, turn, later_s);
  ImuStream out = simulate_imu(felt, gyro, run.clocks, s.duration_s - later_s, random.bits());
  const auto to_sensor = inverse(run.clocks.sensor_to_reference(s.duration_s));
  for (Stamp& t : out.stamps) t = as_stamp(to_sensor(as<ReferenceClock>(t + from_seconds(later_s))));
  out.name = out.clock = "gyro1";
  return out;
}

inline HandheldOptions options_of(const Scenario& s, Random& random, std::uint64_t seed) {
  HandheldOptions o;
  o.seed = seed;
  o.duration_s = s.duration_s;
  o.motion = find_motion(s.motion);
  o.offset_s = random.uniform(-0.5, 0.5);
  o.drift = s.drift;
  o.footage = s.sensor == Sensor::images ? Footage::images : Footage::tracks;
  o.threads = 1;
  o.camera.readout_s = s.readout_s;
  o.camera.drop_fraction = s.frame_drop;
  o.tracking.outlier_fraction = s.outliers;
  o.imu.low_pass = s.low_pass;
  o.imu.drop_fraction = s.imu_drop;
  return o;
}

inline void turn_windows(const Scenario& s, const SimulatedCamera& camera, const SimulatedRecording& run,
                         TrackStream& tracks) {
  for (std::size_t frame = 0; frame < tracks.size(); ++frame) {
    const Mat3 R = cam_from_world(*run.trajectory, camera.T_body_cam, run.exposures[frame].middle_s).linear();
    const Vec2 up = R.col(2).head<2>().normalized();
    Eigen::Matrix2d turn;
    turn << up.x(), -up.y(), up.y(), up.x();
    for (TrackedFeature& f : tracks.features[frame]) {
      Random beside(static_cast<std::uint64_t>(f.id), "window");
      f.pixel += s.window_error_px * (turn * Vec2(beside.normal(), beside.normal()));
    }
  }
}

inline Recorded record(const Scenario& s, std::uint64_t seed) {
  Random random(seed, "case " + s.motion);
  const HandheldOptions options = options_of(s, random, seed);
  SimulatedRecording run = simulate_handheld(options);
  Recorded out;
  out.reference = run.recording.imus.front();
  out.truth = run.truth;
  if (s.sensor == Sensor::gyro) {
    out.sensor = gyro_rotation(second_gyro(s, run, Random(seed, "second gyro")));
  } else if (s.sensor == Sensor::tracks) {
    TrackStream& tracks = run.recording.tracks.front();
    if (s.window_error_px > 0) turn_windows(s, options.camera, run, tracks);
    if (!s.readout_known) tracks.timing.shutter = Shutter::unknown, tracks.timing.readout_s = 0;
    out.sensor = track_rotation(tracks);
  } else {
    CameraStream& camera = run.recording.cameras.front();
    if (!s.readout_known) camera.timing.shutter = Shutter::unknown, camera.timing.readout_s = 0;
    VisualRotationOptions how;
    how.decode_ahead = 0;
    out.sensor = visual_rotation(camera, *camera.model, how);
  }
  return out;
}

/// Two gyros as they come, for whoever exchanges their roles.
struct GyroPair {
  ImuStream sensor, reference;
  Estimate truth;
};
inline GyroPair gyro_pair(const Scenario& s, std::uint64_t seed) {
  Random random(seed, "case " + s.motion);
  const SimulatedRecording run = simulate_handheld(options_of(s, random, seed));
  return {second_gyro(s, run, Random(seed, "second gyro")), run.recording.imus.front(), run.truth};
}

/// Found minus true offset (s), at the epoch of the answer.
inline double offset_error_s(const Estimate& found, const Estimate& truth) {
  return to_seconds(*found.offset - truth.clock_map().offset_at(as<SensorClock>(found.epoch)));
}

}  // namespace takt::cases
