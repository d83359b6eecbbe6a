// SPDX-License-Identifier: Apache-2.0
// What a solved spline model can be asked.
#include <cmath>

#include "takt/estimators/batch/spline_model.h"

namespace takt::batch {

Residuals SplineModel::residuals() const {
  Residuals out;
  out.cameras.resize(cameras_.size());
  out.imus.resize(imus_.size());
  for (const Span& span : samples_) {
    const ImuCurve& curve = imus_[span.imu]->curve;
    const ImuLink& link = calibration_.imus[span.imu];
    ImuResiduals& to = out.imus[span.imu];
    for (std::size_t s = span.first; s < span.last; ++s) {
      const double t = curve.times_s()[s];
      const BiasCurve::Place bias = link.bias.at(t);
      const Felt felt = reading(link, link.body_time(t) - begin_s_);
      to.t.push_back(t);
      to.gyro.push_back(felt.rate + link.bias.gyro(bias) - curve.gyro()[s]);
      to.accel.push_back(felt.force + link.bias.accel(bias) - curve.accel()[s]);
    }
  }
  const Weights w = weights();
  for (const SplineFrame& f : frames_) {
    CameraResiduals& to = out.cameras[f.camera];
    const TimeScore s = time_score(f);
    to.frame_t.push_back(f.time_s);
    to.frame_rms_px.push_back(std::sqrt(s.squares / (2 * f.corners)));
    const double information = std::max(1e-30, s.information);
    to.frame_late_s.push_back(f.late_s - s.gradient / information);
    to.frame_late_sigma_s.push_back(1 / std::sqrt(w[f.camera] * information));
    add_corner_residuals(f, to);
  }
  return out;
}

std::vector<WindowOffset> SplineModel::window_offsets(std::size_t camera, int windows) const {
  BorderLayout layout = layout_;
  // Offsets in a row, at the end of the border; a drift would only blur them.
  layout.windows = windows;
  layout.windowed = static_cast<int>(camera);
  layout.cameras[camera].offset = layout.size;
  layout.size += windows;
  // The old offset's place and the drift's are held by a prior that nothing moves.
  Sums sums;
  ArrowSystem system = normal_equations(weights(), layout, sums);
  using One = Eigen::Matrix<double, 1, 1>;
  const auto hold = [&](int border) {
    if (border < 0) return;
    const ArrowSystem::Block block[] = {{band_size() + border, 1}};
    system.accumulate(block, One(1e30), One(0));
  };
  hold(layout_.cameras[camera].offset);
  hold(layout_.cameras[camera].drift);
  const ArrowSystem::Solution solution = std::move(system).solve();
  std::vector<WindowOffset> out;
  if (!solution.ok()) return out;
  std::vector<double> sum(static_cast<std::size_t>(windows)), count = sum;
  for (const SplineFrame& f : frames_) {
    if (f.camera != camera) continue;
    const auto at = static_cast<std::size_t>(window_of(f, windows));
    sum[at] += f.time_s;
    count[at] += 1;
  }
  for (int i = 0; i < windows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (count[at] < 5) continue;
    const int border = layout.cameras[camera].offset + i;
    out.push_back({sum[at] / count[at], calibration_.cameras[camera].offset_s + solution.step()[band_size() + border],
                   std::sqrt(solution.border_covariance()(border, border))});
  }
  return out;
}

std::vector<ImuEvidence> SplineModel::imu_evidence() const {
  std::vector<ImuEvidence> out(imus_.size());
  Freedom all = free_;
  all.matrices.assign(imus_.size(), true);
  all.response.assign(imus_.size(), true);
  const BorderLayout layout = lay_out(all);
  Sums ignored;
  const ArrowSystem::Solution solution = normal_equations(weights(), layout, ignored).solve();
  if (!solution.ok()) return out;
  const auto chi2 = [&](int at, int size, const Eigen::VectorXd& now) {
    const Eigen::VectorXd found = now + solution.step().segment(band_size() + at, size);
    return found.dot(solution.border_covariance().block(at, at, size, size).ldlt().solve(found));
  };
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    Eigen::VectorXd matrices(BorderLayout::matrices_size);
    const Mat3 gyro = calibration_.imus[m].gyro_matrix - Mat3::Identity(),
               accel = calibration_.imus[m].accel_matrix - Mat3::Identity();
    matrices << gyro.row(0).transpose(), gyro.row(1).transpose(), gyro.row(2).transpose(), accel(0, 0), accel(1, 0),
        accel(1, 1), accel(2, 0), accel(2, 1), accel(2, 2);
    out[m].matrices = chi2(layout.imus[m].matrices, BorderLayout::matrices_size, matrices);
    out[m].response = chi2(layout.imus[m].response, BorderLayout::response_size, response_of(calibration_.imus[m]));
  }
  return out;
}

}  // namespace takt::batch
