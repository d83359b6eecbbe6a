// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/pulse_train.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/error.h"
#include "takt/math/median.h"

namespace takt {

namespace {

constexpr double farthest_rate = 0.02;   // a counter is at most 2 % off
constexpr std::size_t regular_run = 5;   // so many edges in step make a train
constexpr double another_edge_s = 0.02;  // a smaller step is the counter's own, not another edge's

std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

struct EdgeAt {
  std::int64_t ticks;
  std::size_t index;
};

/// The width of a counter that wraps, found where it does: the step back plus 2^bits is a whole number of seconds.
int bits_of(const PulseStream& s) {
  if (s.counter.bits < 64) return s.counter.bits;
  for (std::size_t i = 1; i < s.size(); ++i) {
    const std::int64_t d = difference(s.pulses[i].ticks, s.pulses[i - 1].ticks);
    if (d >= 0) continue;
    for (const int bits : {16, 24, 32, 40, 48, 56}) {
      const double range = std::ldexp(1, bits);
      if (s.pulses[i - 1].ticks < 0 || static_cast<double>(s.pulses[i - 1].ticks) >= range) continue;
      const double seconds = (static_cast<double>(d) + range) / s.counter.tick_hz;
      // From the top tenth to the bottom tenth of the range, in whole seconds.
      const bool ends = static_cast<double>(s.pulses[i - 1].ticks) > 0.9 * range - 2 * s.counter.tick_hz &&
                        static_cast<double>(s.pulses[i].ticks) < 0.1 * range + 2 * s.counter.tick_hz;
      if (seconds > 0.5 && ends && std::abs(seconds - std::round(seconds)) < farthest_rate * seconds && seconds < 20)
        return bits;
    }
  }
  return 64;
}

/// Median of the intervals that are about a second; nothing where hardly any is.
std::optional<double> ticks_per_second(const std::vector<EdgeAt>& e, double tick_hz) {
  std::vector<double> about_one;
  for (std::size_t i = 1; i < e.size(); ++i) {
    // Over one or two false edges too.
    for (std::size_t back = 1; back <= 3 && back <= i; ++back) {
      const auto d = static_cast<double>(difference(e[i].ticks, e[i - back].ticks));
      if (std::abs(d / tick_hz - 1) < farthest_rate) about_one.push_back(d);
    }
  }
  if (about_one.size() < 3) return std::nullopt;
  return median(about_one);
}

/// How much an interval differs from the one before: the scale of what is usual.
double usual_change(const std::vector<EdgeAt>& e, double per_second) {
  std::vector<double> changes;
  for (std::size_t i = 2; i < e.size(); ++i) {
    const auto a = static_cast<double>(e[i].ticks - e[i - 1].ticks),
               b = static_cast<double>(e[i - 1].ticks - e[i - 2].ticks);
    if (std::abs(a / per_second - 1) < farthest_rate && std::abs(b / per_second - 1) < farthest_rate)
      changes.push_back(std::abs(a - b));
  }
  return changes.empty() ? 0.01 * per_second : 1.4826 * median(changes);
}

/// Follows the train from its first regular run on.
class Tracker {
 public:
  Tracker(double per_second, double change) : per_second_(per_second), change_(change) {}

  [[nodiscard]] double gate(double seconds, double per_second) const {
    // Noise of one edge, what the rate is not known to over a gap, and what a bare crystal may do meanwhile.
    return 6 * change_ * (1 + 0.1 * std::min(seconds, 50.0)) + 3 +
           per_second * (2e-7 * seconds + 2e-8 * seconds * seconds);
  }
  [[nodiscard]] bool regular(const EdgeAt& a, const EdgeAt& b) const {
    const auto d = static_cast<double>(b.ticks - a.ticks);
    const double seconds = std::round(d / per_second_);
    if (seconds < 1 || seconds > 600) return false;
    return std::abs(d - seconds * per_second_) < gate(seconds, per_second_) + 1e-5 * per_second_ * seconds;
  }
  double per_second_, change_;
};

/// One stretch of the counter without restarts.
void follow(const std::vector<EdgeAt>& e, double tick_hz, std::size_t restarts, PulseTrain& out) {
  const auto rate = ticks_per_second(e, tick_hz);
  if (!rate) {
    out.false_edges += e.size();
    return;
  }
  Tracker tracker(*rate, usual_change(e, *rate));
  TrainSegment* segment = nullptr;
  double per_second = *rate;
  EdgeAt last{};
  double last_residual = 0;
  std::vector<EdgeAt> strays;  // since the last edge that belonged to the train

  const auto take = [&](const std::vector<EdgeAt>& run, std::int64_t first_second) {
    const auto length = static_cast<double>(run.back().ticks - run.front().ticks);
    per_second = length / std::round(length / per_second);
    for (const EdgeAt& r : run) {
      const double since = static_cast<double>(r.ticks - run.front().ticks) / per_second;
      segment->pulses.push_back({first_second + static_cast<std::int64_t>(std::llround(since)), r.ticks, r.index});
    }
    last = run.back();
    last_residual = 0;
  };
  const auto open = [&](const std::vector<EdgeAt>& run) {
    if (segment) {
      const double since = static_cast<double>(run.front().ticks - last.ticks) / per_second,
                   step = since - std::round(since);
      if (std::abs(step) < another_edge_s && since > 0.5) {
        // The seconds are counted on; only the phase has slipped.
        out.slips_s.push_back(step);
        segment->slips.push_back(segment->pulses.size());
        take(run, segment->pulses.back().second + static_cast<std::int64_t>(std::llround(since)));
        return;
      }
      out.steps_s.push_back(step);
    }
    segment = &out.segments.emplace_back();
    segment->restarts = restarts;
    take(run, 0);
  };

  for (const EdgeAt& edge : e) {
    if (segment) {
      const auto since = static_cast<double>(edge.ticks - last.ticks);
      const double seconds = std::round(since / per_second);
      const double residual = since - seconds * per_second;
      if (seconds >= 1 && std::abs(residual) < tracker.gate(seconds, per_second)) {
        segment->pulses.push_back(
            {segment->pulses.back().second + static_cast<std::int64_t>(seconds), edge.ticks, edge.index});
        per_second += 0.1 * residual / seconds;
        out.false_edges += strays.size();
        strays.clear();
        last = edge;
        last_residual = residual;
        continue;
      }
      // A second edge at the same second: the nearer one is the pulse.
      if (seconds == 0 && segment->pulses.size() > 1 && std::abs(since + last_residual) < std::abs(last_residual) &&
          std::abs(since + last_residual) < tracker.gate(1, per_second)) {
        segment->pulses.back().ticks = edge.ticks;
        segment->pulses.back().index = edge.index;
        ++out.false_edges;
        last_residual += since;
        last = edge;
        continue;
      }
    }
    strays.push_back(edge);
    // Do the strays hold a run of their own? Each is tried as the end of one.
    std::vector<EdgeAt> run{edge};
    for (std::size_t i = strays.size() - 1; i-- > 0 && run.size() < regular_run;)
      if (tracker.regular(strays[i], run.back()) && strays[i].ticks < run.back().ticks) run.push_back(strays[i]);
    // The old train must have been silent meanwhile, else these are a second train beside it.
    if (run.size() < regular_run) continue;
    std::reverse(run.begin(), run.end());
    out.false_edges += strays.size() - run.size();
    open(run);
    strays.clear();
  }
  out.false_edges += strays.size();
}

/// Both edges captured without saying which: two trains a second. The pulse's beginning starts the shorter interval.
std::vector<EdgeAt> leading_edges(const std::vector<EdgeAt>& e, double tick_hz, PulseTrain& out) {
  if (e.size() < 8) return e;
  // Share of edges that have a partner one second on, and another edge regularly between.
  std::vector<double> fractions;
  for (std::size_t i = 2; i < e.size(); ++i) {
    const auto whole = static_cast<double>(e[i].ticks - e[i - 2].ticks),
               part = static_cast<double>(e[i - 1].ticks - e[i - 2].ticks);
    if (std::abs(whole / tick_hz - 1) < farthest_rate) fractions.push_back(part / whole);
  }
  if (static_cast<double>(fractions.size()) < 0.8 * static_cast<double>(e.size()) - 1.6) return e;
  std::vector<double> shorter;
  for (const double f : fractions) shorter.push_back(std::min(f, 1 - f));
  const double width = median(shorter);
  if (width > 0.45) {
    out.two_trains = true;
    return e;
  }
  std::vector<EdgeAt> kept;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const double to_next = i + 1 < e.size() ? static_cast<double>(e[i + 1].ticks - e[i].ticks) / tick_hz : 1 - width;
    const double from_last = i > 0 ? static_cast<double>(e[i].ticks - e[i - 1].ticks) / tick_hz : 1 - width;
    const bool leads = std::abs(to_next - width) < 0.02 + 0.1 * width,
               trails = std::abs(from_last - width) < 0.02 + 0.1 * width;
    if (!trails || leads) kept.push_back(e[i]);
  }
  out.words.push_back(fmt::format(
      "both edges of the pulse were captured ({:.3g} ms apart); the first of each pair is the second", 1e3 * width));
  return kept;
}

}  // namespace

double TrainSegment::second_at(std::int64_t ticks) const {
  const auto after = std::upper_bound(pulses.begin(), pulses.end(), ticks,
                                      [](std::int64_t t, const TrainPulse& p) { return t < p.ticks; });
  const TrainPulse& p = after == pulses.begin() ? *after : *std::prev(after);
  if (after != pulses.begin() && after != pulses.end())
    return static_cast<double>(p.second) + static_cast<double>(ticks - p.ticks) /
                                               static_cast<double>(after->ticks - p.ticks) *
                                               static_cast<double>(after->second - p.second);
  return static_cast<double>(p.second) + static_cast<double>(ticks - p.ticks) / ticks_per_second;
}

ExtendedCount CountExtender::extend(std::int64_t raw) {
  if (last_raw_) {
    const std::int64_t step = difference(raw, *last_raw_);
    if (step < 0) {
      const bool wraps = bits_ < 64 && static_cast<double>(step) + std::ldexp(1, bits_) <
                                           std::max(20 * tick_hz_, std::ldexp(1, bits_ - 1));
      if (wraps) {
        add_ = sum(add_, std::int64_t{1} << bits_);
      } else if (static_cast<double>(-step) > 0.5 * tick_hz_) {
        ++restarts_;
        add_ = 0;
      }
    }
  }
  last_raw_ = raw;
  return {sum(raw, add_), restarts_};
}

std::int64_t CountExtender::nearest(std::int64_t raw) const {
  const std::int64_t here = sum(raw, add_);
  if (bits_ >= 63 || !last_raw_) return here;
  const std::int64_t turn = std::int64_t{1} << bits_, apart = difference(raw, *last_raw_);
  if (apart > turn / 2) return here - turn;
  return apart < -turn / 2 ? sum(here, turn) : here;
}

PulseTrain find_pulse_train(const PulseStream& stream, bool falling) {
  PulseTrain out;
  out.tick_hz = stream.counter.tick_hz;
  if (!(out.tick_hz > 0)) throw std::invalid_argument("find_pulse_train: tick_hz must be positive");
  const Edge wanted = falling ? Edge::falling : Edge::rising, other = falling ? Edge::rising : Edge::falling;
  const auto has = [&](Edge edge) {
    return std::any_of(stream.pulses.begin(), stream.pulses.end(), [edge](const Pulse& p) { return p.edge == edge; });
  };
  const bool told = has(wanted);
  out.only_falling = !told && has(other);
  out.bits = bits_of(stream);
  if (out.bits < 64 && stream.counter.bits >= 64)
    out.words.push_back(fmt::format("the counter wraps at 2^{}", out.bits));

  std::vector<std::vector<EdgeAt>> stretches(1);
  CountExtender extender(out.bits, out.tick_hz);
  std::size_t lost_captures = 0;
  std::optional<std::uint32_t> sequence;
  for (std::size_t i = 0; i < stream.size(); ++i) {
    const Pulse& p = stream.pulses[i];
    if (told && p.edge == other) continue;
    const ExtendedCount at = extender.extend(p.ticks);
    if (at.restarts >= stretches.size()) stretches.emplace_back();
    if (p.sequence && sequence && at.restarts == out.restarts && *p.sequence - *sequence < 1000)
      lost_captures += *p.sequence - *sequence - (*p.sequence != *sequence);
    sequence = p.sequence;
    out.restarts = at.restarts;
    std::vector<EdgeAt>& now = stretches.back();
    if (!now.empty() && now.back().ticks == at.ticks) continue;  // the same capture twice
    // Rows that go back a little are put in order; restarts have been taken out.
    now.push_back({at.ticks, i});
    ++out.edges;
  }
  for (std::size_t r = 0; r < stretches.size(); ++r) {
    std::stable_sort(stretches[r].begin(), stretches[r].end(),
                     [](const EdgeAt& a, const EdgeAt& b) { return a.ticks < b.ticks; });
    const std::vector<EdgeAt> edges =
        told || out.only_falling ? stretches[r] : leading_edges(stretches[r], out.tick_hz, out);
    follow(edges, out.tick_hz, r, out);
  }
  for (TrainSegment& s : out.segments) {
    std::vector<double> intervals;
    for (std::size_t i = 1; i < s.pulses.size(); ++i) {
      const TrainPulse &a = s.pulses[i - 1], &b = s.pulses[i];
      out.missing += static_cast<std::size_t>(b.second - a.second - 1);
      intervals.push_back(static_cast<double>(b.ticks - a.ticks) / static_cast<double>(b.second - a.second));
    }
    s.ticks_per_second = intervals.empty() ? out.tick_hz : median(intervals);
    s.wrap_ticks = difference(s.pulses.front().ticks, stream.pulses[s.pulses.front().index].ticks);
  }
  const auto say = [&](std::size_t count, const std::string& what) {
    if (count > 0) out.words.push_back(fmt::format("{} {}{}", count, what, count > 1 ? "s" : ""));
  };
  if (out.false_edges > 0 || out.missing > 0)
    out.words.push_back(fmt::format("{} of {} edges are false, {} pulses are missing ({:.2g} % in all)",
                                    out.false_edges, out.edges, out.missing,
                                    100.0 * static_cast<double>(out.false_edges + out.missing) /
                                        static_cast<double>(std::max<std::size_t>(out.edges, 1))));
  if (!out.slips_s.empty()) out.words.push_back(fmt::format("the counter's phase slips {} times", out.slips_s.size()));
  say(out.restarts, "restart of the counter");
  say(lost_captures, "capture lost by the device (from its sequence numbers)");
  return out;
}

}  // namespace takt
