// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/feature_tracks.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "takt/motion/two_view.h"
#include "takt/signals/frame_prefetch.h"
#include "takt/signals/pixel_bearings.h"

namespace takt {

namespace {

constexpr double outlier_sigmas = 4, nominal_sigma_px = 0.3;
constexpr std::size_t fewest_for_consensus = 12;

}  // namespace

struct FeatureTrackReader::State {
  State(const CameraStream& stream, const CameraModel& m, FeatureTrackerOptions options)
      : model(m), bearings(m, stream.timing, m.height), tracker(options), frames(stream.open(), 4) {}

  /// Which matches fit one rigid motion between the two pictures.
  std::vector<bool> consistent(const std::vector<FeatureMatch>& matches) {
    std::vector<bool> good(matches.size(), true);
    if (matches.size() < fewest_for_consensus) return good;
    BearingPairs pairs;
    pairs.from.resize(3, static_cast<Eigen::Index>(matches.size()));
    pairs.to.resizeLike(pairs.from);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const auto from = bearings.see(matches[i].from, nominal_sigma_px),
                 to = bearings.see(matches[i].to, nominal_sigma_px);
      good[i] = from && to;
      const auto column = static_cast<Eigen::Index>(i);
      pairs.from.col(column) = good[i] ? Vec3(from->bearing.cast<double>()) : Vec3(Vec3::UnitZ());
      pairs.to.col(column) = good[i] ? Vec3(to->bearing.cast<double>()) : Vec3(Vec3::UnitX());
    }
    TwoViewOptions how;
    how.sigma_floor_rad = nominal_sigma_px / model.fx;
    const auto fit = fit_two_view(pairs, how);
    if (!fit) return good;
    for (std::size_t i = 0; i < matches.size(); ++i)
      if (fit->misfit[static_cast<Eigen::Index>(i)] > outlier_sigmas) good[i] = false;
    return good;
  }

  FollowedFrame follow(const Frame& frame) {
    FollowedFrame out{frame.index, frame.stamp, frame.exposure_s, {}};
    const auto matches = tracker.observe(frame.image);
    const auto good = consistent(matches);
    std::map<std::int64_t, std::int64_t> still;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (!good[i]) continue;
      const auto known = names.find(matches[i].id);
      const std::int64_t id = known != names.end() ? known->second : next_id++;
      still.emplace(matches[i].id, id);
      out.features.push_back({id, matches[i].to});
    }
    names = std::move(still);
    std::ranges::sort(out.features, {}, &TrackedFeature::id);
    return out;
  }

  CameraModel model;
  PixelBearings bearings;
  FeatureTracker tracker;
  FramePrefetch frames;
  std::map<std::int64_t, std::int64_t> names;  ///< tracker's id -> ours, of features that were good so far
  std::int64_t next_id = 1;
  GrayImage last;
};

FeatureTrackReader::FeatureTrackReader(const CameraStream& stream, const CameraModel& model,
                                       FeatureTrackerOptions options) {
  if (!stream.open) throw std::invalid_argument("FeatureTrackReader: " + stream.name + " has no pictures to open");
  state_ = std::make_unique<State>(stream, model, options);
}
FeatureTrackReader::~FeatureTrackReader() = default;
FeatureTrackReader::FeatureTrackReader(FeatureTrackReader&&) noexcept = default;

std::optional<FollowedFrame> FeatureTrackReader::next() {
  while (auto frame = state_->frames.next()) {
    const GrayImage& image = frame->image;
    if (image.width != state_->model.width || image.height != state_->model.height)
      throw std::invalid_argument("FeatureTrackReader: the camera model is for " + std::to_string(state_->model.width) +
                                  " x " + std::to_string(state_->model.height) + " px, a frame has " +
                                  std::to_string(image.width) + " x " + std::to_string(image.height));
    if (state_->last.pixels == image.pixels) continue;
    FollowedFrame out = state_->follow(*frame);
    state_->last = std::move(frame->image);
    return out;
  }
  return std::nullopt;
}

}  // namespace takt
