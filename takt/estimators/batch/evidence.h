// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "takt/calibration/evidence.h"
#include "takt/estimators/batch/spline_model.h"

/// The plots of a calibration, as plain data.
namespace takt::batch {

[[nodiscard]] Panel reprojection_panel(const CameraResiduals& r);
[[nodiscard]] Panel lateness_panel(const CameraResiduals& r);
[[nodiscard]] Panel gyro_panel(const ImuResiduals& r);
[[nodiscard]] Panel accel_panel(const ImuResiduals& r);
/// Both curves, an axis each.
[[nodiscard]] Panel bias_panel(const BiasCurve& bias, bool gyro);
/// Where in the picture corners were seen.
[[nodiscard]] Panel coverage_panel(std::span<const BoardView> views);
/// `off_px`: where a corner is seen less where the lens puts it, of corners seen at `at_px`.
[[nodiscard]] Panel scatter_panel(std::span<const Vec2> off_px);
/// What the corners miss by along the radius, in rings about the principal point.
[[nodiscard]] Panel radial_panel(std::span<const Vec2> at_px, std::span<const Vec2> off_px, const CameraModel& model,
                                 double noise_px);
/// `offset_s`, `sigma_s`: the answer.
[[nodiscard]] Panel windows_panel(const std::vector<WindowOffset>& windows, double offset_s, double sigma_s);

}  // namespace takt::batch
