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
/// Share of a window that both sides must have measured.
constexpr double least_valid = 0.8;

/// The two rates on the sensor's grid, in the sensor's frame, the reference moved by the coarse offset.
struct Pair {
  Vec3 sensor = Vec3::Zero(), reference = Vec3::Zero();
  bool valid = false;
};
std::vector<Pair> paired(const Problem& p, const Coarse& start, double cell_s) {
  const RateGrid sensor = sensor_grid(p, cell_s);
  const Mat3 to_sensor = start.R_reference_sensor.transpose();
  std::vector<Pair> out(sensor.rate.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double t = sensor.centre_s(i);
    const double at = t + start.offset_s + start.drift * (t - start.centre_s);
    const double half = 0.5 * cell_s;
    out[i].valid = sensor.valid[i] > 0 && p.reference.covers(at - half, at + half);
    if (!out[i].valid) continue;
    out[i].sensor = sensor.rate[i];
    out[i].reference = to_sensor * (log_so3(p.reference.between(at - half, at + half)) / cell_s);
  }
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
  double segments = 0, missing = 0;
  for (std::size_t first = 0; first + length <= pairs.size(); first += length / 2) {
    const auto valid = static_cast<double>(std::count_if(pairs.begin() + static_cast<std::ptrdiff_t>(first),
                                                         pairs.begin() + static_cast<std::ptrdiff_t>(first + length),
                                                         [](const Pair& p) { return p.valid; }));
    // Cells where either side is missing count as no motion of either: the phase stays what it is.
    if (valid < least_valid * static_cast<double>(length)) continue;
    segments += 1;
    missing += 1 - valid / static_cast<double>(length);
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> s(length), r(length);
      double mean_s = 0, mean_r = 0;
      for (std::size_t i = 0; i < length; ++i) {
        mean_s += pairs[first + i].sensor[axis] / valid;
        mean_r += pairs[first + i].reference[axis] / valid;
      }
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

  // Half-overlapped Hann segments count for about 0.55 independent ones each; the three axes of a
  // hand's motion carry little more than one.
  const double averages = 0.55 * segments * 1.5;
  double weight_sum = 0, slope_sum = 0;
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
  }
  if (weight_sum <= 0) return fit;
  const double residual = slope_sum / weight_sum;
  // A Hann window spreads a line over 1.5 bins and a half to either side: neighbouring phases are not independent.
  // A hole spreads all lines further still.
  const double sigma = std::sqrt(2.5 / weight_sum) * (1 + 20 * missing / segments);
  if (std::abs(residual) > 3 * start.lobe_s + 1e-3) return fit;
  fit.answered = true;
  fit.offset_s = start.offset_s + residual;
  fit.sigma_s = sigma;
  return fit;
}

}  // namespace takt::alignment
