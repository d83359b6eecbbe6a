// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"

/// From pictures to point matches: corners spread over the image, followed from frame to frame.
namespace takt {

struct FeatureTrackerOptions {
  int features = 200;                ///< kept alive, spread over the image
  int window_px = 15;                ///< side of the patch that is matched, at working size
  int levels = 4;                    ///< of the image pyramid; each one doubles the motion that can be followed
  int full_size_width_px = 1000;     ///< wider images are halved until they are not wider: that is the working size
  double forward_backward_px = 0.5;  ///< how far tracking there and back may miss its start, at working size
  double contrast_per_px = 1.0;      ///< weakest grey-level gradient (rms over a patch) that still is a corner
  double fewer_than_share = 0.85;    ///< new corners are sought when fewer than this share is alive
  double prediction_failed_below = 0.35;  ///< share of survivors below which a predicted flow is tried again without
};

/// One feature seen in two consecutive frames, in pixels of the full image. `closure_px` is how far tracking it back
/// missed where it came from.
struct FeatureMatch {
  std::int64_t id = 0;
  Vec2 from, to;
  float closure_px = 0;
};

/// Where a feature is expected in the next frame, from where it was (full-size px); nothing if it leaves the image.
using FlowPrediction = std::function<std::optional<Vec2>(const Vec2&)>;

/// Follows corners by pyramidal Lucas–Kanade [Bouguet2001], there and back, and replaces those it lost. New corners
/// are the points of largest smaller structure-tensor eigenvalue [Shi1994] in the empty cells of a grid.
/// The result depends on the images alone, not on the number of threads. Images may differ in size: a change of size
/// starts anew.
class FeatureTracker {
 public:
  explicit FeatureTracker(FeatureTrackerOptions options = {});
  ~FeatureTracker();
  FeatureTracker(FeatureTracker&&) noexcept;
  FeatureTracker& operator=(FeatureTracker&&) noexcept;

  /// Matches from the previous image to this one; none for the first. Throws std::invalid_argument on an empty image.
  std::vector<FeatureMatch> observe(const GrayImage& image, const FlowPrediction& predict = {});

  /// Features alive in the last image, new ones included.
  [[nodiscard]] std::size_t alive() const;
  /// Features that the last `observe` set out to follow.
  [[nodiscard]] std::size_t sought() const;
  /// Full-size pixels per pixel at working size: 1, 2, 4 ...
  [[nodiscard]] int reduction() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt
