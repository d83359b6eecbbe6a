// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"

namespace takt {

/// Fields of a YAML file that may be there. A field of the wrong kind throws takt::Error with file and line.
/// OpenCV's "%YAML:1.0" header and matrices (rows, cols, data) are understood.
class YamlFields {
 public:
  /// Throws takt::Error where the text is no YAML map.
  YamlFields(std::string_view text, std::string where);
  ~YamlFields();
  YamlFields(YamlFields&&) noexcept;

  [[nodiscard]] bool has(const std::string& key) const;
  /// The map under `key`; empty fields where there is none.
  [[nodiscard]] YamlFields under(const std::string& key) const;
  [[nodiscard]] std::optional<double> number(const std::string& key) const;
  [[nodiscard]] std::optional<std::string> text(const std::string& key) const;
  [[nodiscard]] std::optional<std::vector<std::string>> texts(const std::string& key) const;
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& key) const;
  /// 4×4 as nested rows, a flat list of 16, or an OpenCV matrix. Its rotation must be one, to 1e-3.
  [[nodiscard]] std::optional<Mat4> transform(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;

 private:
  struct Node;
  YamlFields(std::unique_ptr<Node> node, std::string where);
  std::unique_ptr<Node> node_;
  std::string where_;
};

/// A camera from the keys of EuRoC's sensor.yaml or Kalibr's camchain: resolution, camera_model, intrinsics,
/// distortion_model, distortion_coefficients or distortion_coeffs. Nothing where there are no intrinsics; nothing and a
/// sentence in `note` where the model is one that takt does not have.
[[nodiscard]] std::optional<CameraModel> camera_model(const YamlFields& fields, std::string& note);

/// `stamp: start|middle|end`, and a duration (s) between 0 and a minute, 0 where it is not said.
[[nodiscard]] std::optional<ExposureInstant> exposure_instant(const YamlFields& fields);
[[nodiscard]] double duration_s(const YamlFields& fields, const std::string& key);

}  // namespace takt
