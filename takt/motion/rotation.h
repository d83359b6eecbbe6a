// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace takt {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;
using Quat = Eigen::Quaterniond;

/// hat(a)·b = a × b.
[[nodiscard]] Mat3 hat(const Vec3& a);

/// SO(3) exponential of a rotation vector (rad) and its inverse; `log` returns angles in [0, π].
/// Both are accurate to rounding at and near zero, and `log` near π.
[[nodiscard]] Quat exp_so3(const Vec3& phi);
[[nodiscard]] Vec3 log_so3(const Quat& q);

/// Right Jacobian: exp(φ + δ) ≈ exp(φ)·exp(Jr(φ)·δ), and its inverse: log(exp(φ)·exp(δ)) ≈ φ + Jr⁻¹(φ)·δ.
[[nodiscard]] Mat3 right_jacobian(const Vec3& phi);
[[nodiscard]] Mat3 right_jacobian_inverse(const Vec3& phi);

/// exp_so3 and right_jacobian together, for the price of one sine and cosine.
struct ExpAndJacobian {
  Quat rotation;
  Mat3 right_jacobian;
};
[[nodiscard]] ExpAndJacobian exp_and_jacobian(const Vec3& phi);

/// A rotation with R·a_i ≈ b_i, in the least-squares sense over the weighted pairs (Wahba's problem, by SVD as
/// [Kabsch1976]). `spread` is the second singular value over the first: near 0 when all vectors are parallel and the
/// rotation about them is unknown.
struct VectorAlignment {
  Mat3 rotation;
  double spread;
};
[[nodiscard]] VectorAlignment align_vectors(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);
/// The same from the 3×3 correlation Σ b·aᵀ.
[[nodiscard]] VectorAlignment align_vectors(const Mat3& correlation);

}  // namespace takt
