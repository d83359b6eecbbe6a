// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/offset_history.h"

#include <algorithm>
#include <cmath>

namespace takt {

namespace {

constexpr std::size_t most_kept = 20000;
/// A line is drawn anew after so long, where the offset moves.
constexpr double longest_piece_s = 60;

Duration along(Duration offset, double drift, Stamp from, Stamp to) {
  return offset + from_seconds(drift * seconds_since(from, to));
}

}  // namespace

void OffsetHistory::observe(const OffsetNow& now, const OffsetTracker::Counts& counts) {
  if (!now.offset) return;
  const bool new_stretch = !said_.empty() && said_.back().stretch != counts.steps;
  if (!said_.empty() && !new_stretch && seconds_since(said_.back().stamp, now.stamp) < spacing_s_) return;
  said_.push_back({now.stamp, *now.offset, *now.sigma_s, now.drift, counts.steps});
  if (said_.size() < most_kept) return;
  std::vector<Said> half;
  for (std::size_t i = 0; i < said_.size(); ++i)
    if (i % 2 == 0 || (i > 0 && said_[i].stretch != said_[i - 1].stretch)) half.push_back(said_[i]);
  said_ = std::move(half);
  spacing_s_ *= 2;
}

void OffsetHistory::complete(Estimate& e, const std::optional<Estimate>& truth) const {
  if (said_.empty() || !e.answered()) return;
  Panel panel{
      .name = "offset",
      .kind = "lines",
      .title = "The offset as it came to be known",
      .caption = "The band is three sigma; it should narrow at once where the motion is lively, and never jump.",
      .x = {"time", "s", {}, {}},
      .y = {{"offset", "ms", {}, {}}},
      .marks = {}};
  for (const Said& s : said_) {
    panel.x.values.push_back(seconds_since(said_.front().stamp, s.stamp));
    panel.y[0].values.push_back(1e3 * to_seconds(s.offset));
    panel.y[0].sigma.push_back(3e3 * s.sigma_s);
  }
  if (truth && truth->answered()) {
    Series known{"truth", "ms", {}, {}};
    for (const Said& s : said_)
      known.values.push_back(1e3 * to_seconds(truth->clock_map().offset_at(as<SensorClock>(s.stamp))));
    panel.y.push_back(std::move(known));
  }
  // From the end of each stretch back: what is known last is known best.
  std::vector<OffsetPiece> pieces;
  for (std::size_t end = said_.size(); end > 0;) {
    const Said& last = said_[end - 1];
    std::size_t begin = end;
    while (begin > 0 && said_[begin - 1].stretch == last.stretch &&
           seconds_since(said_[begin - 1].stamp, last.stamp) < longest_piece_s)
      --begin;
    pieces.push_back({said_[begin].stamp, last.stamp, last.offset, last.drift, last.sigma_s});
    if (begin > 0 && said_[begin - 1].stretch != last.stretch)
      panel.marks.push_back({"a step", seconds_since(said_.front().stamp, said_[begin].stamp)});
    end = begin;
  }
  std::ranges::reverse(pieces);
  e.evidence.panels.push_back(std::move(panel));
  const auto fits = [&](const OffsetPiece& p) {
    const double apart = to_seconds(along(*e.offset, e.drift.value_or(0), e.epoch, p.epoch) - p.offset);
    return std::abs(apart) < 3 * std::hypot(p.sigma_s, e.sigma_s.value_or(0));
  };
  if (std::ranges::all_of(pieces, fits)) return;
  pieces.back().epoch = e.epoch, pieces.back().offset = *e.offset, pieces.back().drift = e.drift.value_or(0);
  pieces.back().sigma_s = e.sigma_s.value_or(pieces.back().sigma_s);
  e.pieces = std::move(pieces);
}

}  // namespace takt
