// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kitti_calibration.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/third_radial.h"

namespace takt {

namespace {

using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

std::vector<std::string_view> words_of(std::string_view text) {
  constexpr std::string_view blanks = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(blanks, end);
  }
  return words;
}

Mat4 rigid(const Mat3& rotation, const Vec3& translation) {
  Mat4 out = Mat4::Identity();
  out.topLeftCorner<3, 3>() = rotation;
  out.topRightCorner<3, 1>() = translation;
  return out;
}

bool has_size(const std::optional<std::vector<double>>& size, int width, int height) {
  return size && (*size)[0] == width && (*size)[1] == height;
}

std::optional<KittiCamera> as_taken(const KittiFields& f, const std::string& number, int width, int height) {
  const auto k = f.numbers("K_" + number, 9);
  const auto d = f.numbers("D_" + number, 5);
  if (!k || !d || !((*k)[0] > 0) || !((*k)[4] > 0)) return std::nullopt;
  KittiCamera out;
  out.model = {.width = width, .height = height, .fx = (*k)[0], .fy = (*k)[4], .cx = (*k)[2], .cy = (*k)[5]};
  out.model.distortion = Distortion::radtan;
  std::copy_n(d->begin(), 4, out.model.coeffs.begin());
  out.note = "pictures as they were taken: K and D are used";
  if (const double rest = fold_third_radial(out.model, (*d)[4]); rest > 0)
    out.note += fmt::format(", with k3 put into k1 and k2 (at most {:.2g} px off in a corner)", rest);
  out.T_cam_cam0 = f.transform("R_" + number, "T_" + number);
  return out;
}

std::optional<KittiCamera> rectified(const KittiFields& f, const std::string& number, int width, int height) {
  const auto p = f.numbers("P_rect_" + number, 12);
  if (!p || !((*p)[0] > 0) || !((*p)[5] > 0)) return std::nullopt;
  const std::vector<double>& P = *p;
  KittiCamera out;
  out.model = {.width = width, .height = height, .fx = P[0], .fy = P[5], .cx = P[2], .cy = P[6]};
  out.note = "rectified pictures: P_rect is used";
  // P = K [I | t] before R_rect_00, which turns the first camera into the common rectified frame.
  const auto turn = f.rotation("R_rect_00");
  if (!turn) return out;
  const Vec3 t((P[3] - P[2] * P[11]) / P[0], (P[7] - P[6] * P[11]) / P[5], P[11]);
  out.T_cam_cam0 = rigid(*turn, t);
  return out;
}

}  // namespace

KittiFields::KittiFields(std::string_view text, std::string where) : text_(text), where_(std::move(where)) {
  std::size_t number = 0;
  for (std::size_t at = 0; at < text_.size();) {
    const std::size_t end = std::min(text_.find('\n', at), text_.size());
    const std::string_view line = std::string_view(text_).substr(at, end - at);
    ++number;
    at = end + 1;
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos)
      lines_.try_emplace(std::string(line.substr(0, colon)), Line{line.substr(colon + 1), number});
  }
}

std::optional<std::vector<double>> KittiFields::numbers(const std::string& name, std::size_t count) const {
  const auto found = lines_.find(name);
  if (found == lines_.end()) return std::nullopt;
  const auto words = words_of(found->second.text);
  if (words.size() != count) fail(name, fmt::format("has {} numbers, {} expected", words.size(), count));
  std::vector<double> out;
  for (const std::string_view word : words) {
    const auto value = finite_double(word);
    if (!value) fail(name, "is not a list of finite numbers");
    out.push_back(*value);
  }
  return out;
}

std::optional<Mat3> KittiFields::rotation(const std::string& name) const {
  const auto values = numbers(name, 9);
  if (!values) return std::nullopt;
  const Mat3 turn = RowMat3(values->data());
  if (!((turn * turn.transpose() - Mat3::Identity()).norm() < 1e-3) || turn.determinant() < 0)
    fail(name, "is not a rotation");
  return turn;
}

std::optional<Mat4> KittiFields::transform(const std::string& rotation_name, const std::string& translation) const {
  const auto turn = rotation(rotation_name);
  const auto t = numbers(translation, 3);
  if (!turn || !t) return std::nullopt;
  return rigid(*turn, Vec3(t->data()));
}

void KittiFields::fail(const std::string& name, const std::string& problem) const {
  throw Error(name + " " + problem, fmt::format("{}:{}", where_, lines_.find(name)->second.number),
              "take the calibration files of the same day from KITTI again");
}

std::optional<KittiCamera> kitti_camera(const KittiFields& cam_to_cam, const std::string& number, int width,
                                        int height) {
  if (width <= 0 || height <= 0) return std::nullopt;
  if (has_size(cam_to_cam.numbers("S_" + number, 2), width, height)) return as_taken(cam_to_cam, number, width, height);
  if (has_size(cam_to_cam.numbers("S_rect_" + number, 2), width, height))
    return rectified(cam_to_cam, number, width, height);
  return std::nullopt;
}

}  // namespace takt
