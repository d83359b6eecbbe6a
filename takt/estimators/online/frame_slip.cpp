// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/frame_slip.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace takt::online {

namespace {

constexpr std::size_t fewest_points = 8;
/// How well dead reckoning carries a pose from one frame to the next (rad, m).
constexpr double turn_sigma = 1e-4, shift_sigma = 1e-3;
constexpr double huber = 2;

}  // namespace

void FrameSlip::add(const Observed& seen, const Eigen::Matrix<double, 6, 1>& pose_per_s, double pixel_sigma,
                    const Mat3& point) {
  const Eigen::Matrix2d of_point = seen.landmark * point * seen.landmark.transpose();
  const Eigen::Matrix2d variance = of_point + pixel_sigma * pixel_sigma * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d whiten = variance.llt().matrixL().solve(Eigen::Matrix2d::Identity());
  Row row;
  row.by.col(0) = whiten * (seen.pose * pose_per_s);
  row.by.rightCols<6>() = whiten * seen.pose;
  row.residual = whiten * seen.residual;
  if (!row.by.allFinite() || !row.residual.allFinite()) return;
  rows_.push_back(row);
  shared_ += of_point.trace() / variance.trace();
}

double FrameSlip::sigmas(double time_sigma_s) const {
  if (rows_.size() < fewest_points) return 0;
  using Mat7 = Eigen::Matrix<double, 7, 7>;
  using Vec7 = Eigen::Matrix<double, 7, 1>;
  Vec7 x = Vec7::Zero();
  Mat7 covariance;
  // Huber's weights, from least squares on: a step moves all points, a stranger moves alone.
  for (int round = 0; round < 4; ++round) {
    Mat7 A = Mat7::Zero();
    A.diagonal().segment<3>(1).setConstant(1 / (turn_sigma * turn_sigma));
    A.diagonal().segment<3>(4).setConstant(1 / (shift_sigma * shift_sigma));
    Vec7 b = Vec7::Zero();
    for (const Row& row : rows_) {
      const double length = (row.residual + row.by * x).norm();
      const double weight = round > 0 && length > huber ? huber / length : 1;
      A += weight * row.by.transpose() * row.by;
      b -= weight * row.by.transpose() * row.residual;
    }
    A(0, 0) += 1e-9 * (1 + A(0, 0));
    const Eigen::LDLT<Mat7> ldlt(A);
    x = ldlt.solve(b);
    covariance = ldlt.solve(Mat7::Identity());
  }
  if (!(covariance(0, 0) > 0)) return 0;
  return x[0] / std::hypot(std::sqrt(covariance(0, 0)), time_sigma_s);
}

}  // namespace takt::online
