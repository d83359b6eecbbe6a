// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "takt/simulation/sensor_noise.h"
#include "takt/streams/dial.h"
#include "takt/streams/image.h"

namespace takt {

/// The dial, where the camera is before it, and what light, paper and lens make of it.
struct DialScene {
  Dial dial;
  DialView view;
  double rest_deg = 45;  ///< what the dial shows when the pendulum hangs still
  ImageNoise noise;
  double paper_grey = 190, ink_grey = 35, wall_grey = 80;
  double texture = 0.04;     ///< rms contrast of the paper's grain; the wall has twice as much
  double blur_px = 0.5;      ///< σ of the lens
  double vignetting = 0.35;  ///< how much darker the corners are
};

/// The usual view: 640×480, 25 mm equivalent, 0.3 m before a dial of 0.75 m.
[[nodiscard]] DialScene dial_scene(DialKind kind);

/// Pictures of the dial from the bob. The camera is fixed to the bob, so a pixel looks at the reading plus its own
/// constant angle, and the whole picture is one look-up a pixel and instant in a texture that the lens and the pixel
/// have blurred already.
/// Immutable: may be used by many threads at once; a picture depends on nothing but the seed, the index and the motion.
class DialRenderer {
 public:
  DialRenderer(const DialScene& scene, std::uint64_t seed);

  /// `reading_rad`: what the dial shows on the radius through the camera at a time. The exposure of row y is centred on
  /// `middle_s` + y·`line_delay_s`. `threads` share the rows.
  [[nodiscard]] GrayImage render(std::size_t index, const std::function<double(double)>& reading_rad, double middle_s,
                                 double exposure_s, double line_delay_s, int threads) const;

 private:
  struct Look {
    float column;  ///< in texels from reading 0
    int row;       ///< offset of the texture's row
    float light;   ///< what vignetting leaves; 0 where the pixel does not see the dial's cylinder
  };

  void paint(std::uint64_t seed);
  void blur_along();

  DialScene scene_;
  SensorNoise noise_;
  double texel_rad_ = 0, first_rad_ = 0;
  int columns_ = 0, rows_ = 0;
  double row_m_ = 0.0005, top_m_ = 0;
  std::vector<float> texture_;
  std::vector<Look> looks_;  ///< one a pixel
};

}  // namespace takt
