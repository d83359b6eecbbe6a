// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "takt/simulation/random.h"

namespace takt {

Mat4 SimulatedCamera::default_mount() {
  Mat3 along_x;  // camera x right = −y of the body, camera y down = −z, camera z ahead = x
  along_x << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Mat4 T = Mat4::Identity();
  T.topLeftCorner<3, 3>() = along_x * exp_so3(Vec3(0.05, -0.08, 0.03)).toRotationMatrix();
  T.topRightCorner<3, 1>() = Vec3(0.05, 0.02, -0.01);
  return T;
}

CameraModel SimulatedCamera::model() const {
  if (exactly) return *exactly;
  CameraModel m;
  m.width = width;
  m.height = height;
  m.distortion = lens;
  if (lens == Distortion::radtan) m.coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  if (lens == Distortion::equidistant) m.coeffs = {0.0034824, 0.00071503, -0.00205324, 0.00020294};
  const double degree = std::numbers::pi / 180;
  const double half = 0.5 * (fov_rad > 0 ? fov_rad : (lens == Distortion::equidistant ? 120 : 70) * degree);
  m.fx = m.fy = 1;
  const auto edge = m.project({std::sin(half), 0, std::cos(half)});
  if (!edge || width < 1 || height < 1)
    throw std::invalid_argument("SimulatedCamera: " + std::to_string(width) + " x " + std::to_string(height) +
                                " px and a field of view of " + std::to_string(2 * half / degree) +
                                " degrees suit no such lens");
  m.fx = m.fy = 0.5 * width / edge->x();
  m.cx = 0.5 * (width - 1);
  m.cy = 0.5 * (height - 1);
  return m;
}

FrameTiming SimulatedCamera::timing() const {
  FrameTiming t;
  t.instant = stamp;
  t.row = RowReference::first;
  t.shutter = readout_s > 0 ? Shutter::rolling : Shutter::global;
  t.exposure_s = exposure_s;
  t.readout_s = readout_s;
  t.rows = exactly ? exactly->height : height;
  return t;
}

std::vector<Exposure> simulate_exposures(const SimulatedCamera& camera, const SimulatedClocks& clocks,
                                         double duration_s, std::uint64_t seed) {
  const double longest = camera.exposure_s * (1 + camera.exposure_swing);
  if (!(camera.rate_hz > 0) || !(camera.exposure_s >= 0) || !(camera.readout_s >= 0) || longest > 1 / camera.rate_hz)
    throw std::invalid_argument("SimulatedCamera: at " + std::to_string(camera.rate_hz) + " frames/s no exposure of " +
                                std::to_string(longest) + " s and readout of " + std::to_string(camera.readout_s) +
                                " s");
  const auto to_sensor = inverse(clocks.sensor_to_reference(duration_s));
  const FrameTiming timing = camera.timing();
  Random start(seed, "first frame"), stamps(seed, "frame stamps"), drops(seed, "frame drops");
  const double phase = start.uniform(), swing_phase = start.uniform(0, 2 * std::numbers::pi);
  std::vector<Exposure> out;
  for (int k = 0;; ++k) {
    Exposure e;
    e.middle_s = (k + phase) / camera.rate_hz + 0.5 * longest;
    // Slower than any motion of interest: one swing in 7 s.
    const double swing = std::sin(2 * std::numbers::pi * e.middle_s / 7 + swing_phase);
    e.exposure_s = camera.exposure_s * (1 + camera.exposure_swing * swing);
    if (e.middle_s + 0.5 * e.exposure_s + camera.readout_s > duration_s) break;
    const double limit = 0.45 / camera.rate_hz;
    const double jitter = std::clamp(camera.jitter_s * stamps.normal(), -limit, limit);
    const double stamp_minus_middle = -timing.to_exposure_middle_s(e.exposure_s) + jitter;
    if (drops.chance(camera.drop_fraction)) continue;
    e.stamp = as_stamp(to_sensor(clocks.at(e.middle_s)) + from_seconds(stamp_minus_middle));
    out.push_back(e);
  }
  return out;
}

Eigen::Isometry3d cam_from_world(const Trajectory& truth, const Mat4& T_body_cam, double t_s) {
  return (truth.world_from_body(t_s) * Eigen::Isometry3d(T_body_cam)).inverse();
}

}  // namespace takt
