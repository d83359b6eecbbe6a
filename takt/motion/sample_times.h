// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace takt {

/// When samples were taken (seconds after an epoch of the caller's choice), and which of them follow one another
/// without a gap: what all curves through samples share.
class SampleTimes {
 public:
  /// Strictly increasing finite times, at least two (throws std::invalid_argument otherwise).
  /// A gap is a step of more than `gap_factor` times the median step.
  SampleTimes(std::vector<double> times_s, double gap_factor);

  [[nodiscard]] std::size_t size() const { return t_.size(); }
  [[nodiscard]] double operator[](std::size_t i) const { return t_[i]; }
  [[nodiscard]] std::span<const double> all() const { return t_; }
  [[nodiscard]] double begin_s() const { return t_.front(); }
  [[nodiscard]] double end_s() const { return t_.back(); }
  [[nodiscard]] double median_step_s() const { return median_step_; }
  [[nodiscard]] std::size_t gaps() const { return stretch_.back(); }

  /// Whether no gap lies between two samples.
  [[nodiscard]] bool together(std::size_t i, std::size_t j) const { return stretch_[i] == stretch_[j]; }
  /// Whether [t0, t1] lies within the samples and contains no gap.
  [[nodiscard]] bool covers(double t0, double t1) const;
  /// Index j of the sample interval [t_j, t_j+1] that holds t; throws std::out_of_range outside the samples.
  [[nodiscard]] std::size_t interval(double t) const;

  /// Calls visit(first, count) for each stretch of samples without a gap.
  template <class Visit>
  void for_each_stretch(Visit&& visit) const {
    for (std::size_t first = 0, i = 1; i <= size(); ++i)
      if (i == size() || !together(first, i)) visit(first, i - first), first = i;
  }

 private:
  std::vector<double> t_;
  std::vector<std::uint32_t> stretch_;  ///< which gap-free stretch a sample belongs to
  double median_step_ = 0;
};

}  // namespace takt
