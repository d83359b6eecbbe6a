// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/simulation/parameters.h"
#include "takt/simulation/sensor_parameters.h"
#include "takt/simulation/target_film.h"

namespace takt {

/// TargetFilmOptions as a scenario file and the command line write them: flat, each name with its unit.
struct TargetParameters {
  std::string target = "aprilgrid";
  int columns = 0, rows = 0;
  double tag_size_m = AprilGrid{}.tag_m, tag_spacing = AprilGrid{}.spacing;
  int border_cells = AprilGrid{}.border_cells;
  double square_m = 0.06, marker_m = 0.044, circle_spacing_m = 0.04;
  bool symmetric = false;

  double duration_s = TargetFilmOptions{}.duration_s;
  double turn_rms_rad_s = 1.6, speed_rms_m_s = 0.4;
  bool single_axis = false;
  double distance_m = TargetFilmOptions{}.distance_m;
  double board_from_s = 0;
  double offset_s = TargetFilmOptions{}.offset_s;
  double drift_ppm = 0;

  int cameras = 1;
  double baseline_m = TargetFilmOptions{}.baseline_m, camera_offset_step_s = 0;
  bool triggered_together = false;
  std::string lens = "radtan";
  double line_delay_s = 0;
  double lens_blur_px = PrintedBoard{}.blur_px;
  FrameParameters frames{.exposure_s = 0.002};

  int imus = 1;
  double imu_offset_step_s = 0;
  ImuParameters imu;
};

template <class Visitor>
void describe(TargetParameters& p, Visitor& v) {
  v("target", p.target, "aprilgrid, checkerboard, circlegrid, charuco");
  v("columns", p.columns, "tags, inner corners, circles or squares in a row; 0: 6, 9, 4, 8");
  v("rows", p.rows, "rows of them; 0: 6, 6, 11, 6");
  v("tag_size_m", p.tag_size_m, "aprilgrid: side of a tag, from outer black edge to outer black edge");
  v("tag_spacing", p.tag_spacing, "aprilgrid: gap between tags / side of a tag");
  v("border_cells", p.border_cells, "aprilgrid: width of the tags' black border, 1 or 2 cells");
  v("square_m", p.square_m, "checkerboard, charuco: side of a square");
  v("marker_m", p.marker_m, "charuco: side of a marker");
  v("circle_spacing_m", p.circle_spacing_m, "circlegrid: spacing as Kalibr means it");
  v("symmetric", p.symmetric, "circlegrid: rows not shifted");
  v("duration_s", p.duration_s, "length of the recording");
  v("turn_rms_rad_s", p.turn_rms_rad_s, "rms angular rate; 0.2 is weak");
  v("speed_rms_m_s", p.speed_rms_m_s, "rms speed");
  v("single_axis", p.single_axis, "turn about one axis only");
  v("distance_m", p.distance_m, "from the camera to the board in the mean");
  v("board_from_s", p.board_from_s, "the board comes into view only then");
  v("offset_s", p.offset_s, "clocks: reference - sensor in the middle of the recording");
  v("drift_ppm", p.drift_ppm, "clocks: how much faster the reference runs");
  v("cameras", p.cameras, "beside each other, each with a clock of its own");
  v("baseline_m", p.baseline_m, "from a camera to the next");
  v("camera_offset_step_s", p.camera_offset_step_s, "by which each further camera's offset is larger");
  v("triggered_together", p.triggered_together, "all cameras take their frames at the same instants");
  v("lens", p.lens, "none, radtan, equidistant, fov, omni, ds, eucm");
  v("line_delay_s", p.line_delay_s, "rolling shutter: from a row to the next; 0: global shutter");
  v("lens_blur_px", p.lens_blur_px, "sigma of the lens' blur");
  describe(p.frames, v);
  v("imus", p.imus, "on the same body, each with a clock of its own");
  v("imu_offset_step_s", p.imu_offset_step_s, "by which imu0's clock is ahead of each further one's");
  describe(p.imu, v);
}

/// Throws std::invalid_argument naming the parameter that no simulation can have.
[[nodiscard]] TargetFilmOptions to_options(const TargetParameters& p);

/// "none", "radtan", "equidistant", "fov", "omni", "ds", "eucm": 752 × 480, about 90° wide; throws likewise.
[[nodiscard]] CameraModel lens_named(const std::string& name);

}  // namespace takt
