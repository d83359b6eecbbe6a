// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rigid.h"

#include <sstream>
#include <stdexcept>

namespace takt {

Mat4 Rigid::matrix() const {
  Mat4 m = Mat4::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Rigid Rigid::from_matrix(const Mat4& m) {
  constexpr double rounding = 1e-3;  // files often carry four digits
  const Mat3 r = m.topLeftCorner<3, 3>();
  const bool orthonormal = (r * r.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < rounding;
  const bool homogeneous = (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-9;
  if (!orthonormal || !(r.determinant() > 0) || !homogeneous || !m.allFinite()) {
    std::ostringstream text;
    text << "Rigid::from_matrix: not a rigid transform:\n" << m;
    throw std::invalid_argument(text.str());
  }
  // The closest rotation: Kabsch with the matrix as its own correlation.
  return {Quat(align_vectors(r).rotation).normalized(), m.topRightCorner<3, 1>()};
}

}  // namespace takt
