// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace takt {

/// Errors that remember one step: u_t = ar·u_{t−1} + e_t + ma·e_{t−1}, e white with unit variance.
/// Rotation increments between frames have ma < 0 (the noise of a frame enters two increments with opposite signs);
/// a slow misfit of the model has ar > 0.
struct Arma11 {
  double ar = 0;
  double ma = 0;

  /// Variance of u in units of e's.
  [[nodiscard]] double variance() const { return (1 + 2 * ar * ma + ma * ma) / (1 - ar * ar); }
};

/// Turns a series with Arma11 errors into one with white unit errors, exactly from the first sample on
/// (innovations algorithm, [Brockwell1991] §5.3). Linear, so residuals and Jacobian columns go through alike.
/// T is double or a fixed-size Eigen vector or matrix.
template <class T>
class Whitener {
 public:
  explicit Whitener(const Arma11& model) : model_(model) {}

  /// Forget the past: the next sample is the first of a new stretch.
  void restart() { first_ = true; }

  [[nodiscard]] T operator()(const T& u) {
    if (first_) {
      variance_ = model_.variance();
      innovation_ = u;
      first_ = false;
    } else {
      const T predicted = model_.ar * last_ + (model_.ma / variance_) * innovation_;
      variance_ = 1 + model_.ma * model_.ma * (1 - 1 / variance_);
      innovation_ = u - predicted;
    }
    last_ = u;
    return innovation_ / std::sqrt(variance_);
  }
  /// Variance of the sample just whitened, given the past; for the likelihood.
  [[nodiscard]] double step_variance() const { return variance_; }

 private:
  Arma11 model_;
  bool first_ = true;
  double variance_ = 1;
  T last_{};
  T innovation_{};
};

/// Maximum-likelihood fit to stretches of (roughly zero-mean) residuals of whatever variance.
/// Fewer than 30 samples give the white model.
[[nodiscard]] Arma11 fit_arma11(std::span<const std::vector<double>> stretches);

}  // namespace takt
