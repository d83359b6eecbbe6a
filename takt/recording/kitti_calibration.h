// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/camera_model.h"

/// KITTI's calibration files: one `name: numbers` a line.
namespace takt {

class KittiFields {
 public:
  /// Empty fields from an empty text.
  KittiFields(std::string_view text, std::string where);

  /// The numbers of a line; nothing where there is no such line.
  /// Throws takt::Error with file and line where they are not `count` finite numbers.
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& name, std::size_t count) const;
  /// From 9 numbers by rows; nothing where there is no such line. Throws takt::Error where it is no rotation, to 1e-3.
  [[nodiscard]] std::optional<Mat3> rotation(const std::string& name) const;
  /// 4×4 from a rotation and a translation (3 numbers, m); nothing where either is missing.
  [[nodiscard]] std::optional<Mat4> transform(const std::string& rotation, const std::string& translation) const;

 private:
  struct Line {
    std::string_view text;
    std::size_t number;
  };
  [[noreturn]] void fail(const std::string& name, const std::string& problem) const;

  std::string text_;
  std::string where_;
  std::map<std::string, Line, std::less<>> lines_;
};

/// One camera of calib_cam_to_cam.txt, for pictures of a size: those as they were taken (S, K, D) or those that KITTI
/// rectified (S_rect, P_rect).
struct KittiCamera {
  CameraModel model;
  std::optional<Mat4> T_cam_cam0;  ///< takes points of the first camera, unrectified, to this one
  std::string note;                ///< which of the two, and what was assumed
};
/// `number` as in the file: "02". Nothing where the file does not have the camera or its pictures have another size.
[[nodiscard]] std::optional<KittiCamera> kitti_camera(const KittiFields& cam_to_cam, const std::string& number,
                                                      int width, int height);

}  // namespace takt
