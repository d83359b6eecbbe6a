// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_files.h"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/kalibr_text.h"
#include "takt/recording/yaml_fields.h"
#include "takt/streams/kalibr_names.h"

namespace takt {

namespace {

constexpr std::size_t most_sensors = 64;

template <class Value>
Value needed(const YamlFields& fields, const std::string& key, std::optional<Value> value) {
  if (!value) fields.fail(key, "is missing");
  return *value;
}
double number(const YamlFields& fields, const std::string& key) {
  return needed(fields, key, fields.number(key));
}
int whole(const YamlFields& fields, const std::string& key) {
  const double value = number(fields, key);
  if (value != std::floor(value) || std::abs(value) > 1e6) fields.fail(key, "is not a whole number");
  return static_cast<int>(value);
}
bool yes(const YamlFields& fields, const std::string& key, bool otherwise) {
  const auto word = fields.text(key);
  if (!word) return otherwise;
  if (*word == "True" || *word == "true" || *word == "1") return true;
  if (*word != "False" && *word != "false" && *word != "0") fields.fail(key, "is neither True nor False");
  return false;
}

Mat3 matrix3(const YamlFields& fields, const std::string& key) {
  const auto values = needed(fields, key, fields.numbers(key));
  if (values.size() != 9) fields.fail(key, "is not a 3 by 3 matrix");
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}
std::optional<Mat3> matrix3_if_there(const YamlFields& fields, const std::string& key) {
  return fields.has(key) ? std::optional(matrix3(fields, key)) : std::nullopt;
}
std::optional<Vec3> place_if_there(const YamlFields& fields, const std::string& key) {
  const auto values = fields.numbers(key);
  if (!values) return std::nullopt;
  if (values->size() != 3) fields.fail(key, "is not a list of 3 numbers");
  return Vec3(values->data());
}

double not_negative(const YamlFields& fields, const std::string& key) {
  const double value = number(fields, key);
  if (value < 0) fields.fail(key, "is negative");
  return value;
}

Target target_of(const YamlFields& f) {
  const std::string type = needed(f, "target_type", f.text("target_type"));
  if (type == "aprilgrid") {
    AprilGrid g;
    g.columns = whole(f, "tagCols"), g.rows = whole(f, "tagRows");
    g.tag_m = number(f, "tagSize"), g.spacing = number(f, "tagSpacing");
    if (f.has("codeOffset")) g.first_id = whole(f, "codeOffset");
    if (f.has("borderCells")) g.border_cells = whole(f, "borderCells");
    return g;
  }
  if (type == "checkerboard")
    return Checkerboard{whole(f, "targetCols"), whole(f, "targetRows"), number(f, "rowSpacingMeters"),
                        number(f, "colSpacingMeters")};
  if (type == "circlegrid") {
    CircleGrid g{whole(f, "targetCols"), whole(f, "targetRows"), number(f, "spacingMeters"),
                 yes(f, "asymmetricGrid", false)};
    if (f.has("diameterMeters")) g.diameter_m = number(f, "diameterMeters");
    return g;
  }
  if (type == "charuco") {
    Charuco c{whole(f, "targetCols"), whole(f, "targetRows"), number(f, "squareSizeMeters"),
              number(f, "markerSizeMeters")};
    c.dictionary = f.text("dictionary").value_or(c.dictionary);
    c.legacy = yes(f, "legacyPattern", false);
    return c;
  }
  f.fail("target_type", fmt::format("is '{}', not aprilgrid, checkerboard, circlegrid or charuco", type));
}

KalibrCamera camera_of(const YamlFields& f) {
  KalibrCamera out;
  std::string note;
  const auto model = camera_model(f, note);
  if (!model && !note.empty())
    f.fail(note.find("distortion") == std::string::npos ? "camera_model" : "distortion_model",
           "is not one of Kalibr's that takt knows: " + note);
  out.model = needed(f, "intrinsics", model);
  if (out.model.width == 0) f.fail("resolution", "is missing");
  out.rostopic = f.text("rostopic").value_or("");
  if (const auto overlaps = f.numbers("cam_overlaps")) {
    out.cam_overlaps.emplace();
    for (const double camera : *overlaps) {
      if (!(camera >= 0 && camera < most_sensors)) f.fail("cam_overlaps", "is not a list of cameras' numbers");
      out.cam_overlaps->push_back(static_cast<int>(camera));
    }
  }
  out.T_cam_imu = f.transform("T_cam_imu");
  out.T_cn_cnm1 = f.transform("T_cn_cnm1");
  out.timeshift_cam_imu_s = f.number("timeshift_cam_imu");
  out.line_delay_s = f.number("line_delay");
  return out;
}

std::optional<KalibrTriad> triad_if_there(const YamlFields& fields, const std::string& key) {
  if (!fields.has(key)) return std::nullopt;
  const YamlFields f = fields.under(key);
  return KalibrTriad{matrix3(f, "M"),           matrix3_if_there(f, "C_gyro_i"), matrix3_if_there(f, "A"),
                     place_if_there(f, "rx_i"), place_if_there(f, "ry_i"),       place_if_there(f, "rz_i")};
}

KalibrImu imu_of(const YamlFields& f) {
  KalibrImu out;
  out.noise.accel_density = not_negative(f, "accelerometer_noise_density");
  out.noise.accel_random_walk = not_negative(f, "accelerometer_random_walk");
  out.noise.gyro_density = not_negative(f, "gyroscope_noise_density");
  out.noise.gyro_random_walk = not_negative(f, "gyroscope_random_walk");
  out.update_rate_hz = number(f, "update_rate");
  if (!(out.update_rate_hz > 0)) f.fail("update_rate", "is not a rate in Hz");
  out.rostopic = f.text("rostopic").value_or("");
  out.model = f.text("model");
  out.T_i_b = f.transform("T_i_b");
  out.time_offset_s = f.number("time_offset");
  out.accelerometers = triad_if_there(f, "accelerometers");
  out.gyroscopes = triad_if_there(f, "gyroscopes");
  return out;
}

/// The maps under cam0, cam1 … until one is not there.
template <class Read>
auto each_of(const YamlFields& file, const std::string& kind, Read read) {
  std::vector<decltype(read(file))> out;
  while (out.size() < most_sensors && file.has(kind + std::to_string(out.size())))
    out.push_back(read(file.under(kind + std::to_string(out.size()))));
  return out;
}

void write_camera(KalibrText& out, const KalibrCamera& c) {
  const Intrinsics all = intrinsics_of(c.model);
  const int coeffs = coeff_count(c.model.distortion);
  const auto first = static_cast<std::ptrdiff_t>(all.size()) - coeffs;
  if (c.T_cam_imu) out.matrix("T_cam_imu", *c.T_cam_imu);
  if (c.T_cn_cnm1) out.matrix("T_cn_cnm1", *c.T_cn_cnm1);
  if (c.cam_overlaps) out.whole_list("cam_overlaps", *c.cam_overlaps);
  out.word("camera_model", kalibr_name(c.model.projection));
  out.list("distortion_coeffs", {all.data() + first, all.data() + all.size()});
  out.word("distortion_model", kalibr_name(c.model.distortion));
  out.list("intrinsics", {all.data(), all.data() + first});
  if (c.line_delay_s) out.number("line_delay", *c.line_delay_s);
  out.whole_list("resolution", {c.model.width, c.model.height});
  out.word("rostopic", c.rostopic);
  if (c.timeshift_cam_imu_s) out.number("timeshift_cam_imu", *c.timeshift_cam_imu_s);
}

void write_triad(KalibrText& out, const std::string& key, const KalibrTriad& t) {
  out.open(key);
  if (t.A) out.matrix("A", *t.A);
  if (t.C_gyro_i) out.matrix("C_gyro_i", *t.C_gyro_i);
  out.matrix("M", t.M);
  for (const auto& [name, place] : {std::pair{"rx_i", t.rx_i}, {"ry_i", t.ry_i}, {"rz_i", t.rz_i}})
    if (place) out.list(name, {place->x(), place->y(), place->z()});
  out.close();
}

void write_imu(KalibrText& out, const KalibrImu& imu) {
  if (imu.T_i_b) out.matrix("T_i_b", *imu.T_i_b);
  out.number("accelerometer_noise_density", imu.noise.accel_density);
  out.number("accelerometer_random_walk", imu.noise.accel_random_walk);
  if (imu.accelerometers) write_triad(out, "accelerometers", *imu.accelerometers);
  out.number("gyroscope_noise_density", imu.noise.gyro_density);
  out.number("gyroscope_random_walk", imu.noise.gyro_random_walk);
  if (imu.gyroscopes) write_triad(out, "gyroscopes", *imu.gyroscopes);
  if (imu.model) out.word("model", *imu.model);
  out.word("rostopic", imu.rostopic);
  if (imu.time_offset_s) out.number("time_offset", *imu.time_offset_s);
  out.number("update_rate", imu.update_rate_hz);
}

struct WriteTarget {
  KalibrText& out;
  void operator()(const AprilGrid& g) const {
    if (g.border_cells != AprilGrid{}.border_cells) out.whole("borderCells", g.border_cells);
    if (g.first_id != 0) out.whole("codeOffset", g.first_id);
    out.whole("tagCols", g.columns);
    out.whole("tagRows", g.rows);
    out.number("tagSize", g.tag_m);
    out.number("tagSpacing", g.spacing);
    out.word("target_type", "aprilgrid");
  }
  void operator()(const Checkerboard& b) const {
    out.number("colSpacingMeters", b.column_m);
    out.number("rowSpacingMeters", b.row_m);
    out.whole("targetCols", b.columns);
    out.whole("targetRows", b.rows);
    out.word("target_type", "checkerboard");
  }
  void operator()(const CircleGrid& g) const {
    out.word("asymmetricGrid", g.asymmetric ? "true" : "false");
    if (g.diameter_m > 0) out.number("diameterMeters", g.diameter_m);
    out.number("spacingMeters", g.spacing_m);
    out.whole("targetCols", g.columns);
    out.whole("targetRows", g.rows);
    out.word("target_type", "circlegrid");
  }
  void operator()(const Charuco& c) const {
    out.word("dictionary", c.dictionary);
    if (c.legacy) out.word("legacyPattern", "true");
    out.number("markerSizeMeters", c.marker_m);
    out.number("squareSizeMeters", c.square_m);
    out.whole("targetCols", c.columns);
    out.whole("targetRows", c.rows);
    out.word("target_type", "charuco");
  }
};

}  // namespace

Target read_kalibr_target(std::string_view text, const std::string& where) {
  const Target target = target_of(YamlFields(text, where));
  try {
    check(target);
  } catch (const std::invalid_argument& e) {
    throw Error(e.what(), where, "correct the description of the target");
  }
  return target;
}

KalibrCamchain read_kalibr_camchain(std::string_view text, const std::string& where) {
  const YamlFields file(text, where);
  KalibrCamchain chain = each_of(file, "cam", camera_of);
  if (chain.empty()) file.fail("cam0", "is missing: a camchain begins with it");
  return chain;
}

std::vector<KalibrImu> read_kalibr_imus(std::string_view text, const std::string& where) {
  const YamlFields file(text, where);
  std::vector<KalibrImu> imus = each_of(file, "imu", imu_of);
  if (imus.empty()) imus.push_back(imu_of(file));
  return imus;
}

std::string write_kalibr_target(const Target& target, KalibrStyle style) {
  KalibrText out(style);
  std::visit(WriteTarget{out}, target);
  return out.text();
}

std::string write_kalibr_camchain(const KalibrCamchain& chain, KalibrStyle style) {
  KalibrText out(style);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    out.open(fmt::format("cam{}", i));
    write_camera(out, chain[i]);
    out.close();
  }
  return out.text();
}

std::string write_kalibr_imus(const std::vector<KalibrImu>& imus, KalibrStyle style) {
  KalibrText out(style);
  if (imus.size() == 1 && !imus[0].model && !imus[0].T_i_b) {
    write_imu(out, imus[0]);
    return out.text();
  }
  for (std::size_t i = 0; i < imus.size(); ++i) {
    out.open(fmt::format("imu{}", i));
    write_imu(out, imus[i]);
    out.close();
  }
  return out.text();
}

Target read_kalibr_target_file(const std::string& path) {
  return read_kalibr_target(read_file(path), path);
}
KalibrCamchain read_kalibr_camchain_file(const std::string& path) {
  return read_kalibr_camchain(read_file(path), path);
}
std::vector<KalibrImu> read_kalibr_imus_file(const std::string& path) {
  return read_kalibr_imus(read_file(path), path);
}

}  // namespace takt
