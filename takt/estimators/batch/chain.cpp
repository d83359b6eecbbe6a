// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/chain.h"

namespace takt::batch {

namespace {

/// Room for the offset to move while it is being found (s).
constexpr double margin_s = 0.01;

double mean_row(const CameraSession& camera, const BoardView& view) {
  double sum = 0;
  for (const CornerObservation& c : view.corners) sum += camera.row(c);
  return sum / static_cast<double>(view.corners.size());
}

}  // namespace

std::vector<ChainFrame> make_chain(const CameraSession& camera, const ImuCurve& imu, const CameraLink& link) {
  std::vector<ChainFrame> all;
  for (const BoardView& view : camera.poses.views)
    all.push_back({&view, camera.time_s[view.frame], mean_row(camera, view)});
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    const double from = link.imu_time(all[i].time_s, all[i].mean_row) - margin_s,
                 to = link.imu_time(all[i + 1].time_s, all[i + 1].mean_row) + margin_s;
    all[i].joined = all[i + 1].time_s - all[i].time_s <= longest_join_s && imu.covers(from, to);
  }
  std::vector<ChainFrame> chain;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].joined || (i > 0 && all[i - 1].joined)) chain.push_back(all[i]);
  return chain;
}

}  // namespace takt::batch
