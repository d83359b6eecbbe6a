// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/bound_hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt {

namespace {

__extension__ typedef __int128 Wide;  // int64 nanoseconds times int64 nanoseconds

/// > 0 where c lies left of (above) the line from a to b.
Wide turn(const Bound& a, const Bound& b, const Bound& c) {
  return Wide{b.s_ns - a.s_ns} * Wide{c.o_ns - a.o_ns} - Wide{c.s_ns - a.s_ns} * Wide{b.o_ns - a.o_ns};
}

long double slope(const Bound& a, const Bound& b) {
  return static_cast<long double>(b.o_ns - a.o_ns) / static_cast<long double>(b.s_ns - a.s_ns);
}

/// How far a line of this slope through the hull's touching corner is from zero at `origin`.
long double intercept(const BoundHull& hull, long double drift, std::int64_t origin_ns) {
  const Bound& b = hull.corners()[hull.touched(drift)];
  return static_cast<long double>(b.o_ns) - drift * static_cast<long double>(b.s_ns - origin_ns);
}

std::vector<long double> slopes_of(const BoundHull& lower, const BoundHull& upper) {
  std::vector<long double> out;
  for (const BoundHull* hull : {&lower, &upper})
    for (std::size_t i = 1; i < hull->corners().size(); ++i)
      out.push_back(slope(hull->corners()[i - 1], hull->corners()[i]));
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

void BoundHull::add(Bound b) {
  if (count_ == 0) first_ = b.s_ns;
  ++count_;
  sum_ += b.s_ns - first_;
  const bool upper = side_ == Side::upper_bounds;
  if (!corners_.empty() && corners_.back().s_ns == b.s_ns) {
    const bool tighter = upper ? b.o_ns < corners_.back().o_ns : b.o_ns > corners_.back().o_ns;
    if (!tighter) return;
    corners_.pop_back();
  }
  while (corners_.size() >= 2) {
    const Wide t = turn(corners_[corners_.size() - 2], corners_.back(), b);
    if (upper ? t > 0 : t < 0) break;
    corners_.pop_back();
  }
  corners_.push_back(b);
}

void BoundHull::clear() {
  corners_.clear();
  count_ = 0;
  sum_ = 0;
}

std::int64_t BoundHull::mean_s_ns() const {
  return count_ == 0 ? 0 : first_ + static_cast<std::int64_t>(sum_ / static_cast<Wide>(count_));
}

std::size_t BoundHull::touched(long double drift) const {
  // Along a lower hull the edges' slopes rise, along an upper hull they fall.
  std::size_t low = 0, high = corners_.size() - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    const long double s = slope(corners_[middle], corners_[middle + 1]);
    const bool beyond = side_ == Side::upper_bounds ? s < drift : s > drift;
    if (beyond)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

std::size_t BoundHull::edge_over(std::int64_t s_ns) const {
  const auto after = std::upper_bound(corners_.begin(), corners_.end(), s_ns,
                                      [](std::int64_t s, const Bound& b) { return s < b.s_ns; });
  const auto index = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - corners_.begin() - 1));
  return std::min(index, corners_.size() < 2 ? 0 : corners_.size() - 2);
}

std::optional<OffsetLine> line_under(const BoundHull& upper) {
  if (upper.corners().size() < 2) return std::nullopt;
  const std::int64_t mean = upper.mean_s_ns();
  const std::size_t i = upper.edge_over(mean);
  const Bound &a = upper.corners()[i], &b = upper.corners()[i + 1];
  OffsetLine line;
  line.epoch_ns = mean;
  line.drift = slope(a, b);
  line.offset_ns = static_cast<long double>(a.o_ns) + line.drift * static_cast<long double>(mean - a.s_ns);
  return line;
}

std::optional<GapLine> line_between(const BoundHull& lower, const BoundHull& upper) {
  if (lower.empty() || upper.empty()) return std::nullopt;
  const std::vector<long double> slopes = slopes_of(lower, upper);
  if (slopes.empty()) return std::nullopt;
  const std::int64_t origin = upper.mean_s_ns();
  const auto gap = [&](long double a) { return intercept(upper, a, origin) - intercept(lower, a, origin); };
  // The gap is concave in the slope and bends only at the hulls' edges.
  std::size_t low = 0, high = slopes.size() - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (gap(slopes[middle]) < gap(slopes[middle + 1]))
      low = middle + 1;
    else
      high = middle;
  }
  // Where the top is flat all its slopes are as good: take their middle.
  const long double best = gap(slopes[low]);
  std::size_t last = low;
  while (last + 1 < slopes.size() && gap(slopes[last + 1]) >= best) ++last;
  GapLine out;
  out.line.epoch_ns = origin;
  out.line.drift = 0.5L * (slopes[low] + slopes[last]);
  out.gap_ns = gap(out.line.drift);
  out.line.offset_ns = 0.5L * (intercept(upper, out.line.drift, origin) + intercept(lower, out.line.drift, origin));
  return out;
}

std::optional<LikelyLine> likely_line(const BoundHull& lower, const BoundHull& upper, double mean_round_trip_ns,
                                      double usual_drift) {
  const auto best = line_between(lower, upper);
  if (!best || best->gap_ns < 0) return std::nullopt;
  const auto n = static_cast<double>(upper.size());
  const std::int64_t origin = best->line.epoch_ns;
  // Exponential delays of unknown mean above an unknown least one: integrated over both, and over lines of this slope,
  // the likelihood is the mean excess of the round trips over the gap to the power of −(2n − 2).
  const double excess = std::max(mean_round_trip_ns - static_cast<double>(best->gap_ns), 1.0);
  const auto log_weight = [&](long double a) {
    const auto fall = static_cast<double>(best->gap_ns - (intercept(upper, a, origin) - intercept(lower, a, origin)));
    const double relative = static_cast<double>(a) / usual_drift;
    return -(2 * n - 2) * std::log1p(fall / excess) - 2 * std::log1p(relative * relative / 3);
  };
  // The likeliest slope lies between the widest gap's and zero.
  long double near = 0, far = best->line.drift;
  for (int i = 0; i < 100; ++i) {
    const long double third = (far - near) / 3;
    (log_weight(near + third) < log_weight(far - third) ? near : far) +=
        log_weight(near + third) < log_weight(far - third) ? third : -third;
  }
  const long double mode = 0.5L * (near + far);
  const double top = log_weight(mode);
  const auto reach = [&](long double direction) {
    long double step = 1e-14L;
    while (step < 0.1L && log_weight(mode + direction * step) > top - 15) step *= 1.5L;
    return mode + direction * step;
  };
  const long double from = reach(-1), to = reach(+1);
  constexpr int steps = 400;
  long double weights = 0, drift = 0, offset = 0, drift2 = 0, offset2 = 0;
  double highest = top;
  for (int i = 0; i <= steps; ++i) highest = std::max(highest, log_weight(from + (to - from) * i / steps));
  for (int i = 0; i <= steps; ++i) {
    const long double a = from + (to - from) * i / steps;
    const long double w = std::exp(log_weight(a) - highest);
    const long double da = a - best->line.drift;
    const long double middle =
        0.5L * (intercept(upper, a, origin) + intercept(lower, a, origin)) - best->line.offset_ns;
    weights += w, drift += w * da, offset += w * middle, drift2 += w * da * da, offset2 += w * middle * middle;
  }
  drift /= weights, offset /= weights, drift2 /= weights, offset2 /= weights;
  LikelyLine out;
  out.gap_ns = best->gap_ns;
  out.line = {origin, best->line.offset_ns + offset, best->line.drift + drift};
  out.drift_sigma = static_cast<double>(std::sqrt(std::max(drift2 - drift * drift, 0.0L)));
  // Across the gap the same likelihood falls by a power from its middle: of that the variance.
  const double across = n > 2 ? excess * excess / (2 * (2 * n - 3) * (2 * n - 4)) : excess * excess;
  out.offset_sigma_ns = std::sqrt(static_cast<double>(std::max(offset2 - offset * offset, 0.0L)) + across);
  return out;
}

std::optional<OffsetBounds> bounds_at(const BoundHull& lower, const BoundHull& upper, std::int64_t s_ns,
                                      long double slack_ns) {
  const auto best = line_between(lower, upper);
  if (!best || best->gap_ns + 2 * slack_ns < 0) return std::nullopt;
  const auto gap = [&](long double a) { return intercept(upper, a, s_ns) - intercept(lower, a, s_ns) + 2 * slack_ns; };
  // Slopes from `least` to `most` fit: the gap is concave, so each end is found by halving, and kept on the far side.
  const auto end = [&](long double direction) {
    long double inside = best->line.drift, step = 1e-9L;
    while (gap(inside + direction * step) >= 0 && step < 1) step *= 2;
    long double outside = inside + direction * step;
    for (int i = 0; i < 70; ++i) {
      const long double middle = 0.5L * (inside + outside);
      (gap(middle) >= 0 ? inside : outside) = middle;
    }
    return outside;
  };
  const long double least = end(-1), most = end(+1);
  OffsetBounds out;
  // At s the upper envelope is concave in the slope; its top is the hull's edge over s, if that slope fits.
  const auto clamped = [&](const BoundHull& hull) {
    if (hull.corners().size() < 2) return 0.5L * (least + most);
    const std::size_t i = hull.edge_over(s_ns);
    return std::clamp(slope(hull.corners()[i], hull.corners()[i + 1]), least, most);
  };
  // Before the first or after the last corner the steepest slopes are the extremes.
  const auto extreme = [&](const BoundHull& hull, int sign) {
    long double found = -std::numeric_limits<long double>::infinity();
    for (const long double a : {least, most, clamped(hull)}) found = std::max(found, sign * intercept(hull, a, s_ns));
    return sign * found;
  };
  out.upper_ns = extreme(upper, 1) + slack_ns;
  out.lower_ns = extreme(lower, -1) - slack_ns;
  return out;
}

}  // namespace takt
