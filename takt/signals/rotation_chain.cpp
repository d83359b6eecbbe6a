// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/rotation_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "takt/math/median.h"

namespace takt {

RotationChain::RotationChain(RotationSignal signal, PairRotationOptions options, double longest_step_s,
                             double frame_step_s)
    : signal_(std::move(signal)), long_pairs_(frame_step_s, {}), options_(options), longest_step_s_(longest_step_s) {}

std::optional<Vec3> RotationChain::add(Stamp from, Stamp to, const std::vector<FollowedFeature>& features) {
  std::vector<SeenFeature> before, now;
  std::vector<BearingMatch> matches;
  for (const FollowedFeature& f : features) {
    before.push_back({f.id, f.from});
    now.push_back({f.id, f.to});
    matches.push_back(match(f.from, f.to));
  }
  if (!started_) long_pairs_.add(from, {});
  started_ = true;
  long_pairs_.add_to_last(std::move(before));
  long_pairs_.add(to, std::move(now));
  if (to_seconds(to - from) > longest_step_s_) {
    ++late_;
    return std::nullopt;
  }
  PairRotation pair = rotation_of_pair(matches, options_);
  switch (pair.outcome) {
    case PairOutcome::too_few_matches:
      ++featureless_;
      return std::nullopt;
    case PairOutcome::unexplained:
      ++unexplained_;
      return std::nullopt;
    case PairOutcome::measured:
      break;
  }
  for (const BearingMatch& m : pair.matches) rows_ += 0.5 * (m.row_from + m.row_to), ++seen_;
  signal_.increments.push_back({from, to, pair.rotation, pair.information, pair.apparent});
  return pair.apparent;
}

void RotationChain::note(std::size_t count, std::size_t frames, const char* what) {
  if (count > 0) signal_.notes.push_back(fmt::format("{} of {} frames {}", count, frames, what));
}

RotationSignal RotationChain::finish(std::size_t frames) {
  const std::size_t judged = signal_.increments.size() + unexplained_;
  if (judged > 0) signal_.unexplained_fraction = static_cast<double>(unexplained_) / static_cast<double>(judged);
  note(late_, frames, "come too long after the frame before them to be compared with it");
  note(featureless_, frames, "had too few features in common with the frame before them (blank, blurred, or a cut)");
  note(unexplained_, frames, "show a motion that no rotation with translation of the camera explains");
  if (seen_ > 0) signal_.apparent_row = rows_ / static_cast<double>(seen_);
  signal_.pairs = long_pairs_.finish();
  return std::move(signal_);
}

double median_step_s(const std::vector<Stamp>& stamps) {
  if (stamps.size() < 2) return 0;
  std::vector<Duration> steps(stamps.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = stamps[i + 1] - stamps[i];
  return to_seconds(median(std::move(steps)));
}

}  // namespace takt
