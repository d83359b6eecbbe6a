// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

namespace takt {

struct TrackingOptions {
  std::string method = "filter";
  double initial_offset_s = 0;     ///< where the search begins
  std::optional<double> search_s;  ///< half-width of the search around it; nothing: as far as the data overlap
  bool refine_extrinsics = true;   ///< refine the camera's mounting
  bool refine_intrinsics = false;  ///< refine focal lengths and the centre
  bool line_delay = false;         ///< estimate the line delay even where it is known
  bool feature_velocity = false;   ///< window: shift observations by measured feature velocities [Qin2018]
  double drift_sigma_ppm = 50;     ///< how far two clocks may run apart
};

template <class Visitor>
void describe(TrackingOptions& o, Visitor& v) {
  v("method", o.method, "filter (MSCKF) or window (sliding-window optimisation)");
  v("initial_offset_s", o.initial_offset_s, "where the search begins");
  v("search_s", o.search_s, "half-width of the search around it; as far as the data overlap when left out");
  v("refine_extrinsics", o.refine_extrinsics, "refine the camera's mounting");
  v("refine_intrinsics", o.refine_intrinsics, "let focal lengths and the image centre vary; the window tells them");
  v("line_delay", o.line_delay, "estimate the line delay even where it is known");
  v("feature_velocity", o.feature_velocity, "window: shift observations by measured feature velocities, as published");
  v("drift_sigma_ppm", o.drift_sigma_ppm, "how far the two clocks may run apart, one sigma");
}

}  // namespace takt
