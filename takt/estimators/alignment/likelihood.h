// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/estimators/alignment/problem.h"
#include "takt/math/arma.h"

namespace takt::alignment {

struct LikelihoodOptions {
  bool bearings = false;  ///< compare the bearings of pairs; else the steps' (apparent) rotations
  bool drift = true;
  bool readout = false;  ///< estimate the time from the first row to the last, from bearings
  double readout_start_s = 0;
  /// What is known of it beforehand (s). σ 0: it is known, up to what translation makes of it.
  double readout_prior_s = 0, readout_prior_sigma_s = 0.1;
  double log_focal = 0;  ///< log of the true focal length over the one that the bearings were made with
};

/// Offset in one stretch of the recording, everything else as found over the whole.
struct WindowOffset {
  double centre_s;  ///< sensor seconds
  double offset_s;  ///< relative to the fit's offset and drift there
  double sigma_s;
};

/// Maximum likelihood in continuous time: the gyro, integrated between the (shifted) instants of each pair of frames,
/// predicts the sensor's rotation increment; the residuals are the increments' rotation errors, or, where there are
/// bearings, the matches' own errors with the translation eliminated.
/// Their correlation from step to step is measured (ARMA(1,1)) and whitened, so that noise which belongs to a frame and
/// not to an interval is used as such, and their remaining variance scales the covariance.
struct LikelihoodFit {
  double offset_s = 0;  ///< internal, at `centre_s`
  double drift = 0;
  double centre_s = 0;  ///< sensor seconds where offset and drift are uncorrelated
  Mat3 R_reference_sensor = Mat3::Identity();
  Vec3 gyro_bias = Vec3::Zero();
  double readout_s = 0;

  double offset_sigma_s = 0, drift_sigma = 0, readout_sigma_s = 0;
  Vec3 rotation_sigma = Vec3::Zero();  ///< rad, about the reference's axes
  bool converged = false;
  int iterations = 0;
  std::size_t used = 0;       ///< steps whose interval the reference covers
  double explained = 0;       ///< R²: share of the sensor's rotation that the gyro predicts
  double misfit = 0;          ///< rms residual over what the sensor and the gyro claim of themselves
  double relative_error = 0;  ///< rms error beyond those claims, as a share of the turn
  double outliers = 0;        ///< share of the steps beyond 4σ
  double inflation = 1;       ///< how much remaining correlation in time and scatter from window to window widened σ
  double log_likelihood = 0;  ///< of the rotation errors, up to a constant
  Arma11 errors;

  std::vector<double> residual_t_s;  ///< thinned
  std::vector<Vec3> residual_rad;
  std::vector<WindowOffset> windows;
  WindowOffset halves[2] = {};
};

[[nodiscard]] LikelihoodFit maximise_likelihood(const Problem& problem, const Coarse& start,
                                                const LikelihoodOptions& options);

}  // namespace takt::alignment
