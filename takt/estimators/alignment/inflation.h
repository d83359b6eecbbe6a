// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <vector>

#include "takt/estimators/alignment/step_model.h"

/// Why an answer knows less than independent errors would let it: what widens the covariance, as factors of σ.
namespace takt::alignment {

using Normal = Eigen::Matrix<double, unknowns, unknowns>;

/// Share that a step or match keeps of its weight, by its residual in sigmas.
[[nodiscard]] double weight_of(double misfit);

/// A settled fit, step by step.
struct Scores {
  const std::vector<Item>& items;
  const std::vector<Linear>& steps;
  const std::vector<Rows>& whitened;  ///< rows of each step: in itself, robustly weighted, and in time; zero if unused
  const Arma11& errors;
  double scale;    ///< residuals' size in claimed sigmas
  double overlap;  ///< how many items run at the same time
};

/// What whitening has left of correlation in time: Σ over lags of the autocovariance of the unknown's scores.
/// Interleaved chains look at the same scene over overlapping intervals, so what is wrong with it (depths, moving
/// things) is common to `overlap` of them: scores are taken in order of time.
[[nodiscard]] double inflation_by_time(const Scores& s, const Normal& covariance_shape, Unknown unknown);

/// A feature's errors last as long as it is followed: what is wrong with it (a corner that is none, an edge in depth,
/// a patch seen at a slant) goes with the motion and not with the frame. The variance of the unknown's score with whole
/// features as independent clusters [Cameron2015], over what it is with independent steps of residual variance `s2`.
/// `by_match`: Items::by_match.
[[nodiscard]] double inflation_by_feature(const Scores& s, const std::vector<Eigen::Matrix3Xd>& by_match,
                                          const Normal& covariance_shape, Unknown unknown, double s2);

/// Stretches of the recording that scatter about the answer by more than their sigmas say, whatever the cause:
/// √(χ²/degrees of freedom), where that is more than chance gives.
[[nodiscard]] double inflation_by_window(std::span<const WindowOffset> windows);

}  // namespace takt::alignment
