// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/track_rotation.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "takt/signals/pixel_bearings.h"
#include "takt/signals/rotation_chain.h"

namespace takt {

namespace {

/// Where tracks do not say how precise they are (px). Only a start: the scatter is then measured pair by pair.
constexpr double nominal_sigma_px = 0.5;

RotationSignal signal_of(const TrackStream& tracks) {
  RotationSignal signal;
  signal.name = tracks.name;
  signal.clock = tracks.clock;
  signal.source = "tracks";
  signal.timing = tracks.timing;
  signal.timing.instant = ExposureInstant::middle;
  signal.timing.rows = tracks.model.height;
  signal.model = tracks.model;
  if (tracks.T_body_cam) signal.R_body_sensor = tracks.T_body_cam->topLeftCorner<3, 3>();
  return signal;
}

std::vector<FollowedFeature> common_features(const std::vector<TrackedFeature>& from,
                                             const std::vector<TrackedFeature>& to, const PixelBearings& bearings,
                                             double sigma_px) {
  std::vector<FollowedFeature> common;
  for (auto a = from.begin(), b = to.begin(); a != from.end() && b != to.end();) {
    if (a->id < b->id) {
      ++a;
    } else if (b->id < a->id) {
      ++b;
    } else {
      const auto seen = bearings.see(a->pixel, sigma_px), seen_next = bearings.see(b->pixel, sigma_px);
      if (seen && seen_next) common.push_back({a->id, *seen, *seen_next});
      ++a, ++b;
    }
  }
  return common;
}

}  // namespace

RotationSignal track_rotation(const TrackStream& tracks, const TrackRotationOptions& options) {
  if (tracks.stamps.size() != tracks.features.size())
    throw std::invalid_argument("track_rotation: " + std::to_string(tracks.stamps.size()) + " stamps but " +
                                std::to_string(tracks.features.size()) + " lists of features");
  PairRotationOptions pair = options.pair;
  pair.sigma_is_known = tracks.pixel_sigma.has_value();
  const double sigma_px = tracks.pixel_sigma.value_or(nominal_sigma_px);
  const PixelBearings bearings(tracks.model, tracks.timing, tracks.model.height);
  const Duration to_middle = from_seconds(tracks.timing.to_exposure_middle_s(tracks.timing.exposure_s));
  const double step_s = median_step_s(tracks.stamps);
  RotationChain chain(signal_of(tracks), pair, std::max(options.longest_step_s, 1.5 * step_s), step_s);

  std::size_t last = 0, backward = 0;
  for (std::size_t i = 1; i < tracks.size(); ++i) {
    if (tracks.stamps[i] <= tracks.stamps[last]) {
      ++backward;
      continue;
    }
    chain.add(tracks.stamps[last] + to_middle, tracks.stamps[i] + to_middle,
              common_features(tracks.features[last], tracks.features[i], bearings, sigma_px));
    last = i;
  }
  chain.note(backward, tracks.size(), "are not later than the frame before them and were left out");
  return chain.finish(tracks.size());
}

}  // namespace takt
