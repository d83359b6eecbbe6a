// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/correlation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/estimators/alignment/rate_grid.h"
#include "takt/math/fourier.h"
#include "takt/math/median.h"

namespace takt::alignment {

namespace {

/// A match worth looking at must rest on this many sensor steps.
constexpr double min_steps = 20;
constexpr std::size_t max_candidates = 12;

/// Log likelihood ratio of "one is the other, turned" against "nothing to do with each other".
struct EvidenceScale {
  double per_pair;  ///< independent numbers that a pair of cells brings
  [[nodiscard]] double operator()(double pairs, double r) const {
    return -0.5 * per_pair * pairs * std::log1p(-std::min(r * r, 1 - 1e-12));
  }
};

struct VectorFit {
  double r = 0;
  Mat3 rotation = Mat3::Identity();
  double pairs = 0;
  double residual = 0;  ///< mean squared misfit of the reference's rate, (rad/s)²
};

/// Correlation of all axes at once under the best rotation, over sensor cells [first, last).
VectorFit vector_fit(const RateGrid& a, const RateGrid& b, std::ptrdiff_t lag, std::size_t first, std::size_t last) {
  Vec3 mean_a = Vec3::Zero(), mean_b = Vec3::Zero();
  Mat3 ab = Mat3::Zero();
  double aa = 0, bb = 0, n = 0;
  const auto size_b = static_cast<std::ptrdiff_t>(b.rate.size());
  for (std::size_t i = first; i < last; ++i) {
    const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(i) + lag;
    if (j < 0 || j >= size_b) continue;
    const auto k = static_cast<std::size_t>(j);
    if (a.valid[i] == 0 || b.valid[k] == 0) continue;
    n += 1;
    mean_a += a.rate[i], mean_b += b.rate[k];
    ab += b.rate[k] * a.rate[i].transpose();
    aa += a.rate[i].squaredNorm(), bb += b.rate[k].squaredNorm();
  }
  VectorFit fit;
  fit.pairs = n;
  if (n < 3) return fit;
  ab -= mean_b * mean_a.transpose() / n;
  aa -= mean_a.squaredNorm() / n, bb -= mean_b.squaredNorm() / n;
  if (!(aa > 0 && bb > 0)) return fit;
  fit.rotation = align_vectors(ab).rotation;
  const double match = (fit.rotation.transpose() * ab).trace();
  fit.r = std::clamp(match / std::sqrt(aa * bb), 0.0, 1.0);
  fit.residual = bb * (1 - fit.r * fit.r) / (3 * n);
  return fit;
}

/// A parabola through three equidistant values: place of its top in steps from the middle one, within ±1.
double parabola_top(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0;
}

/// Local maxima of the evidence, best first, none within a lobe of a better one.
std::vector<std::ptrdiff_t> candidates(const VectorCorrelation& c, const EvidenceScale& evidence, std::ptrdiff_t lobe) {
  std::vector<std::size_t> tops;
  const auto score = [&](std::size_t i) { return evidence(c.pairs[i], c.r[i]); };
  for (std::size_t i = 0; i < c.r.size(); ++i)
    if (c.r[i] > 0 && (i == 0 || c.r[i] >= c.r[i - 1]) && (i + 1 == c.r.size() || c.r[i] > c.r[i + 1]))
      tops.push_back(i);
  const std::size_t keep = std::min<std::size_t>(tops.size(), 400);
  std::partial_sort(tops.begin(), tops.begin() + static_cast<std::ptrdiff_t>(keep), tops.end(),
                    [&](std::size_t x, std::size_t y) { return score(x) > score(y); });
  tops.resize(keep);
  std::vector<std::ptrdiff_t> out;
  for (const std::size_t i : tops) {
    const std::ptrdiff_t lag = c.first_lag + static_cast<std::ptrdiff_t>(i);
    const bool apart = std::none_of(out.begin(), out.end(), [&](std::ptrdiff_t o) { return std::abs(o - lag) < lobe; });
    if (apart) out.push_back(lag);
    if (out.size() == max_candidates) break;
  }
  return out;
}

/// Cells from the top of the sensor's own correlation down to half of it.
std::ptrdiff_t lobe_half_width(const RateGrid& g) {
  const MaskedVectors own{g.rate, g.valid};
  const auto reach = static_cast<std::ptrdiff_t>(std::min<std::size_t>(g.rate.size() - 1, 4000));
  const VectorCorrelation c = vector_correlation(own, own, 0, reach, 3);
  for (std::size_t i = 0; i < c.r.size(); ++i)
    if (c.pairs[i] > 0.5 * c.pairs[0] && c.r[i] < 0.5)
      return std::max<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(i));
  return std::max<std::ptrdiff_t>(1, reach);
}

/// Climbs from a lag to the top of the vector correlation nearby.
Peak refine(const RateGrids& g, std::ptrdiff_t start, std::ptrdiff_t reach, const EvidenceScale& evidence,
            std::ptrdiff_t lowest, std::ptrdiff_t highest) {
  const std::size_t n = g.sensor.rate.size();
  std::ptrdiff_t best = start;
  VectorFit at = vector_fit(g.sensor, g.reference, best, 0, n);
  for (std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, reach / 4); step >= 1; step /= 2) {
    for (bool moved = true; moved;) {
      moved = false;
      for (const std::ptrdiff_t trial : {best - step, best + step}) {
        if (trial < lowest || trial > highest || std::abs(trial - start) > reach) continue;
        const VectorFit f = vector_fit(g.sensor, g.reference, trial, 0, n);
        if (evidence(f.pairs, f.r) <= evidence(at.pairs, at.r)) continue;
        best = trial, at = f, moved = true;
        break;
      }
    }
  }
  const double before = vector_fit(g.sensor, g.reference, best - 1, 0, n).r;
  const double after = vector_fit(g.sensor, g.reference, best + 1, 0, n).r;
  Peak peak;
  peak.offset_s = g.offset_of(static_cast<double>(best) + parabola_top(before, at.r, after));
  peak.r = at.r;
  peak.evidence = evidence(at.pairs, at.r);
  peak.R_reference_sensor = at.rotation;
  return peak;
}

/// σ of the peak's place: misfit over the slope's power, fewer independent samples counted by the misfit's memory.
double peak_sigma(const RateGrids& g, const Peak& peak, double memory) {
  const auto lag = static_cast<std::ptrdiff_t>(std::llround(g.lag_of(peak.offset_s)));
  const VectorFit fit = vector_fit(g.sensor, g.reference, lag, 0, g.sensor.rate.size());
  double slope_power = 0;
  const auto& r = g.reference;
  for (std::size_t i = 0; i < g.sensor.rate.size(); ++i) {
    const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(i) + lag;
    if (j < 1 || j + 1 >= static_cast<std::ptrdiff_t>(r.rate.size())) continue;
    const auto k = static_cast<std::size_t>(j);
    if (g.sensor.valid[i] * r.valid[k - 1] * r.valid[k] * r.valid[k + 1] == 0) continue;
    slope_power += ((r.rate[k + 1] - r.rate[k - 1]) / (2 * g.cell_s)).squaredNorm();
  }
  // The top of a parabola through cells may miss the true one by a good part of a cell, whatever the noise.
  constexpr double parabola_error_cells = 0.4;
  const double noise = slope_power > 0 ? std::sqrt(fit.residual * memory / slope_power) : 0;
  return std::hypot(noise, parabola_error_cells * g.cell_s);
}

void thin_curve(const VectorCorrelation& c, const RateGrids& g, Correlation& out) {
  // Keep the largest of each run, so that no peak is lost.
  const std::size_t run = std::max<std::size_t>(1, c.r.size() / 1500);
  for (std::size_t i = 0; i < c.r.size(); i += run) {
    std::size_t top = i;
    for (std::size_t k = i; k < std::min(i + run, c.r.size()); ++k)
      if (c.r[k] > c.r[top]) top = k;
    out.curve_offset_s.push_back(g.offset_of(static_cast<double>(c.first_lag) + static_cast<double>(top)));
    out.curve_r.push_back(c.r[top]);
  }
}

}  // namespace

Correlation correlate(const Problem& problem, const RateGrids& g, double from_s, double to_s) {
  Correlation out;
  if (g.sensor.rate.size() < 8 || g.reference.rate.size() < 8) {
    out.refusal = "one of the recordings is too short";
    return out;
  }
  const double min_cells = std::max(8.0, min_steps * problem.step_s / g.cell_s);
  // Cells coarser than the steps hold several of them.
  const double min_pairs = std::max(8.0, min_steps * std::min(1.0, problem.step_s / g.cell_s));
  const double size_a = static_cast<double>(g.sensor.rate.size()),
               size_b = static_cast<double>(g.reference.rate.size());
  const double least = -size_a + min_cells, most = size_b - min_cells;
  const auto lowest = static_cast<std::ptrdiff_t>(std::ceil(std::max(least, g.lag_of(from_s))));
  const auto highest = static_cast<std::ptrdiff_t>(std::floor(std::min(most, g.lag_of(to_s))));
  if (lowest > highest) {
    out.refusal = "the streams do not overlap for any offset in the search range";
    return out;
  }
  out.searched_from_s = g.offset_of(static_cast<double>(lowest));
  out.searched_to_s = g.offset_of(static_cast<double>(highest));

  const VectorCorrelation c = vector_correlation({g.sensor.rate, g.sensor.valid}, {g.reference.rate, g.reference.valid},
                                                 lowest, highest, min_pairs);
  const EvidenceScale evidence{c.axes / c.memory};
  thin_curve(c, g, out);
  const std::ptrdiff_t lobe = lobe_half_width(g.sensor);
  out.lobe_s = static_cast<double>(lobe) * g.cell_s;
  for (const std::ptrdiff_t lag : candidates(c, evidence, 2 * lobe)) {
    const Peak peak = refine(g, lag, lobe, evidence, lowest, highest);
    const bool apart = std::none_of(out.peaks.begin(), out.peaks.end(),
                                    [&](const Peak& p) { return std::abs(p.offset_s - peak.offset_s) < out.lobe_s; });
    if (apart) out.peaks.push_back(peak);
  }
  std::stable_sort(out.peaks.begin(), out.peaks.end(),
                   [](const Peak& x, const Peak& y) { return x.evidence > y.evidence; });
  if (out.peaks.empty()) {
    out.refusal = "the two rates have no likeness at any offset searched";
    return out;
  }
  const double independent_lags = std::max(1.0, static_cast<double>(highest - lowest + 1) / static_cast<double>(lobe));
  // The rotation is fitted too: three more numbers with which chance can help itself.
  out.significance = std::log(1e6 * independent_lags) + 3;
  for (Peak& p : out.peaks) p.sigma_s = peak_sigma(g, p, c.memory);
  out.rival_margin = std::numeric_limits<double>::infinity();
  if (out.peaks.size() > 1) {
    const Peak &best = out.peaks[0], &rival = out.peaks[1];
    const auto pairs_at = [&](const Peak& p) {
      const auto i = static_cast<std::ptrdiff_t>(std::llround(g.lag_of(p.offset_s))) - c.first_lag;
      return c.pairs[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, std::ssize(c.pairs) - 1))];
    };
    const double shorter = std::min(pairs_at(best), pairs_at(rival));
    // A rival that stands out by itself may be a motion that repeats: it is held against the same amount of data. One
    // that chance explains, a second of overlap with anything, is held against all that speaks for the best.
    const bool by_chance = rival.evidence < out.significance;
    out.rival_margin =
        by_chance ? best.evidence - rival.evidence : evidence(shorter, best.r) - evidence(shorter, rival.r);
  }
  return out;
}

Coarse follow_drift(const Problem& problem, const RateGrids& g, const Correlation& correlation) {
  const Peak& peak = correlation.peaks.front();
  const auto peak_lag = static_cast<std::ptrdiff_t>(std::llround(g.lag_of(peak.offset_s)));
  const auto lobe = std::max<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(correlation.lobe_s / g.cell_s));

  // Windows long enough to know their own offset, and at most some dozens of them.
  const std::size_t n = g.sensor.rate.size();
  const auto least = static_cast<std::size_t>(std::max(min_steps * problem.step_s, 20 * correlation.lobe_s) / g.cell_s);
  const std::size_t window = std::max<std::size_t>({least, n / 24, 8});
  double filled = 0;
  for (const double v : g.sensor.valid) filled += v / static_cast<double>(n);
  struct Window {
    double t, offset, weight;
  };
  std::vector<Window> windows;
  // Crystals differ by up to 300 ppm or so: the search in a window must reach what that makes of half the recording.
  const auto reach = lobe + static_cast<std::ptrdiff_t>(3e-4 * static_cast<double>(n) / 2);
  for (std::size_t first = 0; first + window <= n; first += window) {
    double best = 0;
    std::ptrdiff_t at = peak_lag;
    for (std::ptrdiff_t lag = peak_lag - reach; lag <= peak_lag + reach; ++lag) {
      const VectorFit f = vector_fit(g.sensor, g.reference, lag, first, first + window);
      if (f.pairs < 0.5 * filled * static_cast<double>(window)) continue;
      if (f.r > best) best = f.r, at = lag;
    }
    if (best < 0.3) continue;
    const double before = vector_fit(g.sensor, g.reference, at - 1, first, first + window).r;
    const double after = vector_fit(g.sensor, g.reference, at + 1, first, first + window).r;
    windows.push_back({g.sensor.centre_s(first + window / 2),
                       g.offset_of(static_cast<double>(at) + parabola_top(before, best, after)), best * best});
  }

  Coarse coarse;
  coarse.R_reference_sensor = peak.R_reference_sensor;
  coarse.lobe_s = correlation.lobe_s;
  coarse.centre_s = 0.5 * (problem.steps.front().t0 + problem.steps.back().t1);
  coarse.offset_s = peak.offset_s;
  if (windows.size() < 5) return coarse;

  // Theil–Sen: a third of the windows may be wrong.
  std::vector<double> slopes;
  for (std::size_t i = 0; i < windows.size(); ++i)
    for (std::size_t j = i + 1; j < windows.size(); ++j)
      slopes.push_back((windows[j].offset - windows[i].offset) / (windows[j].t - windows[i].t));
  const double slope = median(slopes);
  std::vector<double> at_centre, spread;
  for (const Window& w : windows) at_centre.push_back(w.offset - slope * (w.t - coarse.centre_s));
  const double offset = median(at_centre);
  for (const Window& w : windows) spread.push_back(std::abs(w.offset - offset - slope * (w.t - coarse.centre_s)));
  const double noise = 1.4826 * median(spread);
  const double length = windows.back().t - windows.front().t;
  // Only a drift that moves the ends by more than the windows scatter is worth starting from.
  if (std::abs(slope) * length > 2 * noise && std::abs(slope) < 2e-3) {
    coarse.drift = slope;
    coarse.offset_s = offset;
  }
  return coarse;
}

}  // namespace takt::alignment
