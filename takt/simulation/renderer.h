// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "takt/simulation/camera.h"
#include "takt/simulation/room.h"
#include "takt/simulation/sensor_noise.h"

namespace takt {

/// Pictures of a room from a moving camera: one ray a pixel and instant; the exposure is averaged over as many instants
/// as the picture moves by pixels, and each row of a rolling shutter has its own pose.
/// Immutable: `render` may run on many threads at once, and a frame depends on nothing but the seed and its index.
class Renderer {
 public:
  Renderer(std::shared_ptr<const Trajectory> truth, const SimulatedCamera& camera, std::shared_ptr<const Room> room,
           ImageNoise noise, std::uint64_t seed);

  /// `threads` share the rows (0: as many as there are cores); the picture is the same for any number.
  [[nodiscard]] GrayImage render(std::size_t index, const Exposure& exposure, int threads) const;

 private:
  /// From camera to world, in the precision of the ray casting.
  struct Pose {
    Eigen::Matrix3f rotation;
    Eigen::Vector3f position;
  };
  [[nodiscard]] Pose pose_at(double t_s) const;
  [[nodiscard]] int instants(const Exposure& exposure) const;
  void add_row(int y, const Pose& pose, float* sum) const;

  std::shared_ptr<const Trajectory> truth_;
  SimulatedCamera camera_;
  CameraModel model_;
  std::shared_ptr<const Room> room_;
  SensorNoise noise_;
  std::vector<Eigen::Vector3f> bearings_;  ///< one a pixel; zero where the lens sees nothing
};

}  // namespace takt
