// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

namespace takt {

/// What the variance of one sample would be if noise of the same density at low frequency were white:
///   Σ_k cov(x_i, x_{i+k})
/// A mean of n samples has this over n as its variance, and so does whatever varies slowly against the samples.
/// Low-passed sensor noise is far from white: its sample variance says little about its density.
/// By the autoregressive spectrum at frequency zero; the order, up to `max_order`, is Akaike's [Akaike1974].
/// The mean of x is taken off. Fewer than 10 samples throw std::invalid_argument.
/// Where x are the residuals of a smooth fit, `fitted` are the degrees of freedom that it took from them: it took
/// slow noise, so all covariances over the few lags of interest miss the same fitted/n of the result. They get it back.
[[nodiscard]] double long_run_variance(std::span<const double> x, int max_order = 12, double fitted = 0);

}  // namespace takt
