// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/camera_info.h"

#include <algorithm>

namespace takt {

std::optional<CameraModel> model_of(const CameraInfo& info) {
  constexpr std::uint32_t most_side = 65535;
  if (info.height == 0 || info.width == 0 || info.height > most_side || info.width > most_side) return std::nullopt;
  CameraModel model;
  model.width = static_cast<int>(info.width);
  model.height = static_cast<int>(info.height);
  model.fx = info.k[0], model.cx = info.k[2], model.fy = info.k[4], model.cy = info.k[5];
  if (!(model.fx > 0) || !(model.fy > 0)) return std::nullopt;
  const auto is_zero = [](double x) { return x == 0; };
  if (std::all_of(info.d.begin(), info.d.end(), is_zero)) return model;
  const bool four = info.d.size() >= 4 && std::all_of(info.d.begin() + 4, info.d.end(), is_zero);
  const bool radtan = info.distortion == "plumb_bob";
  if (!four || (!radtan && info.distortion != "equidistant" && info.distortion != "fisheye")) return std::nullopt;
  model.distortion = radtan ? Distortion::radtan : Distortion::equidistant;
  std::copy_n(info.d.begin(), 4, model.coeffs.begin());
  return model;
}

}  // namespace takt
