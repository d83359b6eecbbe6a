// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/gyro_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "takt/math/median.h"
#include "takt/motion/gyro_curve.h"

namespace takt {

namespace {

/// Noise of a gyro without any (rad/s/√Hz): a thousandth of the best there is, so that information stays finite.
constexpr double least_noise_density = 1e-9;

struct UsableSamples {
  Stamp epoch;
  std::vector<double> times_s;  ///< after the epoch, strictly increasing
  std::vector<Vec3> rates;
  std::size_t left_out = 0;
};

UsableSamples usable(const ImuStream& gyro) {
  if (gyro.gyro_rad_s.size() != gyro.size())
    throw std::invalid_argument(
        fmt::format("gyro_rotation: {} has {} stamps but {} rates", gyro.name, gyro.size(), gyro.gyro_rad_s.size()));
  UsableSamples out;
  for (std::size_t i = 0; i < gyro.size(); ++i) {
    if (out.times_s.empty()) out.epoch = gyro.stamps[i];
    const double t = seconds_since(out.epoch, gyro.stamps[i]);
    if (!gyro.gyro_rad_s[i].allFinite() || (!out.times_s.empty() && t <= out.times_s.back())) {
      ++out.left_out;
      continue;
    }
    out.times_s.push_back(t);
    out.rates.push_back(gyro.gyro_rad_s[i]);
  }
  if (out.times_s.size() < 8)
    throw std::invalid_argument(
        fmt::format("gyro_rotation: {} has {} usable samples, 8 are needed", gyro.name, out.times_s.size()));
  return out;
}

/// Power of the three rates together over frequency bins 0..n/2, averaged over half-overlapping Hann windows
/// [Welch1967].
std::vector<double> power_spectrum(const std::vector<Vec3>& rates, std::size_t window) {
  std::vector<double> power(window / 2 + 1, 0.0);
  Eigen::FFT<double> fft;
  std::vector<double> piece(window);
  std::vector<std::complex<double>> spectrum;
  for (std::size_t start = 0; start + window <= rates.size(); start += window / 2) {
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < window; ++i) mean += rates[start + i] / static_cast<double>(window);
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < window; ++i) {
        const double phase = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(window);
        piece[i] = (rates[start + i][axis] - mean[axis]) * 0.5 * (1 - std::cos(phase));
      }
      fft.fwd(spectrum, piece);
      for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(spectrum[k]);
    }
  }
  return power;
}

double bandwidth_hz(const UsableSamples& samples, double step_s) {
  const double nyquist = 0.5 / step_s;
  std::size_t window = 1024;
  while (window > 16 && window > samples.rates.size()) window /= 2;
  if (window > samples.rates.size()) return nyquist;
  const std::vector<double> power = power_spectrum(samples.rates, window);
  // The upper quarter of the spectrum is taken for noise.
  const double floor =
      2 * median(std::vector(power.begin() + static_cast<std::ptrdiff_t>(3 * power.size() / 4), power.end()));
  double total = 0, below = 0;
  for (const double p : power) total += std::max(0.0, p - floor);
  for (std::size_t k = 0; k < power.size(); ++k) {
    below += std::max(0.0, power[k] - floor);
    if (below >= 0.99 * total) return std::max(1.0, static_cast<double>(k)) / (static_cast<double>(window) * step_s);
  }
  return nyquist;
}

/// The same on every machine, which std::uniform_real_distribution does not promise.
double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

}  // namespace

double motion_bandwidth_hz(const ImuStream& gyro) {
  const UsableSamples samples = usable(gyro);
  return bandwidth_hz(samples, GyroCurve(samples.times_s, samples.rates).median_step_s());
}

RotationSignal gyro_rotation(const ImuStream& gyro, const GyroRotationOptions& options) {
  RotationSignal signal;
  signal.name = gyro.name;
  signal.clock = gyro.clock;
  signal.source = "gyro";
  if (gyro.T_body_imu) signal.R_body_sensor = gyro.T_body_imu->topLeftCorner<3, 3>();

  const UsableSamples samples = usable(gyro);
  const GyroCurve curve(samples.times_s, samples.rates);
  const double step_s = curve.median_step_s();
  const double bandwidth = bandwidth_hz(samples, step_s);
  double bin_s = std::clamp(options.fewest_samples * step_s, options.shortest_bin_s, options.longest_bin_s);
  bin_s = std::max(2 * step_s, std::min(bin_s, 1 / (options.bins_per_period * bandwidth)));

  const double density = std::max(curve.noise_density(), least_noise_density);
  std::mt19937_64 random(options.seed);
  const double dither_s = std::min(options.dither_samples * step_s, 0.5 * bin_s);
  const auto bins = static_cast<std::size_t>((curve.end_s() - curve.begin_s()) / bin_s);
  Duration last{};
  for (std::size_t k = 0; k <= bins; ++k) {
    const double nominal = curve.begin_s() + static_cast<double>(k) * bin_s;
    const double edge_s = std::clamp(nominal + dither_s * (uniform(random) - 0.5), curve.begin_s(), curve.end_s());
    // The edge is where its stamp is, to the nanosecond, and not beyond the last sample.
    const Duration edge = std::min(from_seconds(edge_s), Duration(static_cast<std::int64_t>(curve.end_s() * 1e9)));
    const double t0 = to_seconds(last), t1 = to_seconds(edge);
    if (k > 0 && edge > last && curve.covers(t0, t1))
      signal.increments.push_back({samples.epoch + last, samples.epoch + edge, log_so3(curve.between(t0, t1)),
                                   Mat3::Identity() / (density * density * (t1 - t0))});
    last = edge;
  }
  if (samples.left_out > 0)
    signal.notes.push_back(fmt::format("{} of {} samples do not advance in time or are not finite and were left out",
                                       samples.left_out, gyro.size()));
  if (curve.gaps() > 0) signal.notes.push_back(fmt::format("{} gaps in the samples are not bridged", curve.gaps()));
  signal.notes.push_back(
      fmt::format("motion up to {:.3g} Hz, bins of {:.3g} ms with {:.3g} samples, gyro noise "
                  "{:.2g} rad/s/√Hz",
                  bandwidth, bin_s * 1e3, bin_s / step_s, density));
  return signal;
}

}  // namespace takt
