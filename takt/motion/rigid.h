// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/motion/rotation.h"

namespace takt {

/// A rigid transform. `T_a_b` takes points from frame b to frame a: p_a = T_a_b * p_b, T_a_c = T_a_b * T_b_c.
struct Rigid {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();  ///< m; the origin of b, seen in a

  [[nodiscard]] Vec3 operator*(const Vec3& p_b) const { return rotation * p_b + translation; }
  [[nodiscard]] Rigid operator*(const Rigid& T_b_c) const {
    return {rotation * T_b_c.rotation, *this * T_b_c.translation};
  }
  [[nodiscard]] Rigid inverse() const {
    const Quat back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  [[nodiscard]] Mat4 matrix() const;
  /// From a homogeneous matrix. Throws std::invalid_argument when its upper left block is no rotation (a reflection, a
  /// scale, numbers of fewer than about 4 digits) or its last row is not 0 0 0 1; smaller rounding is removed.
  [[nodiscard]] static Rigid from_matrix(const Mat4& m);
};

}  // namespace takt
