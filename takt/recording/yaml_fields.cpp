// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/yaml_fields.h"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "takt/error.h"
#include "takt/recording/decimal.h"

namespace takt {

struct YamlFields::Node {
  YAML::Node yaml;
};

namespace {

constexpr std::size_t most_text = 1U << 20;  // a sensor's description; more is some other file

std::string place(const std::string& where, const YAML::Mark& mark) {
  return mark.is_null() ? where : fmt::format("{}:{}", where, mark.line + 1);
}

/// yaml-cpp's parser recurses over nesting and is quadratic in it; a sensor file has two or three levels.
bool too_deep(std::string_view text) {
  int open = 0;
  std::size_t dashes = 0;
  for (const char c : text) {
    open += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    dashes = c == '-' || c == '?' || c == ':' || c == ' ' ? dashes + 1 : 0;
    if (open > 16 || dashes > 400) return true;
  }
  return false;
}

void append_numbers(const YAML::Node& node, std::vector<double>& out, bool& good) {
  if (node.IsSequence()) {
    for (const YAML::Node& item : node) append_numbers(item, out, good);
  } else if (const auto value = node.IsScalar() ? finite_double(node.Scalar()) : std::nullopt) {
    out.push_back(*value);
  } else {
    good = false;
  }
}

}  // namespace

YamlFields::YamlFields(std::unique_ptr<Node> node, std::string where)
    : node_(std::move(node)), where_(std::move(where)) {}
YamlFields::~YamlFields() = default;
YamlFields::YamlFields(YamlFields&&) noexcept = default;

YamlFields::YamlFields(std::string_view text, std::string where)
    : node_(std::make_unique<Node>()), where_(std::move(where)) {
  const char* const advice = "correct the file, or take it from a recording of the same device";
  if (text.size() > most_text || too_deep(text))
    throw Error("is too large or too deep for a sensor's YAML", where_, advice);
  std::string plain(text);
  if (plain.starts_with("%YAML")) plain.insert(0, "#");  // OpenCV's header is no YAML directive
  try {
    node_->yaml = YAML::Load(plain);
  } catch (const YAML::Exception& e) {
    throw Error("is not YAML: " + e.msg, place(where_, e.mark), advice);
  }
  if (!node_->yaml.IsMap()) throw Error("is not a YAML map of keys and values", where_, advice);
}

bool YamlFields::has(const std::string& key) const {
  const YAML::Node& map = node_->yaml;
  return map.IsMap() && map[key] && !map[key].IsNull();
}

YamlFields YamlFields::under(const std::string& key) const {
  auto node = std::make_unique<Node>();
  if (has(key)) {
    const YAML::Node& map = node_->yaml;
    node->yaml = map[key];
    if (!node->yaml.IsMap()) fail(key, "is not a map of keys and values");
  }
  return {std::move(node), where_};
}

void YamlFields::fail(const std::string& key, const std::string& problem) const {
  const YAML::Node& map = node_->yaml;
  const YAML::Mark mark = map.IsMap() && map[key] ? map[key].Mark() : YAML::Mark::null_mark();
  throw Error(fmt::format("{} {}", key, problem), place(where_, mark), "correct this key");
}

std::optional<double> YamlFields::number(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node& map = node_->yaml;
  const auto value = map[key].IsScalar() ? finite_double(map[key].Scalar()) : std::nullopt;
  if (!value) fail(key, "is not a number");
  return value;
}

std::optional<std::string> YamlFields::text(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node& map = node_->yaml;
  if (!map[key].IsScalar()) fail(key, "is not a word");
  return map[key].Scalar();
}

std::optional<std::vector<double>> YamlFields::numbers(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node& map = node_->yaml;
  std::vector<double> out;
  bool good = map[key].IsSequence();
  if (good) append_numbers(map[key], out, good);
  if (!good) fail(key, "is not a list of finite numbers");
  return out;
}

std::optional<std::vector<std::string>> YamlFields::texts(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node& map = node_->yaml;
  std::vector<std::string> out;
  if (!map[key].IsSequence()) fail(key, "is not a list");
  for (const auto& item : map[key]) {
    if (!item.IsScalar()) fail(key, "is not a list of words");
    out.push_back(item.Scalar());
  }
  return out;
}

std::optional<Mat4> YamlFields::transform(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node& map = node_->yaml;
  const auto values = map[key].IsMap() ? under(key).numbers("data") : numbers(key);
  if (!values || values->size() != 16) fail(key, "is not a 4 by 4 matrix");
  const Mat4 t = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values->data());
  const Mat3 r = t.topLeftCorner<3, 3>();
  if (!((r * r.transpose() - Mat3::Identity()).norm() < 1e-3) || !(r.determinant() > 0))
    fail(key, "has no rotation in its upper left 3 by 3");
  return t;
}

namespace {

/// Kalibr's names and those that others give to the same models.
std::optional<Projection> projection_named(const std::string& name) {
  if (name == "pinhole") return Projection::pinhole;
  if (name == "omni") return Projection::omni;
  if (name == "ds" || name == "double_sphere") return Projection::double_sphere;
  if (name == "eucm") return Projection::eucm;
  return std::nullopt;
}
std::optional<Distortion> distortion_named(const std::string& name) {
  if (name == "none" || name.empty()) return Distortion::none;
  if (name == "radial-tangential" || name == "radtan" || name == "plumb_bob") return Distortion::radtan;
  if (name == "equidistant" || name == "fisheye" || name == "kannala_brandt") return Distortion::equidistant;
  if (name == "fov") return Distortion::fov;
  return std::nullopt;
}

void read_resolution(const YamlFields& fields, CameraModel& model) {
  const auto resolution = fields.numbers("resolution");
  if (!resolution) return;
  const auto is_size = [](double n) { return n >= 1 && n <= 65535; };
  if (resolution->size() != 2 || !is_size((*resolution)[0]) || !is_size((*resolution)[1]))
    fields.fail("resolution", "needs 2 numbers: width, height");
  model.width = static_cast<int>((*resolution)[0]);
  model.height = static_cast<int>((*resolution)[1]);
}

void check_shape(const YamlFields& fields, const CameraModel& m) {
  const double alpha = m.shape[m.projection == Projection::eucm ? 0 : 1];
  if (m.projection == Projection::omni && !(m.shape[0] >= 0 && m.shape[0] < 100))
    fields.fail("intrinsics", "needs xi between 0 and 100 in the first place");
  if (m.projection == Projection::double_sphere && !(m.shape[0] > -1 && m.shape[0] < 100))
    fields.fail("intrinsics", "needs xi between -1 and 100 in the first place");
  if ((m.projection == Projection::double_sphere || m.projection == Projection::eucm) && !(alpha > 0 && alpha < 1))
    fields.fail("intrinsics", "needs alpha between 0 and 1");
  if (m.projection == Projection::eucm && !(m.shape[1] > 0)) fields.fail("intrinsics", "needs a positive beta");
}

}  // namespace

std::optional<CameraModel> camera_model(const YamlFields& fields, std::string& note) {
  const auto intrinsics = fields.numbers("intrinsics");
  if (!intrinsics) return std::nullopt;
  const std::string projection = fields.text("camera_model").value_or("pinhole");
  const auto known_projection = projection_named(projection);
  if (!known_projection) {
    note = fmt::format("its camera model '{}' is unknown and left out", projection);
    return std::nullopt;
  }
  CameraModel model;
  model.projection = *known_projection;
  if (intrinsics->size() != static_cast<std::size_t>(intrinsics_of(model).size())) {
    std::string names;
    for (const std::string& name : intrinsic_names(model)) names += (names.empty() ? "" : ", ") + name;
    fields.fail("intrinsics", fmt::format("needs {} numbers: {}", intrinsics_of(model).size(), names));
  }
  model = with_intrinsics(
      model, Eigen::Map<const Eigen::VectorXd>(intrinsics->data(), static_cast<Eigen::Index>(intrinsics->size())));
  if (!(model.fx > 0) || !(model.fy > 0)) fields.fail("intrinsics", "needs positive focal lengths");
  check_shape(fields, model);
  read_resolution(fields, model);

  const std::string name = fields.text("distortion_model").value_or("none");
  const auto known_distortion = distortion_named(name);
  if (!known_distortion) {
    note = fmt::format("its distortion model '{}' is unknown, so the camera model is left out", name);
    return std::nullopt;
  }
  model.distortion = *known_distortion;
  const char* const key = fields.has("distortion_coefficients") ? "distortion_coefficients" : "distortion_coeffs";
  const auto coefficients = fields.numbers(key).value_or(std::vector<double>{});
  if (model.distortion == Distortion::none) return model;
  const auto wanted = static_cast<std::size_t>(coeff_count(model.distortion));
  if (coefficients.size() < wanted) fields.fail(key, fmt::format("needs {} numbers", wanted));
  for (std::size_t i = wanted; i < coefficients.size(); ++i)
    if (coefficients[i] != 0) {
      note = fmt::format("its distortion has more than {} coefficients, so the camera model is left out", wanted);
      return std::nullopt;
    }
  std::copy_n(coefficients.begin(), wanted, model.coeffs.begin());
  return model;
}

std::optional<ExposureInstant> exposure_instant(const YamlFields& fields) {
  const auto stamp = fields.text("stamp");
  if (!stamp) return std::nullopt;
  if (*stamp == "start" || *stamp == "begin") return ExposureInstant::start;
  if (*stamp == "end") return ExposureInstant::end;
  if (*stamp != "middle") fields.fail("stamp", fmt::format("is '{}', not start, middle or end", *stamp));
  return ExposureInstant::middle;
}

double duration_s(const YamlFields& fields, const std::string& key) {
  const double value = fields.number(key).value_or(0);
  if (!(value >= 0 && value < 60)) fields.fail(key, "is not a duration in seconds");
  return value;
}

}  // namespace takt
