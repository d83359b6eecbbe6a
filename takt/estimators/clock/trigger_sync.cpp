// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/trigger_sync.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace takt {

namespace {

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// The trigger's number of each sample, by the intervals of the sensor's own stamps.
struct Numbered {
  std::vector<std::int64_t> number;
  double period_s = 0;
  std::size_t lost = 0;
};
Numbered numbered(std::span<const TriggeredSample> s) {
  Numbered out;
  std::vector<double> steps;
  for (std::size_t i = 1; i < s.size(); ++i)
    steps.push_back(1e-9 * static_cast<double>(s[i].sensor_ns - s[i - 1].sensor_ns));
  out.period_s = median(steps);
  out.number.push_back(0);
  for (const double step : steps) {
    const auto ahead = out.period_s > 0 ? std::max<std::int64_t>(1, std::llround(step / out.period_s)) : 1;
    out.lost += static_cast<std::size_t>(ahead - 1);
    out.number.push_back(out.number.back() + ahead);
  }
  return out;
}

}  // namespace

TriggerSyncResult match_triggers(std::span<const TriggeredSample> a, std::span<const TriggeredSample> b) {
  TriggerSyncResult out;
  if (a.size() < 8 || b.size() < 8) {
    out.why = "fewer than 8 samples in one of the streams";
    return out;
  }
  const Numbered na = numbered(a), nb = numbered(b);
  out.period_a_s = na.period_s, out.period_b_s = nb.period_s;
  out.lost_a = na.lost, out.lost_b = nb.lost;
  if (!(na.period_s > 0) || std::abs(nb.period_s / na.period_s - 1) > 0.01) {
    out.why = "the streams have different rates: they do not share a trigger";
    return out;
  }
  // What a stream's arrivals say of trigger 0, each by its own line; late messages only come later, so the earliest
  // tenth speaks.
  const auto start = [](std::span<const TriggeredSample> s, const Numbered& n, double period_s, std::int64_t origin) {
    std::vector<double> v;
    for (std::size_t i = 0; i < s.size(); ++i)
      v.push_back(1e-9 * static_cast<double>(s[i].arrival_ns - origin) - period_s * static_cast<double>(n.number[i]));
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 10), v.end());
    return v[v.size() / 10];
  };
  // The period on the host's clock, from both streams' arrivals over their whole length.
  const auto host_period = [](std::span<const TriggeredSample> s, const Numbered& n) {
    const std::size_t third = s.size() / 3;
    std::vector<double> slopes;
    for (std::size_t i = 0; i < third; ++i) {
      const std::size_t j = s.size() - third + i;
      slopes.push_back(1e-9 * static_cast<double>(s[j].arrival_ns - s[i].arrival_ns) /
                       static_cast<double>(n.number[j] - n.number[i]));
    }
    return median(slopes);
  };
  const double period_s = 0.5 * (host_period(a, na) + host_period(b, nb));
  const std::int64_t origin = a.front().arrival_ns;
  const double apart = (start(a, na, period_s, origin) - start(b, nb, period_s, origin)) / period_s;
  const auto shift = static_cast<std::int64_t>(std::llround(apart));
  const double off = std::abs(apart - static_cast<double>(shift));
  if (off > 0.3) {
    out.why = fmt::format(
        "the least delays of both streams differ by {:.2f} of a period: either neighbour may be meant", off);
    return out;
  }
  std::map<std::int64_t, std::size_t> by_number;
  for (std::size_t i = 0; i < a.size(); ++i) by_number[na.number[i] + shift] = i;
  for (std::size_t i = 0; i < b.size(); ++i)
    if (const auto found = by_number.find(nb.number[i]); found != by_number.end())
      out.matches.push_back({found->second, i, std::min(a[found->second].arrival_ns, b[i].arrival_ns)});
  out.ambiguous = out.matches.size() < 4;
  if (out.ambiguous) out.why = "hardly any triggers in common";
  return out;
}

FramePairing pair_frames(std::span<const FrameNote> frames, const StrobeStream& strobes) {
  FramePairing out;
  out.strobe_of.assign(frames.size(), std::nullopt);
  const std::size_t n = frames.size(), m = strobes.size();
  if (n < 4 || m < 4) {
    out.why = "fewer than 4 frames or strobes";
    return out;
  }
  const double hz = strobes.counter.tick_hz;
  const auto strobe_s = [&](std::size_t j) {
    return static_cast<double>(strobes.strobes[j].start_ticks - strobes.strobes[0].start_ticks) / hz;
  };
  const auto width_s = [&](std::size_t j) {
    return static_cast<double>(strobes.strobes[j].end_ticks - strobes.strobes[j].start_ticks) / hz;
  };
  const auto frame_s = [&](std::size_t i) {
    return 1e-9 * static_cast<double>(frames[i].stamp_ns - frames[0].stamp_ns);
  };
  std::vector<double> steps;
  for (std::size_t j = 1; j < m; ++j) steps.push_back(strobe_s(j) - strobe_s(j - 1));
  const double period = median(steps);
  // How well frame i and strobe j agree with frame h and strobe g before them, and in their widths.
  const auto agrees = [&](std::size_t h, std::size_t g, std::size_t i, std::size_t j) {
    const double tolerance = 0.02 * period + 2e-4 * std::abs(strobe_s(j) - strobe_s(g));
    return std::abs((frame_s(i) - frame_s(h)) - (strobe_s(j) - strobe_s(g))) < tolerance;
  };
  const auto same_width = [&](std::size_t i, std::size_t j) {
    return frames[i].exposure_s <= 0 || std::abs(frames[i].exposure_s - width_s(j)) < std::max(2e-5, 0.02 * width_s(j));
  };
  // The run of frames from i on that goes with strobes from j on, lost ones on either side allowed.
  const auto follow = [&](std::size_t i, std::size_t j, std::size_t most,
                          std::vector<std::pair<std::size_t, std::size_t>>* pairs) {
    std::size_t agreed = 0;
    std::size_t h = i, g = j;
    if (!same_width(i, j)) return agreed;
    if (pairs) pairs->push_back({i, j});
    ++agreed;
    for (std::size_t k = i + 1; k < n && k - i < most; ++k) {
      std::size_t next = g + 1;
      while (next < m && strobe_s(next) - strobe_s(g) < frame_s(k) - frame_s(h) - 0.4 * period) ++next;
      if (next >= m) break;
      if (!agrees(h, g, k, next)) continue;  // a frame whose strobe was lost
      if (!same_width(k, next)) break;
      if (pairs) pairs->push_back({k, next});
      ++agreed;
      h = k, g = next;
    }
    return agreed;
  };
  constexpr std::size_t probe = 64;
  std::size_t i = 0, from = 0;
  bool unsure = false;
  while (i + 3 < n) {
    // Every start that could be meant; the best must stand out.
    std::size_t best = 0, second = 0, at = 0;
    const std::size_t window = std::min(m, from + 256);
    const std::size_t length = std::min(probe, n - i);
    for (std::size_t j = from; j < window; ++j) {
      const std::size_t agreed = follow(i, j, length, nullptr);
      if (agreed > best)
        second = best, best = agreed, at = j;
      else
        second = std::max(second, agreed);
    }
    const std::size_t reachable = std::min(length, window - from);
    if (best < 4 || best * 10 < reachable * 6) {
      ++i;  // this frame has no strobe
      continue;
    }
    if (second + std::max<std::size_t>(2, best / 16) > best) {
      unsure = true;
      out.why = fmt::format("equal intervals and exposures: {} and {} of {} frames agree for two different counts",
                            best, second, length);
      i += length;
      continue;
    }
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    follow(i, at, n, &pairs);
    for (const auto& [frame, strobe] : pairs) out.strobe_of[frame] = strobe;
    if (i > 0 && from > 0) ++out.disagreements;
    i = pairs.back().first + 1;
    from = pairs.back().second + 1;
    if (from >= m) break;
  }
  std::size_t paired = 0;
  for (const auto& s : out.strobe_of) paired += s.has_value();
  out.ambiguous = unsure || paired == 0;
  if (paired == 0 && out.why.empty()) out.why = "no run of frames agrees with any run of strobes";
  out.lost_strobes = n - paired;
  out.lost_frames = m - std::min(m, paired);
  return out;
}

std::vector<double> compensated_triggers(double middle_s, std::span<const double> exposures_s,
                                         std::span<const double> delays_s) {
  if (exposures_s.size() != delays_s.size()) throw std::invalid_argument("compensated_triggers: one delay a camera");
  std::vector<double> out;
  for (std::size_t i = 0; i < exposures_s.size(); ++i) out.push_back(middle_s - 0.5 * exposures_s[i] - delays_s[i]);
  return out;
}

}  // namespace takt
