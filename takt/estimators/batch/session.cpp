// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/session.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "takt/math/median.h"
#include "takt/motion/trajectory.h"

namespace takt::batch {

namespace {

/// σ of white noise from sixth differences, which a motion well below the Nyquist rate hardly enters:
/// Σ binomial(6,k)² = 924.
double noise_of(std::span<const Vec3> y) {
  static constexpr std::array<double, 7> weights{1, -6, 15, -20, 15, -6, 1};
  std::vector<double> magnitudes;
  const std::size_t stride = std::max<std::size_t>(1, y.size() / 3000);
  for (std::size_t i = 0; i + 6 < y.size(); i += stride) {
    Vec3 d = Vec3::Zero();
    for (std::size_t k = 0; k < 7; ++k) d += weights[k] * y[i + k];
    for (int axis = 0; axis < 3; ++axis) magnitudes.push_back(std::abs(d[axis]));
  }
  return magnitudes.empty() ? 0 : 1.4826 * median(std::move(magnitudes)) / std::sqrt(924.0);
}

double typical_length(std::span<const Vec3> accel) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < accel.size(); i += std::max<std::size_t>(1, accel.size() / 4000))
    lengths.push_back(accel[i].norm());
  return median(std::move(lengths));
}

}  // namespace

CameraSession open_camera(const CornerStream& s, int threads) {
  if (s.corners.size() != s.size() || (!s.exposures_s.empty() && s.exposures_s.size() != s.size()))
    throw std::invalid_argument("calibrate: " + s.name + " has " + std::to_string(s.size()) + " stamps for " +
                                std::to_string(s.corners.size()) + " frames and " +
                                std::to_string(s.exposures_s.size()) + " exposures");
  if (!s.model) throw std::invalid_argument("calibrate: " + s.name + " has no camera model");
  CameraSession out;
  out.stream = &s;
  if (s.size() == 0) return out;
  out.epoch = s.stamps.front();
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (i > 0 && !(s.stamps[i] > s.stamps[i - 1]))
      throw std::invalid_argument("calibrate: frame " + std::to_string(i) + " of " + s.name +
                                  " is not later than the one before");
    const double exposure = s.exposures_s.empty() ? s.timing.exposure_s : s.exposures_s[i];
    out.time_s.push_back(to_seconds(s.stamps[i] - out.epoch) + s.timing.to_exposure_middle_s(exposure));
  }
  if (s.timing.row == RowReference::middle) {
    const int rows = s.timing.rows > 0 ? s.timing.rows : s.model->height;
    out.reference_row = 0.5 * (rows - 1);
  }
  out.poses = find_board_poses(s, threads);
  return out;
}

ImuSession open_imu(const ImuStream& s) {
  if (s.gyro_rad_s.size() != s.size() || s.accel_m_s2.size() != s.size() || s.size() < 8)
    throw std::invalid_argument("calibrate: " + s.name + " has " + std::to_string(s.size()) + " stamps, " +
                                std::to_string(s.gyro_rad_s.size()) + " rates and " +
                                std::to_string(s.accel_m_s2.size()) + " specific forces");
  const Stamp epoch = s.stamps.front();
  std::vector<double> times;
  times.reserve(s.size());
  for (const Stamp t : s.stamps) times.push_back(to_seconds(t - epoch));
  std::vector<Vec3> accel = s.accel_m_s2;
  double typical = typical_length(accel);
  const bool in_g = typical > 0.7 && typical < 1.5;
  if (in_g) {
    for (Vec3& a : accel) a *= gravity_world().norm();
    typical *= gravity_world().norm();
  }
  ImuSession out{&s, epoch, ImuCurve(std::move(times), s.gyro_rad_s, std::move(accel)), 0, {}, in_g, typical};
  out.rate_hz = 1 / out.curve.median_step_s();
  const double root = std::sqrt(out.curve.median_step_s());
  out.high_pass = {std::max(1e-9, noise_of(out.curve.gyro())) * root,
                   std::max(1e-8, noise_of(out.curve.accel())) * root};
  return out;
}

}  // namespace takt::batch
