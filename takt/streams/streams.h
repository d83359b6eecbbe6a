// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"
#include "takt/streams/image.h"
#include "takt/time/instant.h"

/// What was measured. Every stream names itself ("imu0", "/camera/imu") and the clock that stamped it.
namespace takt {

/// Continuous-time noise of an IMU; nothing where the recording does not say.
struct ImuNoise {
  double gyro_density = 0;       ///< rad/s/√Hz
  double gyro_random_walk = 0;   ///< rad/s²/√Hz
  double accel_density = 0;      ///< m/s²/√Hz
  double accel_random_walk = 0;  ///< m/s³/√Hz
};

/// Angular rates and specific forces in the IMU's own frame. `accel` is empty where there is none,
/// else as long as `stamps`. Order is the file's: sorting and repair are the audit's work, and said.
struct ImuStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;
  std::vector<Stamp> arrivals;  ///< empty, or when each was recorded, on the recorder's clock
  std::vector<Vec3> gyro_rad_s;
  std::vector<Vec3> accel_m_s2;
  std::optional<ImuNoise> noise;
  std::optional<Mat4> T_body_imu;
  std::optional<double> temperature_c;  ///< of the device during the recording: output delays depend on it

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

struct Frame {
  std::size_t index = 0;  ///< place in the stream's stamps
  Stamp stamp;
  double exposure_s = 0;  ///< 0 where unknown
  GrayImage image;
};

/// Frames in order, decoded when asked for and not kept: memory stays bounded.
class FrameReader {
 public:
  virtual ~FrameReader() = default;
  /// The next frame that can be decoded, or nothing at the end. Broken frames are skipped and counted.
  virtual std::optional<Frame> next() = 0;
  /// A hint that frames before `index` are not wanted: a reader with random access need not decode them.
  virtual void skip_to(std::size_t index) { static_cast<void>(index); }
  [[nodiscard]] std::size_t broken() const { return broken_; }

 protected:
  std::size_t broken_ = 0;
};

/// A camera: its stamps are known without decoding a picture; `open` starts a fresh pass over the pictures.
struct CameraStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;
  std::vector<Stamp> arrivals;      ///< empty, or when each was recorded, on the recorder's clock
  std::vector<double> exposures_s;  ///< empty or one a frame
  FrameTiming timing;
  std::optional<CameraModel> model;
  std::optional<Mat4> T_body_cam;
  std::function<std::unique_ptr<FrameReader>()> open;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

/// Where features were seen (px), frame by frame. An id lasts as long as its feature is followed without a gap.
struct TrackedFeature {
  std::int64_t id;
  Vec2 pixel;
};
struct TrackStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;
  std::vector<std::vector<TrackedFeature>> features;  ///< one list a frame, by ascending id
  FrameTiming timing;
  CameraModel model;
  std::optional<double> pixel_sigma;
  std::optional<Mat4> T_body_cam;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

/// Orientations R_world_body of some device (CORI, poses).
struct AttitudeStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;
  std::vector<Quat> world_from_body;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

/// One angle about a fixed axis (rad): the pendulum's dial. A frame may give several readings, each from its own rows.
struct AngleStream {
  std::string name;
  std::string clock;
  std::vector<Stamp> stamps;
  std::vector<double> angle_rad;
  std::vector<double> rows;         ///< empty, or the row each reading was taken at, counted from the reference row
  std::vector<double> exposures_s;  ///< empty, or one a reading
  FrameTiming timing;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

/// All that one recording holds. `notes` says in words what was assumed while reading (units, time unit, repairs).
struct Recording {
  std::string path;
  std::string format;
  std::vector<ImuStream> imus;
  std::vector<CameraStream> cameras;
  std::vector<TrackStream> tracks;
  std::vector<AttitudeStream> attitudes;
  std::vector<AngleStream> angles;
  std::vector<std::string> files;  ///< what was read, for the provenance
  std::vector<std::string> notes;
};

}  // namespace takt
