// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/phase.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "takt/estimators/alignment/rate_grid.h"
#include "takt/math/fourier.h"

namespace takt::alignment {

namespace {

using Complex = std::complex<double>;
constexpr double pi = std::numbers::pi;

/// The share of a segment that may be missing.
constexpr double missing_at_most = 0.1;

/// Both rates on one even grid, in the sensor's frame, the reference moved by the coarse offset.
struct Pair {
  Vec3 sensor, reference;
  bool valid;
};

/// The reference is taken over the sensor's own steps, and both are put on the grid in the same way.
std::vector<Pair> paired(const Problem& p, const Coarse& start, double cell_s) {
  const Mat3 to_sensor = start.R_reference_sensor.transpose();
  const auto moved = [&](double t) { return t + start.offset_s + start.drift * (t - start.centre_s); };
  std::vector<Step> sensor, reference;
  for (const Step& s : p.steps) {
    const double t0 = moved(s.t0), t1 = moved(s.t1);
    if (!p.reference.covers(t0, t1)) continue;
    sensor.push_back(s);
    reference.push_back(s);
    reference.back().apparent = to_sensor * log_so3(p.reference.between(t0, t1));
  }
  const double begin = p.steps.front().t0, end = p.steps.back().t1;
  const RateGrid a = spread_grid(sensor, begin, end, cell_s), b = spread_grid(reference, begin, end, cell_s);
  std::vector<Pair> out(a.rate.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = {a.rate[i], b.rate[i], a.valid[i] > 0};
  return out;
}

}  // namespace

PhaseFit fit_phase(const Problem& problem, const Coarse& start) {
  PhaseFit fit;
  // Cells as long as the sensor's steps: both sides are then means over the same length, and no phase is left of that.
  const double cell = problem.step_s;
  const std::vector<Pair> pairs = paired(problem, start, cell);

  // Welch: half-overlapping Hann windows of some 12 s, fewer where the recording is short.
  const auto wish = static_cast<std::size_t>(12 / cell);
  std::size_t length = next_power_of_two(std::min(wish, pairs.size() / 3));
  if (length > 1 && length > pairs.size() / 2) length /= 2;
  if (length < 16) return fit;
  const std::size_t bins = length / 2 + 1;
  std::vector<Complex> cross(bins);
  std::vector<double> power_s(bins), power_r(bins);
  double segments = 0;
  for (std::size_t first = 0; first + length <= pairs.size(); first += length / 2) {
    double valid = 0;
    for (std::size_t i = 0; i < length; ++i) valid += pairs[first + i].valid ? 1 : 0;
    if (valid < (1 - missing_at_most) * static_cast<double>(length)) continue;
    segments += 1;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> s(length), r(length);
      double mean_s = 0, mean_r = 0;
      for (std::size_t i = 0; i < length; ++i) {
        if (!pairs[first + i].valid) continue;
        mean_s += pairs[first + i].sensor[axis] / valid;
        mean_r += pairs[first + i].reference[axis] / valid;
      }
      // What is missing is missing from both, so it costs coherence and no phase.
      for (std::size_t i = 0; i < length; ++i) {
        if (!pairs[first + i].valid) continue;
        const double hann = 0.5 - 0.5 * std::cos(2 * pi * (static_cast<double>(i) + 0.5) / static_cast<double>(length));
        s[i] = hann * (pairs[first + i].sensor[axis] - mean_s);
        r[i] = hann * (pairs[first + i].reference[axis] - mean_r);
      }
      const auto fs = spectrum(s, length), fr = spectrum(r, length);
      for (std::size_t k = 0; k < bins; ++k) {
        cross[k] += std::conj(fs[k]) * fr[k];
        power_s[k] += std::norm(fs[k]);
        power_r[k] += std::norm(fr[k]);
      }
    }
  }
  if (segments < 2) return fit;

  // Half-overlapped Hann segments count for about 0.55 independent ones each; the three axes rarely carry more than
  // two.
  const double averages = 0.55 * segments * 2;
  double weight_sum = 0, slope_sum = 0, phase_squares = 0, used = 0;
  // The residual offset is small, so the phase 2πf·x stays within ±π where the coherence is worth anything.
  for (std::size_t k = 1; k + 1 < bins; ++k) {
    const double f = static_cast<double>(k) / (static_cast<double>(length) * cell);
    const double coherence = power_s[k] > 0 && power_r[k] > 0 ? std::norm(cross[k]) / (power_s[k] * power_r[k]) : 0;
    // The reference runs ahead by x: r(t) = s(t + x)… in our sense s at t equals r at t + x, so its phase is −2πf·x.
    const double phase = std::arg(cross[k]);
    fit.frequency_hz.push_back(f);
    fit.coherence.push_back(coherence);
    fit.phase_rad.push_back(phase);
    // Below this an average of so few segments shows coherence by chance.
    const double chance = 1 - std::pow(0.05, 1 / std::max(1.0, averages - 1));
    if (coherence < std::max(0.3, chance)) continue;
    const double variance = (1 - coherence) / (2 * averages * coherence) + 1e-9;
    const double omega = 2 * pi * f;
    weight_sum += omega * omega / variance;
    slope_sum += -omega * phase / variance;
    phase_squares += phase * phase / variance, used += 1;
  }
  if (weight_sum <= 0) return fit;
  const double residual = slope_sum / weight_sum;
  // A Hann window spreads a line over about 1.5 bins: neighbouring phases are not independent. Phases that scatter
  // about the line by more than their coherences say make it less certain.
  const double chi2 = std::max(0.0, phase_squares - residual * slope_sum) / std::max(1.0, used / 1.5 - 1);
  const double sigma = std::sqrt(1.5 / weight_sum * std::max(1.0, chi2 / 1.5));
  if (std::abs(residual) > 3 * start.lobe_s + 1e-3) return fit;
  fit.answered = true;
  fit.offset_s = start.offset_s + residual;
  fit.sigma_s = sigma;
  return fit;
}

}  // namespace takt::alignment
