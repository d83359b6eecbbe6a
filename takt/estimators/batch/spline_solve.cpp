// SPDX-License-Identifier: Apache-2.0
// How the spline model is solved: Gauss–Newton, and between its rounds the noise, the jitter and what IMUs ask for.
#include <algorithm>
#include <cmath>

#include "takt/estimators/batch/spline_model.h"

namespace takt::batch {

namespace {

constexpr int most_iterations = 20, most_rounds = 8;
/// Steps this small against what is known are the end.
constexpr double settled = 5e-3;
constexpr double small_change = 0.02, large_change = 0.3;
/// Where stamps jitter and that is not modelled yet, the large residuals slow Gauss–Newton down: no reason to wait.
constexpr double roughly_settled = 0.3;
constexpr int rough_iterations = 4;

}  // namespace

double SplineModel::log_determinant() const {
  Sums ignored;
  const ArrowSystem::Solution solution = normal_equations(weights(), layout_, ignored).solve();
  return solution.ok() ? solution.log_determinant() : 0;
}

bool SplineModel::within_reach() const {
  return std::ranges::all_of(frames_, [&](const SplineFrame& f) {
    const CameraLink& link = calibration_.cameras[f.camera];
    return knots_.contains(link.imu_time(f.time_s, f.bands.front().mean_row) + f.late_s - begin_s_) &&
           knots_.contains(link.imu_time(f.time_s, f.bands.back().mean_row) + f.late_s - begin_s_);
  });
}

void SplineModel::move(const Eigen::VectorXd& step) {
  const int n = knots_.control_points();
  Eigen::Matrix3Xd turns(3, n);
  for (int i = 0; i < n; ++i) {
    turns.col(i) = step.segment<3>(knot_size * i);
    position_.control_point(i) += step.segment<3>(knot_size * i + 3);
  }
  rotation_.retract(turns);
  retract(calibration_, layout_, step.tail(layout_.size));
  const bool lags = std::ranges::any_of(calibration_.imus, [](const ImuLink& i) { return i.accel_lag_s != 0; });
  if (imus_.size() > 1 || lags) take_samples();  // their times have moved against the knots
}

bool SplineModel::settle() {
  return iterate(settled, most_iterations);
}

bool SplineModel::iterate(double enough, int most) {
  for (int round = 0; round < most; ++round) {
    Sums sums;
    const ArrowSystem::Solution solution = normal_equations(weights(), layout_, sums).solve();
    if (!solution.ok()) {
      failure_ = "the motion does not determine the calibration";
      return false;
    }
    if (!solution.step().allFinite()) {
      failure_ = "the fit did not settle";
      return false;
    }
    move(solution.step());
    if (!within_reach()) {
      failure_ = "the fit left the recording: camera and IMU contradict each other";
      return false;
    }
    if (any_jitter()) settle_lateness();
    covariance_ = solution.border_covariance();
    const double moved =
        solution.step().tail(layout_.size).cwiseQuotient(covariance_.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
    if (moved < enough) return true;
  }
  if (most < most_iterations) return true;
  failure_ = "the fit did not settle";
  return false;
}

/// Returns the largest relative change.
double SplineModel::measure_noise() {
  constexpr double nudge = 1e-3;
  Sums sums;
  const Weights w = weights();
  const ArrowSystem::Solution at = normal_equations(w, layout_, sums).solve();
  if (!at.ok()) return 0;
  std::vector<double> factor(sorts());
  double not_taken = band_size() + layout_.size;
  for (std::size_t g = 0; g < sorts(); ++g) {
    double taken = not_taken;  // what the last sort has is what the others left
    if (g + 1 < sorts()) {
      Weights nudged = w;
      nudged[g] *= 1 + nudge;
      Sums ignored;
      const ArrowSystem::Solution moved = normal_equations(nudged, layout_, ignored).solve();
      if (!moved.ok()) return 0;
      taken = (moved.log_determinant() - at.log_determinant()) / std::log1p(nudge);
    }
    not_taken -= taken;
    factor[g] = std::sqrt(w[g] * sums.squares[g] / std::max(0.03 * sums.count[g], sums.count[g] - taken));
  }
  double largest = 0;
  for (const double f : factor) largest = std::max(largest, std::abs(f - 1));
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    CameraNoise& noise = noise_.cameras[c];
    if (noise.jitter_s > 0) largest = std::max(largest, measure_jitter(c, at.log_determinant()));
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) noise_.cameras[c].corner_px *= factor[c];
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    noise_.imus[m].gyro *= factor[gyro_sort(m)];
    noise_.imus[m].accel *= factor[gyro_sort(m) + 1];
  }
  return largest;
}

/// An IMU whose residuals say that it is not what its data sheet says gets what they ask for, the clearer first.
bool SplineModel::free_imus() {
  Sums sums;
  const Weights w = weights();
  (void)normal_equations(w, layout_, sums);
  // As long as noise and jitter are not measured, residuals may be large for other reasons.
  double dispersion = 1;
  for (std::size_t g = 0; g < sorts(); ++g) dispersion = std::max(dispersion, w[g] * sums.squares[g] / sums.count[g]);
  const std::vector<ImuEvidence> asks = imu_evidence();
  bool freed = false;
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    const double matrices = asks[m].matrices / dispersion / ImuEvidence::clear_matrices,
                 response = asks[m].response / dispersion / ImuEvidence::clear_response;
    if (!free_.matrices[m] && matrices > 1 && (free_.response[m] || matrices > response))
      free_.matrices[m] = freed = true;
    else if (!free_.response[m] && response > 1)
      free_.response[m] = freed = true;
  }
  layout_ = lay_out(free_);
  return freed;
}

bool SplineModel::solve() {
  failure_.clear();
  if (!iterate(roughly_settled, rough_iterations)) return false;
  for (int round = 0; round < 2 && options_.find_imus && free_imus(); ++round)
    if (!iterate(roughly_settled, rough_iterations)) return false;
  find_jitter();
  for (int round = 0; round < most_rounds; ++round) {
    if (!settle()) return false;
    if (round > 0 && find_jitter()) continue;
    const double changed = measure_noise();
    if (changed < small_change) return true;
    if (changed < large_change && !any_jitter() && !find_jitter()) return settle();
  }
  return true;
}

void SplineModel::fix_line_delay(std::size_t camera) {
  free_.line_delay[camera] = false;
  calibration_.cameras[camera].line_delay_s = 0;
  layout_ = lay_out(free_);
}

void SplineModel::fix_camera_drift(std::size_t camera) {
  free_.camera_drift[camera] = false;
  calibration_.cameras[camera].drift = 0;
  layout_ = lay_out(free_);
}

void SplineModel::fix_imu_drift(std::size_t imu) {
  free_.imu_drift[imu] = false;
  calibration_.imus[imu].drift = 0;
  layout_ = lay_out(free_);
}

void SplineModel::free_matrices(std::size_t imu) {
  free_.matrices[imu] = true;
  layout_ = lay_out(free_);
}

}  // namespace takt::batch
