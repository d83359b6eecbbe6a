// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/apply/exports.h"

/// The pieces of text that exports share. YAML is written so that yaml-cpp, PyYAML and OpenCV's FileStorage all read
/// it: lists are indented deeper than their key, numbers have the fewest digits that read back the same.
namespace takt::export_text {

inline constexpr const char* opencv_head = "%YAML:1.0\n---\n";

/// Seconds with all nine decimals: exact to the nanosecond.
[[nodiscard]] std::string seconds(std::int64_t ns);
[[nodiscard]] std::string milliseconds(std::int64_t ns);  ///< likewise
[[nodiscard]] std::string number(double v);
[[nodiscard]] std::string list(const std::vector<double>& values);  ///< "[1, 0, 0]"
[[nodiscard]] std::vector<double> row_major(const Eigen::MatrixXd& m);
/// `key:` and four rows, `indent` blanks in front.
[[nodiscard]] std::string matrix_rows(const std::string& key, const Mat4& m, int indent);
/// `key: !!opencv-matrix`.
[[nodiscard]] std::string opencv_matrix(const std::string& key, const Eigen::MatrixXd& m, char type = 'd');
/// "cam0 is 3.177 ms early against imu0: "
[[nodiscard]] std::string offset_words(const CameraToImu& c);
/// camera_model, intrinsics, distortion, resolution in Kalibr's names; a comment where they are not known.
[[nodiscard]] std::string kalibr_camera(const CameraToImu& c, int indent);
/// A comment line where the mounting is a rotation alone; else nothing.
[[nodiscard]] std::string mounting_comment(const CameraToImu& c);
/// A comment line with what was found, for the head of a YAML file.
[[nodiscard]] std::string head_comment(const CameraToImu& c);

}  // namespace takt::export_text
