// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <vector>

#include "takt/signals/pixel_bearings.h"
#include "takt/streams/rotation_signal.h"

namespace takt {

/// A feature in one frame.
struct SeenFeature {
  std::int64_t id;
  SeenBearing seen;
};

/// Matches each frame with the one `stride` frames before it, by feature id: the pairs of a RotationSignal.
/// Frame k continues chain k mod stride.
class LongPairs {
 public:
  struct Options {
    double step_s = 0.4;              ///< wanted length of a pair
    std::size_t fewest_matches = 12;  ///< a pair with fewer is left out, and its chain starts anew
    std::size_t stored_matches = 80;  ///< spread over the view
  };
  /// `frame_step_s`: median step between frames.
  LongPairs(double frame_step_s, const Options& options);

  /// The next frame's features, by ascending id.
  void add(Stamp stamp, std::vector<SeenFeature> features);
  /// Features of the last frame that were not known to be there when it was added (new corners, found in it but
  /// reported with the next).
  void add_to_last(std::vector<SeenFeature> features);

  /// All pairs, chain by chain.
  [[nodiscard]] std::vector<BearingPair> finish();

 private:
  struct FrameView {
    Stamp stamp;
    std::vector<SeenFeature> features;
  };
  Options options_;
  std::size_t stride_;
  double longest_s_;
  std::deque<FrameView> last_;  ///< at most stride + 1 frames
  std::size_t frames_ = 0;
  std::vector<std::vector<BearingPair>> chains_;
};

}  // namespace takt
