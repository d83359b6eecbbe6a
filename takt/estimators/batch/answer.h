// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/batch/spline_model.h"

/// From a calibration block to results in words and numbers.
namespace takt::batch {

/// One model's answer in internal units.
struct Found {
  const Calibration& calibration;
  const BorderLayout& layout;
  const Eigen::MatrixXd& covariance;
  const Noise& noise;

  [[nodiscard]] double sigma(int border) const { return border < 0 ? 0 : std::sqrt(covariance(border, border)); }
};

/// Nothing yet, but whose it is.
[[nodiscard]] Estimate blank(const std::string& sensor, const std::string& reference, const std::string& method);

/// Camera `c` against the body: everything with its σ, and in words what is out of the ordinary.
/// `said_drift`: the drift was asked for.
void write_camera(Estimate& e, const Found& f, std::size_t c, const CameraSession& camera, const ImuSession& body,
                  bool said_drift);
/// IMU `m` against the body.
void write_imu(Estimate& e, const Found& f, std::size_t m, const ImuSession& imu, const ImuSession& body);
/// How a camera stands to another one, by both their places on the body.
void write_chain(Estimate& e, const Found& f, std::size_t before, std::size_t c, const std::string& name_before);

/// Stamps that jitter by less are as good as any.
inline constexpr double noted_jitter_s = 2e-5;

}  // namespace takt::batch
