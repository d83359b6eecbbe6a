// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/target_parameters.h"

namespace takt {

namespace {

Target target_of(const TargetParameters& p) {
  const auto count = [](int given, int otherwise) { return given != 0 ? given : otherwise; };
  if (p.target == "aprilgrid")
    return AprilGrid{count(p.columns, 6), count(p.rows, 6), p.tag_size_m, p.tag_spacing, 0, p.border_cells};
  if (p.target == "checkerboard") return Checkerboard{count(p.columns, 9), count(p.rows, 6), p.square_m, p.square_m};
  if (p.target == "circlegrid")
    return CircleGrid{count(p.columns, 4), count(p.rows, 11), p.circle_spacing_m, !p.symmetric};
  if (p.target == "charuco") return Charuco{count(p.columns, 8), count(p.rows, 6), p.square_m, p.marker_m};
  throw_bad_value("target", p.target, "is none of aprilgrid, checkerboard, circlegrid, charuco");
}

/// The ranges outside which the words of the description lose their meaning.
void check(const TargetParameters& p) {
  require_none_negative(p);
  require_within("duration_s", p.duration_s, 0.5, 86400);
  require_within("drift_ppm", p.drift_ppm, -10000, 10000);
  require_within("offset_s", p.offset_s, -1e9, 1e9);
  require_within("distance_m", p.distance_m, 0.05, 100);
  require_within("lens_blur_px", p.lens_blur_px, 0, 1);
  require_within("cameras", p.cameras, 1, 8);
  require_within("imus", p.imus, 1, 8);
}

}  // namespace

CameraModel lens_named(const std::string& name) {
  CameraModel m = *TargetFilmOptions::target_camera().exactly;
  if (name == "radtan") return m;
  m.distortion = Distortion::none;
  m.coeffs = {};
  if (name == "none") return m;
  if (name == "equidistant") {
    m.distortion = Distortion::equidistant;
    m.coeffs = {0.0034824, 0.00071503, -0.00205324, 0.00020294};
    return m;
  }
  if (name == "fov") {
    m.distortion = Distortion::fov;
    m.coeffs = {0.9};
    return m;
  }
  if (name == "omni") {
    m.projection = Projection::omni;
    m.distortion = Distortion::radtan;
    m.shape = {1.2};
    m.coeffs = {-0.08, 0.02, 2e-4, -1e-4};
    m.fx *= 2.2, m.fy *= 2.2;
    return m;
  }
  if (name == "ds") {
    m.projection = Projection::double_sphere;
    m.shape = {-0.18, 0.59};
    m.fx *= 0.82, m.fy *= 0.82;
    return m;
  }
  if (name == "eucm") {
    m.projection = Projection::eucm;
    m.shape = {0.6, 1.05};
    return m;
  }
  throw_bad_value("lens", name, "is none of none, radtan, equidistant, fov, omni, ds, eucm");
}

TargetFilmOptions to_options(const TargetParameters& p) {
  check(p);
  TargetFilmOptions o;
  o.duration_s = p.duration_s;
  o.motion.turn_calm_rad_s = o.motion.turn_lively_rad_s = p.turn_rms_rad_s;
  o.motion.speed_calm_m_s = o.motion.speed_lively_m_s = p.speed_rms_m_s;
  if (p.single_axis) o.motion.freedom = Freedom::one;
  o.offset_s = p.offset_s;
  o.drift = 1e-6 * p.drift_ppm;
  o.scene.target = target_of(p);
  check(o.scene.target);
  o.scene.appears_s = p.board_from_s;
  o.scene.blur_px = p.lens_blur_px;
  o.distance_m = p.distance_m;
  o.cameras = p.cameras;
  o.baseline_m = p.baseline_m;
  o.camera_offset_step_s = p.camera_offset_step_s;
  o.camera.exactly = lens_named(p.lens);
  o.camera.readout_s = p.line_delay_s * o.camera.exactly->height;
  o.triggered_together = p.triggered_together;
  apply(p.frames, o.camera, o.scene.noise);
  o.imus = p.imus;
  o.imu_offset_step_s = p.imu_offset_step_s;
  apply(p.imu, o.imu);
  return o;
}

}  // namespace takt
