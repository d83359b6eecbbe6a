// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "takt/simulation/camera.h"
#include "takt/simulation/sensor_noise.h"
#include "takt/streams/target.h"

namespace takt {

/// A board before a cluttered wall, and what paper and lens make of it.
struct PrintedBoard {
  Target target = AprilGrid{};
  Eigen::Isometry3d world_from_board = Eigen::Isometry3d::Identity();
  double appears_s = 0;  ///< true time before which the wall is bare
  ImageNoise noise;
  double paper_grey = 195, ink_grey = 35, wall_grey = 100;
  double blur_px = 0.5;  ///< σ of the lens
};

/// Pictures of a board from a moving camera. The print is a picture whose texels hold the exact share of ink; each
/// pixel averages 2 × 2 looks into it at as many instants of the exposure as the picture moves by pixels, and the lens
/// blurs the finely sampled picture. Each row of a rolling shutter has its own pose.
/// Immutable: `render` may run on many threads at once, and a frame depends on nothing but the seed and its index.
class BoardRenderer {
 public:
  BoardRenderer(std::shared_ptr<const Trajectory> truth, const SimulatedCamera& camera, const PrintedBoard& scene,
                std::uint64_t seed);

  /// `threads` share the rows (0: as many as there are cores); the picture is the same for any number.
  [[nodiscard]] GrayImage render(std::size_t index, const Exposure& exposure, int threads) const;

 private:
  struct Plane {
    int width = 0, height = 0;
    std::vector<std::uint8_t> texels;
  };
  /// From a direction in the camera's frame to texels of the print; the third is the depth's sign and scale.
  using ToTexels = Eigen::Matrix3f;

  void print(const Target& target);
  void paint_wall(std::uint64_t seed);
  [[nodiscard]] ToTexels to_texels(double t_s) const;
  [[nodiscard]] int instants(const Exposure& exposure) const;
  [[nodiscard]] std::size_t level(double t_s) const;
  void add_row(int fine_y, const ToTexels& map, const Plane& print, float texel_scale, bool bare, float* sum) const;

  std::shared_ptr<const Trajectory> truth_;
  SimulatedCamera camera_;
  CameraModel model_;
  PrintedBoard scene_;
  SensorNoise noise_;
  std::vector<Plane> prints_;  ///< each half as fine as the one before
  Plane wall_;                 ///< repeats itself
  double texel_m_ = 0;
  Vec2 low_m_, high_m_;                    ///< the paper
  std::vector<Eigen::Vector3f> bearings_;  ///< 2 × 2 a pixel; zero where the lens sees nothing
  std::vector<float> blur_;                ///< from fine samples to a pixel, along one axis
};

}  // namespace takt
