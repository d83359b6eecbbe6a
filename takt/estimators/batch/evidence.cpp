// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/evidence.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace takt::batch {

namespace {

constexpr std::size_t most_points = 3000;

Panel panel(const char* name, const char* kind, const char* title, const char* caption) {
  Panel p;
  p.name = name;
  p.kind = kind;
  p.title = title;
  p.caption = caption;
  return p;
}

/// Three axes over time, thinned.
void add_axes(Panel& p, const char* what, const char* unit, const std::vector<double>& t, const std::vector<Vec3>& y) {
  p.x = {"time on the IMU's clock since its first stamp", "s", {}, {}};
  const std::size_t step = std::max<std::size_t>(1, t.size() / most_points);
  for (std::size_t i = 0; i < t.size(); i += step) p.x.values.push_back(t[i]);
  for (int axis = 0; axis < 3; ++axis) {
    Series s{fmt::format("{} {}", what, "xyz"[axis]), unit, {}, {}};
    for (std::size_t i = 0; i < t.size(); i += step) s.values.push_back(y[i][axis]);
    p.y.push_back(std::move(s));
  }
}

}  // namespace

Panel reprojection_panel(const CameraResiduals& r) {
  Panel p = panel("reprojection", "points", "Reprojection error, frame by frame",
                  "Root mean square of the corners' distances from where the calibrated model puts them, a coordinate. "
                  "All frames should be alike.");
  p.x = {"time on the camera's clock since its first stamp", "s", r.frame_t, {}};
  p.y.push_back({"rms", "px", r.frame_rms_px, {}});
  return p;
}

Panel lateness_panel(const CameraResiduals& r) {
  Panel p = panel("lateness", "points", "How late each frame looks",
                  "By its corners alone, against the motion that all frames and the IMU agree on. A scatter beyond the "
                  "bars is a jitter of the stamps.");
  p.x = {"time on the camera's clock since its first stamp", "s", r.frame_t, {}};
  p.y.push_back({"lateness", "s", r.frame_late_s, r.frame_late_sigma_s});
  return p;
}

Panel gyro_panel(const ImuResiduals& r) {
  Panel p = panel("gyro_residuals", "lines", "Gyro: predicted minus read",
                  "White noise about zero, without a trace of the motion.");
  add_axes(p, "gyro", "rad/s", r.t, r.gyro);
  return p;
}

Panel accel_panel(const ImuResiduals& r) {
  Panel p = panel("accel_residuals", "lines", "Accelerometer: predicted minus read",
                  "White noise about zero, without a trace of the motion.");
  add_axes(p, "accelerometer", "m/s²", r.t, r.accel);
  return p;
}

Panel bias_panel(const BiasCurve& bias, bool gyro) {
  Panel p = gyro ? panel("gyro_bias", "lines", "Bias of the gyro", "Slow and small.")
                 : panel("accel_bias", "lines", "Bias of the accelerometer", "Slow and small.");
  std::vector<double> t;
  std::vector<Vec3> y;
  constexpr int points = 200;
  for (int i = 0; i <= points; ++i) {
    t.push_back(bias.begin_s + bias.knots.duration_s() * i / points);
    const BiasCurve::Place at = bias.at(t.back());
    y.push_back(gyro ? bias.gyro(at) : bias.accel(at));
  }
  add_axes(p, gyro ? "gyro" : "accelerometer", gyro ? "rad/s" : "m/s²", t, y);
  return p;
}

Panel coverage_panel(std::span<const BoardView> views) {
  Panel p = panel("coverage", "points", "Where in the picture corners were seen",
                  "Rows are counted downward. Parts that no corner reached are not calibrated by this recording.");
  p.x = {"column", "px", {}, {}};
  Series rows{"row", "px", {}, {}};
  std::size_t all = 0;
  for (const BoardView& v : views) all += v.corners.size();
  const std::size_t step = std::max<std::size_t>(1, all / most_points);
  std::size_t i = 0;
  for (const BoardView& v : views)
    for (const CornerObservation& c : v.corners) {
      if (i++ % step != 0) continue;
      p.x.values.push_back(c.pixel.x());
      rows.values.push_back(c.pixel.y());
    }
  p.y.push_back(std::move(rows));
  return p;
}

Panel scatter_panel(std::span<const Vec2> off_px) {
  Panel p =
      panel("reprojection_scatter", "points", "How far corners are seen from where the lens puts them",
            "One round cloud about zero. Arms or lumps are corners that are detected wrongly, or a lens of another "
            "kind.");
  p.x = {"columns", "px", {}, {}};
  Series rows{"rows", "px", {}, {}};
  const std::size_t step = std::max<std::size_t>(1, off_px.size() / most_points);
  for (std::size_t i = 0; i < off_px.size(); i += step) {
    p.x.values.push_back(off_px[i].x());
    rows.values.push_back(off_px[i].y());
  }
  p.y.push_back(std::move(rows));
  return p;
}

Panel radial_panel(std::span<const Vec2> at_px, std::span<const Vec2> off_px, const CameraModel& model,
                   double noise_px) {
  constexpr std::size_t rings = 24;
  constexpr double fewest = 10;
  const Vec2 centre(model.cx, model.cy);
  const double radius = Vec2(model.width, model.height).norm() / 2 + 1;
  std::vector<double> n(rings, 0), sum(rings, 0);
  for (std::size_t i = 0; i < at_px.size(); ++i) {
    const Vec2 arm = at_px[i] - centre;
    const auto ring = std::min(rings - 1, static_cast<std::size_t>(rings * arm.norm() / radius));
    n[ring] += 1;
    sum[ring] += off_px[i].dot(arm.stableNormalized());
  }
  Panel p =
      panel("radial_residuals", "points", "What corners miss by along the radius",
            "Means over rings about the principal point, outward positive, with what noise alone would give them. "
            "A wave means that a lens of another kind would fit better.");
  p.x = {"distance from the principal point", "px", {}, {}};
  Series mean{"outward", "px", {}, {}};
  for (std::size_t k = 0; k < rings; ++k) {
    if (n[k] < fewest) continue;
    p.x.values.push_back((static_cast<double>(k) + 0.5) * radius / rings);
    mean.values.push_back(sum[k] / n[k]);
    mean.sigma.push_back(noise_px / std::sqrt(n[k]));
  }
  p.y.push_back(std::move(mean));
  return p;
}

Panel windows_panel(const std::vector<WindowOffset>& windows, double offset_s, double sigma_s) {
  Panel p =
      panel("windows", "points", "Offset in pieces of the recording, against the answer",
            "All should scatter about the band within their bars; a slope is a drift, a step a clock that jumped.");
  p.x = {"time on the camera's clock since its first stamp", "s", {}, {}};
  Series found{"offset − answer", "s", {}, {}}, answer{"answer", "s", {}, {}, "lines"};
  for (const WindowOffset& w : windows) {
    p.x.values.push_back(w.centre_s);
    found.values.push_back(w.offset_s - offset_s);
    found.sigma.push_back(w.sigma_s);
    answer.values.push_back(0);
    answer.sigma.push_back(sigma_s);
  }
  p.y = {std::move(found), std::move(answer)};
  return p;
}

}  // namespace takt::batch
