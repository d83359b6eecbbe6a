// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/sample_clock.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "takt/math/median.h"

namespace takt {

namespace {

/// Marks relative to the first one, so that doubles keep the nanosecond.
struct Point {
  double x = 0;  // samples
  double y = 0;  // ns
};

double robust_sigma(std::vector<double> deviations) {
  for (double& d : deviations) d = std::abs(d);
  return 1.4826 * median_of_pair(std::move(deviations));
}

struct Line {
  double at0 = 0, slope = 0;
  [[nodiscard]] double operator()(double x) const { return at0 + slope * x; }
};

std::vector<double> residuals(std::span<const Point> points, const Line& line) {
  std::vector<double> r;
  for (const Point& p : points) r.push_back(p.y - line(p.x));
  return r;
}

/// Slopes between marks half the span apart, their median (a cheap kin of [Theil1950, Sen1968]), as a start that a
/// quarter of bad marks cannot spoil.
Line first_guess(std::span<const Point> points, double nominal_slope) {
  std::vector<double> slopes;
  const std::size_t half = (points.size() + 1) / 2;
  for (std::size_t i = 0; i + half < points.size(); ++i)
    if (const double dx = points[i + half].x - points[i].x; dx > 0)
      slopes.push_back((points[i + half].y - points[i].y) / dx);
  Line line{0, slopes.empty() ? nominal_slope : median_of_pair(std::move(slopes))};
  if (!(line.slope > 0)) line.slope = nominal_slope;  // clocks run forward
  line.at0 = median_of_pair(residuals(points, line));
  return line;
}

/// Least squares with [Huber1964] weights, at 1.345 robust standard deviations.
Line refined(std::span<const Point> points, Line line) {
  if (points.size() < 3) return line;
  for (int round = 0; round < 20; ++round) {
    const std::vector<double> r = residuals(points, line);
    const double limit = std::max(1.345 * robust_sigma(r), 1.0);
    double w = 0, wx = 0, wy = 0;
    std::vector<double> weights;
    for (std::size_t i = 0; i < points.size(); ++i) {
      weights.push_back(std::abs(r[i]) <= limit ? 1 : limit / std::abs(r[i]));
      w += weights[i];
      wx += weights[i] * points[i].x;
      wy += weights[i] * points[i].y;
    }
    const double mx = wx / w, my = wy / w;
    double xx = 0, xy = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      xx += weights[i] * (points[i].x - mx) * (points[i].x - mx);
      xy += weights[i] * (points[i].x - mx) * (points[i].y - my);
    }
    if (!(xx > 0) || !(xy > 0)) break;
    const Line next{my - xy / xx * mx, xy / xx};
    const double moved = std::max(std::abs(next(points.front().x) - line(points.front().x)),
                                  std::abs(next(points.back().x) - line(points.back().x)));
    line = next;
    if (moved < 0.5) break;
  }
  return line;
}

/// Where the marks on both sides lie on levels that differ by more than their scatter allows, the largest such step.
/// At least three marks on each side must agree: fewer are outliers. 0: no step.
std::size_t find_step(std::span<const Point> points, const Line& line, double tolerance_ns) {
  constexpr std::size_t needed = 3, window = 8;
  if (points.size() < 2 * needed) return 0;
  const std::vector<double> r = residuals(points, line);
  std::vector<double> changes;
  for (std::size_t i = 1; i < r.size(); ++i) changes.push_back(r[i] - r[i - 1]);
  double largest = std::max(tolerance_ns, 8 * robust_sigma(changes));
  std::size_t step = 0;
  for (std::size_t i = needed; i + needed <= r.size(); ++i) {
    const auto part = [&r](std::size_t from, std::size_t to) {
      return std::vector<double>(r.begin() + static_cast<std::ptrdiff_t>(from),
                                 r.begin() + static_cast<std::ptrdiff_t>(to));
    };
    const double before = median_of_pair(part(i - std::min(i, window), i));
    const double after = median_of_pair(part(i, std::min(i + window, r.size())));
    if (const double size = std::abs(after - before); size > largest) {
      largest = size;
      step = i;
    }
  }
  return step;
}

}  // namespace

SampleClock::SampleClock(const std::vector<BlockMark>& marks, double nominal_period_ns, double tolerance_ns) {
  if (marks.empty()) throw std::invalid_argument("SampleClock: no marks");
  if (!(nominal_period_ns > 0)) throw std::invalid_argument("SampleClock: the nominal period must be positive");
  epoch_ns_ = marks.front().time_ns;

  // Ranges of marks still to be fitted, last one first. A counter that runs backward has started again.
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  std::size_t end = marks.size();
  for (std::size_t i = marks.size(); i-- > 0;)
    if (i == 0 || marks[i].sample <= marks[i - 1].sample) {
      ranges.emplace_back(i, end);
      end = i;
    }

  while (!ranges.empty()) {
    const auto [first, last] = ranges.back();
    ranges.pop_back();
    std::vector<Point> points;
    for (std::size_t i = first; i < last; ++i)
      points.push_back({static_cast<double>(marks[i].sample - marks[first].sample),
                        static_cast<double>(marks[i].time_ns - epoch_ns_)});
    const Line line = refined(points, first_guess(points, nominal_period_ns));
    if (const std::size_t step = find_step(points, line, tolerance_ns); step > 0) {
      ranges.emplace_back(first + step, last);
      ranges.emplace_back(first, first + step);
      continue;
    }
    Piece piece{first, marks[first].sample, line.at0, line.slope, 0, 0};
    const std::vector<double> r = residuals(points, line);
    const double limit = std::max(4 * robust_sigma(r), 1.0);
    double squares = 0;
    for (const double v : r) {
      if (std::abs(v) > limit)
        ++piece.outliers;
      else
        squares += v * v;
    }
    piece.residual_rms_ns =
        std::sqrt(squares / static_cast<double>(std::max<std::size_t>(r.size() - piece.outliers, 1)));
    pieces_.push_back(piece);
  }
}

std::int64_t SampleClock::time_ns(std::size_t mark, std::int64_t sample) const {
  const auto after = std::upper_bound(pieces_.begin(), pieces_.end(), mark,
                                      [](std::size_t m, const Piece& p) { return m < p.first_mark; });
  const Piece& p = *std::prev(after);
  const double since_epoch = p.origin_ns + p.period_ns * static_cast<double>(sample - p.origin_sample);
  return epoch_ns_ + std::llround(std::clamp(since_epoch, -2e18, 2e18));
}

}  // namespace takt
