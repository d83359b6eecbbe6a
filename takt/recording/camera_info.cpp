// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/camera_info.h"

#include <algorithm>
#include <cmath>

#include "takt/recording/third_radial.h"

namespace takt {

std::optional<CameraInfoModel> model_of(const CameraInfo& info) {
  constexpr std::uint32_t most_side = 65535;
  if (info.height == 0 || info.width == 0 || info.height > most_side || info.width > most_side) return std::nullopt;
  CameraInfoModel out;
  CameraModel& model = out.model;
  model.width = static_cast<int>(info.width);
  model.height = static_cast<int>(info.height);
  model.fx = info.k[0], model.cx = info.k[2], model.fy = info.k[4], model.cy = info.k[5];
  if (!(model.fx > 0) || !(model.fy > 0)) return std::nullopt;
  const auto is_zero = [](double x) { return x == 0; };
  const auto zero_from = [&](std::size_t i) {
    return info.d.size() >= i && std::all_of(info.d.begin() + static_cast<std::ptrdiff_t>(i), info.d.end(), is_zero);
  };
  if (zero_from(0)) return out;
  if (!std::all_of(info.d.begin(), info.d.end(), [](double x) { return std::isfinite(x); })) return std::nullopt;
  const bool radtan = info.distortion == "plumb_bob";
  const bool equidistant = info.distortion == "equidistant" || info.distortion == "fisheye";
  if (!(radtan && (zero_from(4) || zero_from(5))) && !(equidistant && zero_from(4))) return std::nullopt;
  model.distortion = radtan ? Distortion::radtan : Distortion::equidistant;
  std::copy_n(info.d.begin(), 4, model.coeffs.begin());
  if (radtan && info.d.size() > 4) out.off_px = fold_third_radial(model, info.d[4]);
  return out;
}

}  // namespace takt
