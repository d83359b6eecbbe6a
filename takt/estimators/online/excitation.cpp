// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/excitation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace takt::online {

namespace {

constexpr double bin_s = 0.04;
constexpr std::size_t remembered = 50;  ///< bins: two seconds
constexpr std::size_t late = 10;
/// Below these the motion says less of the offset than errors of the model do.
constexpr double least_rate_change = 0.012, least_force_change = 0.15;
constexpr double resting_gyro = 0.006, resting_rate = 0.08, resting_accel = 0.06;
constexpr double axis_memory_s = 30;
constexpr double second_axis_share = 0.01, second_axis_rate = 0.03;

}  // namespace

void Excitation::observe(double t_s, const Reading& r) {
  if (open_.n > 0 && t_s >= open_.start_s + bin_s) {
    open_.gyro /= open_.n, open_.accel /= open_.n;
    close(open_);
    open_ = {};
  }
  if (open_.n == 0) open_.start_s = t_s;
  open_.n += 1, open_.gyro += r.gyro, open_.accel += r.accel;
}

void Excitation::close(const Bin& bin) {
  bins_.push_back(bin);
  if (bins_.size() > remembered) bins_.pop_front();
  const auto spread = [&](std::size_t from, Vec3 Bin::*channel, Vec3& mean) {
    const auto n = static_cast<double>(bins_.size() - from);
    mean.setZero();
    for (std::size_t i = from; i < bins_.size(); ++i) mean += bins_[i].*channel / n;
    double sum = 0;
    for (std::size_t i = from; i < bins_.size(); ++i) sum += (bins_[i].*channel - mean).squaredNorm();
    return sum / n;
  };
  const auto above = [](double squares, double density) {
    return std::sqrt(std::max(0.0, squares - 3 * density * density / bin_s));
  };
  Vec3 mean;
  rate_change_ = above(spread(0, &Bin::gyro, mean), noise_.gyro_density);
  const Vec3 rate_mean = mean;
  force_change_ = above(spread(0, &Bin::accel, mean), noise_.accel_density);
  const std::size_t from = bins_.size() > late ? bins_.size() - late : 0;
  gyro_spread_late_ = above(spread(from, &Bin::gyro, mean), noise_.gyro_density);
  rate_late_ = mean.norm();
  accel_spread_late_ = above(spread(from, &Bin::accel, mean), noise_.accel_density);
  const double keep = std::exp(-bin_s / axis_memory_s);
  const Vec3 turn = bin.gyro - rate_mean;
  turning_ = keep * turning_ + turn * turn.transpose();
  turning_weight_ = keep * turning_weight_ + 1;
}

bool Excitation::observable() const {
  return bins_.size() >= late && (rate_change_ > least_rate_change || force_change_ > least_force_change);
}

bool Excitation::resting() const {
  return bins_.size() >= late && gyro_spread_late_ < resting_gyro && rate_late_ < resting_rate &&
         accel_spread_late_ < resting_accel;
}

bool Excitation::one_axis() const {
  if (turning_weight_ < 100) return false;
  const Mat3 mean = turning_ / turning_weight_;
  const Vec3 power = Eigen::SelfAdjointEigenSolver<Mat3>(mean, Eigen::EigenvaluesOnly).eigenvalues();
  return power[2] > least_rate_change * least_rate_change && power[1] < second_axis_rate * second_axis_rate &&
         power[1] < second_axis_share * power[2];
}

void PictureRest::observe(double t_s, const std::vector<TrackedFeature>& features, std::optional<double> pixel_sigma) {
  constexpr double baseline_s = 0.3;
  Seen now{t_s, features};
  std::ranges::sort(now.features, {}, &TrackedFeature::id);
  while (seen_.size() > 1 && seen_[1].t_s <= t_s - baseline_s) seen_.pop_front();
  resting_ = false;
  if (!seen_.empty() && seen_.front().t_s <= t_s - 0.5 * baseline_s && seen_.front().t_s > t_s - 10 * baseline_s) {
    std::vector<double> squares;
    const auto& before = seen_.front().features;
    for (auto a = before.begin(), b = now.features.cbegin(); a != before.end() && b != now.features.cend();) {
      if (a->id < b->id) {
        ++a;
      } else if (b->id < a->id) {
        ++b;
      } else {
        squares.push_back((a->pixel - b->pixel).squaredNorm());
        ++a, ++b;
      }
    }
    if (squares.size() >= 8) {
      const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
      std::nth_element(squares.begin(), middle, squares.end());
      // The median of a squared distance is 2·ln 2·(2σ²) where only noise moves features.
      const double sigma = pixel_sigma.value_or(0.3);
      const double share = *middle / (2.7726 * sigma * sigma);
      resting_ = share < 1.2 + 2.5 / std::sqrt(static_cast<double>(squares.size()));
    }
  }
  seen_.push_back(std::move(now));
  if (seen_.size() > 64) seen_.pop_front();
}

}  // namespace takt::online
