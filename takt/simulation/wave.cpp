// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/wave.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace takt {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double envelope_knot_s = 3;
/// ∫ B(x)² dx of the quintic B-spline: the mean square of an envelope through unit white values.
constexpr double quintic_mean_square = 655177.0 / 1663200.0;
/// ∫ B'(x)² dx, from the degree-9 spline's values at its knots: 2·(156190 − 88234)/9!.
constexpr double quintic_slope_mean_square = 2 * (156190.0 - 88234.0) / 362880.0;
/// Values are uniform in ±√3, so no envelope exceeds this.
const double envelope_bound = std::sqrt(3 / quintic_mean_square);

/// The six quintic B-splines that are not zero at fraction u ∈ [0, 1) of a knot interval.
template <int Order>
std::array<double, Order> basis(double u) {
  // Cox–de Boor on uniform knots, from the constant upward.
  std::array<double, Order> b{};
  b[0] = 1;
  for (int p = 1; p < Order; ++p) {
    double carried = 0;
    for (int i = 0; i < p; ++i) {
      const double right = (i + 1 - u) / p, left = (p - 1 - i + u) / p;
      const double part = b[static_cast<std::size_t>(i)];
      b[static_cast<std::size_t>(i)] = carried + right * part;
      carried = left * part;
    }
    b[static_cast<std::size_t>(p)] = carried;
  }
  return b;
}

/// Weights of the six random values for an envelope and its first two derivatives.
struct EnvelopeWeights {
  std::int64_t first;
  std::array<std::array<double, 6>, 3> w{};
};

EnvelopeWeights envelope_weights(double t_s) {
  const double x = t_s / envelope_knot_s;
  const double whole = std::floor(x), u = x - whole;
  EnvelopeWeights out;
  out.first = static_cast<std::int64_t>(whole);
  out.w[0] = basis<6>(u);
  const auto quartic = basis<5>(u);
  const auto cubic = basis<4>(u);
  const auto at = [](const auto& b, std::size_t i) { return i < b.size() ? b[i] : 0.0; };
  for (std::size_t i = 0; i < 6; ++i) {
    // The derivative of a uniform B-spline is the difference of two of the order below.
    out.w[1][i] = ((i > 0 ? at(quartic, i - 1) : 0) - at(quartic, i)) / envelope_knot_s;
    out.w[2][i] = ((i > 1 ? at(cubic, i - 2) : 0) - 2 * (i > 0 ? at(cubic, i - 1) : 0) + at(cubic, i)) /
                  (envelope_knot_s * envelope_knot_s);
  }
  return out;
}

}  // namespace

Wave::Wave(const Band& band, const Mat3& shape, Random random) {
  if (band.rms == 0) return;
  if (!(band.rms > 0) || !(band.low_hz > 0) || !(band.high_hz >= band.low_hz) || band.tones < 1)
    throw std::invalid_argument("Wave: needs rms ≥ 0, 0 < low ≤ high and a tone; got rms " + std::to_string(band.rms) +
                                ", " + std::to_string(band.low_hz) + " to " + std::to_string(band.high_hz) + " Hz, " +
                                std::to_string(band.tones) + " tones");
  const bool single = band.tones == 1;
  double square = 0;
  for (int k = 0; k < band.tones; ++k) {
    const double f = band.low_hz + (band.high_hz - band.low_hz) * (k + random.uniform()) / band.tones;
    Tone tone;
    tone.omega = 2 * pi * f;
    tone.phase = random.uniform(0, 2 * pi);
    const Vec3 direction = Vec3(random.normal(), random.normal(), random.normal()).normalized();
    tone.amplitude = shape * direction;
    if (single) tone.amplitude.normalize();
    tone.envelope_seed = single ? 0 : random.bits();
    // Hands and vehicles shake less the faster: the rate's spectrum falls off smoothly.
    const double corner = 0.4 * band.high_hz;
    tone.amplitude *= 1 / (tone.omega * (1 + f * f / (corner * corner)));
    const double envelope_rate2 =
        single ? 0 : quintic_slope_mean_square / quintic_mean_square / (envelope_knot_s * envelope_knot_s);
    square += 0.5 * tone.amplitude.squaredNorm() * (tone.omega * tone.omega + envelope_rate2);
    tones_.push_back(tone);
  }
  const double scale = band.rms / std::sqrt(square);
  for (Tone& tone : tones_) tone.amplitude *= scale;
}

std::array<Vec3, 3> Wave::at(double t_s) const {
  std::array<Vec3, 3> out{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  if (tones_.empty()) return out;
  const EnvelopeWeights weights = envelope_weights(t_s);
  for (const Tone& tone : tones_) {
    std::array<double, 3> e{1, 0, 0};
    if (tone.envelope_seed != 0) {
      e = {0, 0, 0};
      for (std::size_t i = 0; i < 6; ++i) {
        const std::uint64_t knot = static_cast<std::uint64_t>(weights.first) + i;
        const double u = static_cast<double>(mix64(tone.envelope_seed + knot) >> 11) * 0x1p-53;
        const double value = (2 * u - 1) * envelope_bound;
        for (std::size_t d = 0; d < 3; ++d) e[d] += value * weights.w[d][i];
      }
    }
    const double s = std::sin(tone.omega * t_s + tone.phase), c = std::cos(tone.omega * t_s + tone.phase);
    const double w = tone.omega;
    out[0] += e[0] * s * tone.amplitude;
    out[1] += (e[1] * s + e[0] * w * c) * tone.amplitude;
    out[2] += (e[2] * s + 2 * e[1] * w * c - e[0] * w * w * s) * tone.amplitude;
  }
  return out;
}

Vec3 Wave::bound() const {
  Vec3 sum = Vec3::Zero();
  for (const Tone& tone : tones_) sum += (tone.envelope_seed ? envelope_bound : 1.0) * tone.amplitude.cwiseAbs();
  return sum;
}

}  // namespace takt
