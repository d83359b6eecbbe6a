// SPDX-License-Identifier: Apache-2.0
#include "takt/apply/export_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "takt/calibration/words.h"
#include "takt/streams/kalibr_names.h"

namespace takt::export_text {

namespace {

/// In units of `unit` ns with that many decimals.
std::string decimal(std::int64_t ns, std::uint64_t unit, int decimals) {
  const auto magnitude = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  return fmt::format("{}{}.{:0{}}", ns < 0 ? "-" : "", magnitude / unit, magnitude % unit, decimals);
}

}  // namespace

std::string seconds(std::int64_t ns) {
  return decimal(ns, 1'000'000'000, 9);
}
std::string milliseconds(std::int64_t ns) {
  return decimal(ns, 1'000'000, 6);
}

std::string number(double v) {
  std::string text = fmt::format("{}", v == 0 ? 0.0 : v);  // no minus before a zero
  if (text.find_first_of(".n") != std::string::npos) return text;
  return text.insert(std::min(text.find('e'), text.size()), ".0");  // PyYAML takes 1e-05 for a word
}

std::string list(const std::vector<double>& values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "[" : ", ") + number(v);
  return out.empty() ? "[]" : out + "]";
}

std::vector<double> row_major(const Eigen::MatrixXd& m) {
  std::vector<double> out;
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    for (Eigen::Index c = 0; c < m.cols(); ++c) out.push_back(m(r, c));
  return out;
}

std::string matrix_rows(const std::string& key, const Mat4& m, int indent) {
  const std::string blanks(static_cast<std::size_t>(indent), ' ');
  std::string out = blanks + key + ":\n";
  for (int r = 0; r < 4; ++r) out += fmt::format("{}  - {}\n", blanks, list({m(r, 0), m(r, 1), m(r, 2), m(r, 3)}));
  return out;
}

std::string opencv_matrix(const std::string& key, const Eigen::MatrixXd& m, char type) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: {}\n   data: {}\n", key, m.rows(), m.cols(),
                     type, list(row_major(m)));
}

std::string offset_words(const CameraToImu& c) {
  const Duration size(c.shift_ns < 0 ? -c.shift_ns : c.shift_ns);
  return fmt::format("{} is {} {} against {}", c.camera, time_words(size, c.sigma_s), c.shift_ns < 0 ? "late" : "early",
                     c.imu);
}

std::string kalibr_camera(const CameraToImu& c, int indent) {
  const std::string blanks(static_cast<std::size_t>(indent), ' ');
  if (!c.model)
    return blanks + "# camera_model, intrinsics, distortion and resolution are not known: see --intrinsics\n";
  const CameraModel& m = *c.model;
  const Intrinsics all = intrinsics_of(m);
  const auto lens = static_cast<std::ptrdiff_t>(all.size()) - coeff_count(m.distortion);
  std::string out = fmt::format("{}camera_model: {}\n", blanks, kalibr_name(m.projection));
  out += fmt::format("{}intrinsics: {}\n", blanks, list({all.data(), all.data() + lens}));
  out += fmt::format("{}distortion_model: {}\n", blanks, kalibr_name(m.distortion));
  out += fmt::format("{}distortion_coeffs: {}\n", blanks, list({all.data() + lens, all.data() + all.size()}));
  out += fmt::format("{}resolution: [{}, {}]\n", blanks, m.width, m.height);
  return out;
}

std::string mounting_comment(const CameraToImu& c) {
  return c.rotation_alone() ? "# the translation of the mounting was not found: put in your own\n" : "";
}

std::string head_comment(const CameraToImu& c) {
  return fmt::format("# takt: {}, so t_imu = t_cam {} {} s\n", offset_words(c), c.shift_ns < 0 ? "-" : "+",
                     seconds(c.shift_ns < 0 ? -c.shift_ns : c.shift_ns));
}

}  // namespace takt::export_text
