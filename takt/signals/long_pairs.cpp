// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/long_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "takt/signals/pair_rotation.h"

namespace takt {

namespace {

bool by_id(const SeenFeature& a, const SeenFeature& b) {
  return a.id < b.id;
}

std::vector<BearingMatch> common(const std::vector<SeenFeature>& from, const std::vector<SeenFeature>& to) {
  std::vector<BearingMatch> matches;
  for (auto a = from.begin(), b = to.begin(); a != from.end() && b != to.end();) {
    if (a->id < b->id)
      ++a;
    else if (b->id < a->id)
      ++b;
    else {
      matches.push_back(match(a->seen, b->seen));
      matches.back().id = a->id;
      ++a, ++b;
    }
  }
  return matches;
}

}  // namespace

LongPairs::LongPairs(double frame_step_s, const Options& options)
    : options_(options),
      stride_(frame_step_s > 0
                  ? std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(options_.step_s / frame_step_s)))
                  : 1),
      longest_s_(2.5 * std::max(frame_step_s, options_.step_s)),
      chains_(stride_) {}

void LongPairs::add(Stamp stamp, std::vector<SeenFeature> features) {
  last_.push_back({stamp, std::move(features)});
  ++frames_;
  if (last_.size() > stride_ + 1) last_.pop_front();
  if (last_.size() <= stride_) return;
  const FrameView& from = last_.front();
  if (to_seconds(stamp - from.stamp) > longest_s_) return;
  std::vector<BearingMatch> matches = common(from.features, last_.back().features);
  if (matches.size() < options_.fewest_matches) return;
  chains_[frames_ % stride_].push_back(
      {from.stamp, stamp, spread_over_view(std::move(matches), options_.stored_matches)});
}

void LongPairs::add_to_last(std::vector<SeenFeature> features) {
  if (last_.empty()) return;
  auto& known = last_.back().features;
  std::sort(features.begin(), features.end(), by_id);
  std::vector<SeenFeature> all;
  std::set_union(known.begin(), known.end(), features.begin(), features.end(), std::back_inserter(all), by_id);
  known = std::move(all);
}

std::vector<BearingPair> LongPairs::finish() {
  std::vector<BearingPair> all;
  for (auto& chain : chains_) std::move(chain.begin(), chain.end(), std::back_inserter(all));
  return all;
}

}  // namespace takt
