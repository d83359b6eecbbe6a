// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "takt/motion/rotation.h"

namespace takt::online {

/// What an IMU measured, as a function of time.
struct Reading {
  Vec3 gyro = Vec3::Zero();   ///< rad/s
  Vec3 accel = Vec3::Zero();  ///< m/s²
};

/// The recent past of an IMU in seconds after its epoch. Between samples readings follow a cubic through the samples on
/// both sides (slopes by central differences), so that integrals are right to fourth order in the sampling interval.
class ImuHistory {
 public:
  /// Times must increase.
  void add(double t_s, const Reading& reading);
  /// Drops samples that no time at or after `t_s` needs.
  void forget_before(double t_s);
  void clear() { samples_.clear(), first_ = 0; }

  [[nodiscard]] bool empty() const { return first_ == samples_.size(); }
  [[nodiscard]] std::size_t size() const { return samples_.size() - first_; }
  [[nodiscard]] double begin_s() const { return samples_[first_].t; }
  [[nodiscard]] double end_s() const { return samples_.back().t; }
  /// The longest interval without a sample that [t0, t1] touches; infinite where it leaves the samples.
  [[nodiscard]] double longest_gap_s(double t0, double t1) const;

  /// Needs begin_s() ≤ t ≤ end_s().
  [[nodiscard]] Reading at(double t) const;
  /// Mean reading over [t − half, t + half], cut to the samples.
  [[nodiscard]] Reading mean(double t, double half_s) const;

  /// Calls visit(h, first, second) for each piece of [t0, t1] between samples: its length and the readings at its two
  /// Gauss points, h·(1/2 ∓ √3/6) after its start.
  template <class Visit>
  void walk(double t0, double t1, const Visit& visit) const {
    std::size_t j = interval(t0);
    while (t0 < t1) {
      const bool last = j + 2 >= samples_.size();
      const double end = last ? t1 : std::min(t1, samples_[j + 1].t);
      const double h = end - t0;
      if (h > 0) visit(h, within(j, t0 + (0.5 - gauss) * h), within(j, t0 + (0.5 + gauss) * h));
      t0 = end;
      if (!last) ++j;
    }
  }

  /// All samples, oldest first.
  template <class Visit>
  void each(const Visit& visit) const {
    for (std::size_t i = first_; i < samples_.size(); ++i) visit(samples_[i].t, samples_[i].reading);
  }

  static constexpr double gauss = 0.28867513459481288;  ///< √3/6

 private:
  struct Sample {
    double t;
    Reading reading;
  };
  [[nodiscard]] std::size_t interval(double t) const;
  [[nodiscard]] Reading within(std::size_t j, double t) const;

  std::vector<Sample> samples_;
  std::size_t first_ = 0;
};

}  // namespace takt::online
