// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/answer.h"

#include <fmt/core.h>

#include <cmath>

#include "takt/calibration/words.h"

namespace takt::batch {

namespace {

constexpr double plausible_drift = 5e-4;

void add_triple(Estimate& e, const char* pattern, const Vec3& value, const Found& f, int border) {
  for (int i = 0; i < 3; ++i)
    e.extras.push_back({fmt::format(fmt::runtime(pattern), "xyz"[i]), value[i], f.sigma(border + i)});
}

void write_pose(Estimate& e, const Rigid& T, const Found& f, int rotation, int translation) {
  e.T_reference_sensor = T.matrix();
  add_triple(e, "rotation_{}_rad", log_so3(T.rotation), f, rotation);
  add_triple(e, "translation_{}_m", T.translation, f, translation);
}

/// Offset and drift of a camera or an IMU against the body.
template <class Link, class Place, class Session>
void write_clock(Estimate& e, const Found& f, const Link& link, const Place& at, const Session& sensor,
                 const ImuSession& body) {
  e.offset = (body.epoch - sensor.epoch) + from_seconds(link.offset_s);
  e.sigma_s = f.sigma(at.offset);
  e.epoch = sensor.epoch + from_seconds(link.centre_s);
  e.drift = link.drift;
  if (at.drift >= 0) e.drift_sigma = f.sigma(at.drift);
}

void write_own(Estimate& e, const Found& f, std::size_t m) {
  const ImuLink& imu = f.calibration.imus[m];
  const BorderLayout::Imu& at = f.layout.imus[m];
  const auto middle = imu.bias.at(imu.bias.begin_s + 0.5 * imu.bias.knots.duration_s());
  const int bias_at = at.bias + 6 * (middle.first + 1);  // the control point that acts most
  add_triple(e, "gyro_bias_{}_rad_s", imu.bias.gyro(middle), f, bias_at);
  add_triple(e, "accel_bias_{}_m_s2", imu.bias.accel(middle), f, bias_at + 3);
  e.extras.push_back({"gyro_noise_rad_s_sqrthz", f.noise.imus[m].gyro, std::nullopt});
  e.extras.push_back({"accel_noise_m_s2_sqrthz", f.noise.imus[m].accel, std::nullopt});
  if (at.matrices >= 0) {
    int next = at.matrices;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        e.extras.push_back(
            {fmt::format("gyro_matrix_{}{}", row, column), imu.gyro_matrix(row, column), f.sigma(next++)});
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column <= row; ++column)
        e.extras.push_back(
            {fmt::format("accel_matrix_{}{}", row, column), imu.accel_matrix(row, column), f.sigma(next++)});
  }
  if (at.response >= 0) {
    e.extras.push_back({"gyro_bend_s2", imu.gyro_bend_s2, f.sigma(at.response)});
    e.extras.push_back({"accel_bend_s2", imu.accel_bend_s2, f.sigma(at.response + 1)});
    e.extras.push_back({"accel_lag_s", imu.accel_lag_s, f.sigma(at.response + 2)});
  }
}

void say_drift(Estimate& e, double drift, double sigma, bool said) {
  if (drift != 0 && !said)
    e.reasons.push_back(
        fmt::format("the clocks drift by {:.2f} ± {:.2f} ppm, which is part of the answer", 1e6 * drift, 1e6 * sigma));
  if (std::abs(drift) > plausible_drift)
    e.doubt(Verdict::weak, fmt::format("a drift of {:.0f} ppm is more than two crystals can differ by", 1e6 * drift));
}

void say_rows(Estimate& e, const CameraLink& link, double sigma, const FrameTiming& timing) {
  if (link.line_delay_s == 0 || timing.shutter == Shutter::rolling) return;
  e.reasons.push_back(
      fmt::format("a rolling shutter: each row is read {:.3f} ± {:.3f} µs after the one above, and the "
                  "offset is for the {} row{}",
                  1e6 * link.line_delay_s, 1e6 * sigma, *e.frame_row,
                  timing.shutter == Shutter::global ? ", though the recording says that the shutter is global" : ""));
}

}  // namespace

Estimate blank(const std::string& sensor, const std::string& reference, const std::string& method) {
  Estimate e;
  e.method = method;
  e.sensor = sensor;
  e.reference = reference;
  e.verdict = Verdict::trusted;
  return e;
}

void write_camera(Estimate& e, const Found& f, std::size_t c, const CameraSession& camera, const ImuSession& body,
                  bool said_drift) {
  const CameraLink& link = f.calibration.cameras[c];
  const BorderLayout::Camera& at = f.layout.cameras[c];
  write_clock(e, f, link, at, camera, body);
  e.line_delay_s = link.line_delay_s;
  if (at.line_delay >= 0) e.line_delay_sigma_s = f.sigma(at.line_delay);
  write_pose(e, link.T_imu_cam, f, at.rotation, at.translation);
  add_triple(e, "gravity_board_{}_m_s2", f.calibration.gravity_board, f, f.layout.gravity);
  e.extras.push_back({"board_scale", f.calibration.board_scale, f.sigma(f.layout.board_scale)});
  write_own(e, f, 0);
  const CameraNoise& noise = f.noise.cameras[c];
  e.extras.push_back({"corner_noise_px", noise.corner_px, std::nullopt});

  say_drift(e, link.drift, f.sigma(at.drift), said_drift);
  if (at.line_delay >= 0) say_rows(e, link, f.sigma(at.line_delay), camera.stream->timing);
  if (noise.jitter_s > 0) {
    e.extras.push_back({"stamp_jitter_s", noise.jitter_s, std::nullopt});
    if (noise.jitter_s > noted_jitter_s)
      e.reasons.push_back(fmt::format("the frames' stamps jitter by {} (σ), which is part of the model",
                                      rounded_time_words(noise.jitter_s)));
  }
}

void write_imu(Estimate& e, const Found& f, std::size_t m, const ImuSession& imu, const ImuSession& body) {
  const ImuLink& link = f.calibration.imus[m];
  const BorderLayout::Imu& at = f.layout.imus[m];
  write_clock(e, f, link, at, imu, body);
  write_pose(e, link.T_body_imu, f, at.rotation, at.translation);
  write_own(e, f, m);
  say_drift(e, link.drift, f.sigma(at.drift), false);
}

void write_chain(Estimate& e, const Found& f, std::size_t before, std::size_t c, const std::string& name_before) {
  const CameraLink &a = f.calibration.cameras[before], &b = f.calibration.cameras[c];
  const BorderLayout::Camera &at_a = f.layout.cameras[before], &at_b = f.layout.cameras[c];
  const Rigid T = b.T_imu_cam.inverse() * a.T_imu_cam;
  // Change of T's translation and turn on its left; both cameras' rotations are perturbed on the right, their places in
  // the body's frame.
  const Mat3 R_b = b.T_imu_cam.rotation.conjugate().toRotationMatrix(), R = T.rotation.toRotationMatrix();
  Eigen::Matrix<double, 6, Eigen::Dynamic> j = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, f.covariance.rows());
  j.block<3, 3>(0, at_a.translation) = R_b;
  j.block<3, 3>(0, at_b.translation) = -R_b;
  j.block<3, 3>(0, at_b.rotation) = hat(T.translation);
  j.block<3, 3>(3, at_a.rotation) = R;
  j.block<3, 3>(3, at_b.rotation) = -Mat3::Identity();
  const Eigen::Matrix<double, 6, 1> sigma = (j * f.covariance * j.transpose()).diagonal().cwiseSqrt();
  const Vec3 turn = log_so3(T.rotation);
  for (int i = 0; i < 3; ++i)
    e.extras.push_back({fmt::format("chain_{}_rotation_{}_rad", name_before, "xyz"[i]), turn[i], sigma[3 + i]});
  for (int i = 0; i < 3; ++i)
    e.extras.push_back({fmt::format("chain_{}_translation_{}_m", name_before, "xyz"[i]), T.translation[i], sigma[i]});
  const double variance = f.covariance(at_a.offset, at_a.offset) + f.covariance(at_b.offset, at_b.offset) -
                          2 * f.covariance(at_a.offset, at_b.offset);
  e.extras.push_back(
      {fmt::format("offset_sigma_against_{}_s", name_before), std::sqrt(std::max(0.0, variance)), std::nullopt});
}

}  // namespace takt::batch
