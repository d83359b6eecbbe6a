// SPDX-License-Identifier: Apache-2.0
// The HTML page of cameras alone.
#include <fmt/core.h>

#include <numbers>

#include "takt/calibration/words.h"
#include "takt/report/html_report.h"
#include "takt/workflows/calibrate_cameras.h"

namespace takt {

namespace {

constexpr double degree = std::numbers::pi / 180;

ReportTable intrinsics_table(const CameraAnswer& c) {
  ReportTable out{
      c.name + ": " + c.lens, "Focal lengths and principal point in pixels.", {"intrinsic", "value ± σ"}, {}};
  const Intrinsics values = intrinsics_of(c.found.model);
  const std::vector<std::string> names = intrinsic_names(c.found.model);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    out.rows.push_back({names[k], value_words(values[at], c.found.sigma[at])});
  }
  return out;
}

ReportTable views_table(const CalibratedCameras& result) {
  ReportTable out{
      "What was seen",
      "Residuals and noise a coordinate, in pixels; systematic: what corners of one part of the picture "
      "miss by in the same way.",
      {"camera", "verdict", "frames", "corners", "left out", "rms", "noise", "systematic", "covered", "largest tilt"},
      {}};
  for (const CameraAnswer& c : result.cameras) {
    const batch::CalibratedCamera& f = c.found;
    out.rows.push_back({c.name, to_string(f.verdict), std::to_string(f.frames), std::to_string(f.corners),
                        std::to_string(f.strays), fmt::format("{:.3f}", f.rms_px),
                        fmt::format("{:.3f}", f.corner_sigma_px), fmt::format("{:.3f}", f.systematic_px),
                        fmt::format("{:.0f} % × {:.0f} %", 100 * f.covered_width, 100 * f.covered_height),
                        fmt::format("{:.0f}°", f.largest_tilt_rad / degree)});
  }
  return out;
}

/// How each camera stands to the one before it.
ReportTable chain_table(const CalibratedCameras& result) {
  ReportTable out{"Camera to camera",
                  "Takes points from the camera before to this one: place in metres, rotation vector in degrees.",
                  {"camera", "x", "y", "z", "about x", "about y", "about z", "frames"},
                  {}};
  for (const CameraAnswer& c : result.cameras) {
    if (!c.to_before) continue;
    const Vec3 place = c.to_before->T_cn_cnm1.translation, turn = log_so3(c.to_before->T_cn_cnm1.rotation) / degree;
    std::vector<std::string> row{c.name};
    for (int k = 0; k < 3; ++k) row.push_back(value_words(place[k], c.to_before->sigma[k]));
    for (int k = 0; k < 3; ++k) row.push_back(value_words(turn[k], c.to_before->sigma[3 + k] / degree));
    row.push_back(std::to_string(c.to_before->frames));
    out.rows.push_back(std::move(row));
  }
  return out;
}

std::string heading(const CalibratedCameras& result) {
  std::string out;
  for (const CameraAnswer& c : result.cameras)
    out += fmt::format("{}{} ({})", out.empty() ? "" : ", ", c.name,
                       c.found.verdict == Verdict::refused ? "no answer" : c.lens);
  return out;
}

}  // namespace

std::string report_page(const CalibratedCameras& result) {
  ReportPage page{"cameras", heading(result), result.verdict, result.reasons, {}, {}, result.notes, result.provenance};
  page.tables.push_back(views_table(result));
  for (const CameraAnswer& c : result.cameras) {
    if (c.found.verdict == Verdict::refused) continue;
    page.tables.push_back(intrinsics_table(c));
    for (Panel p : c.found.panels) {
      p.name = c.name + "_" + p.name;
      p.title = c.name + ": " + p.title;
      page.evidence.panels.push_back(std::move(p));
    }
  }
  if (ReportTable chain = chain_table(result); !chain.rows.empty()) page.tables.push_back(std::move(chain));
  return html_report(page);
}

}  // namespace takt
