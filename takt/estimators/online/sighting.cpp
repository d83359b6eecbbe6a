// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/sighting.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace takt::online {

namespace {

/// Where a landmark stands against a camera, up to a positive factor.
struct Ray {
  Vec3 in_camera;  ///< q
  Mat3 R_cam_imu;
  Mat3 R_imu_world;  ///< at the row
  Vec3 from_imu;     ///< R_imu_world·(direction + ρ·(origin − p)), so q = R_cam_imu·(from_imu − ρ·p_imu_cam)
  Vec3 by_inverse_distance;  ///< dq/dρ
  ReadoutMotion::Moved moved;
};

Ray ray(const Sighting& z, const Quat& R_clone, const Vec3& p_clone, const Clone& clone, const Extrinsics& x,
        double line_delay_s, const Landmark& l) {
  Ray out;
  Mat3 R = R_clone.toRotationMatrix();
  Vec3 p = p_clone;
  if (!clone.readout.empty()) {
    out.moved = clone.readout.at(line_delay_s * z.rows_from_middle);
    R = R * out.moved.turn;
    p += out.moved.shift;
  }
  out.R_imu_world = R.transpose();
  out.R_cam_imu = x.R_imu_cam.transpose();
  out.from_imu = out.R_imu_world * (l.direction + l.inverse_distance * (l.origin - p));
  out.in_camera = out.R_cam_imu * (out.from_imu - l.inverse_distance * x.p_imu_cam);
  out.by_inverse_distance = out.R_cam_imu * (out.R_imu_world * (l.origin - p) - x.p_imu_cam);
  return out;
}

/// Derivative of misfit·q/|q| to q.
Mat2x3 misfit_slope(const Sighting& z, const Vec3& q) {
  const double length = q.norm();
  const Vec3 unit = q / length;
  return (z.misfit - (z.misfit * unit) * unit.transpose()) / length;
}

bool in_front(const Sighting& z, const Vec3& q) {
  return z.bearing.dot(q) > 0.1 * q.norm();
}

}  // namespace

std::optional<Sighting> see(const CameraModel& model, const Vec2& pixel) {
  const auto b = model.bearing(pixel);
  const auto right = model.bearing(pixel + Vec2(0.5, 0)), left = model.bearing(pixel - Vec2(0.5, 0));
  const auto below = model.bearing(pixel + Vec2(0, 0.5)), above = model.bearing(pixel - Vec2(0, 0.5));
  if (!b || !right || !left || !below || !above) return std::nullopt;
  const auto tangent = tangents(*b);
  Eigen::Matrix2d per_pixel;
  per_pixel.col(0) = tangent.transpose() * (*right - *left);
  per_pixel.col(1) = tangent.transpose() * (*below - *above);
  if (!(std::abs(per_pixel.determinant()) > 1e-14)) return std::nullopt;
  Sighting z;
  z.bearing = *b;
  z.misfit = per_pixel.inverse() * tangent.transpose();
  z.rows_from_middle = pixel.y() - 0.5 * (model.height - 1);
  z.from_centre = {(pixel.x() - model.cx) / model.fx, (pixel.y() - model.cy) / model.fy};
  return z;
}

Mat2x4 to_intrinsics(const Sighting& z) {
  Mat2x4 out;
  out << z.from_centre.x(), 0, 1, 0, 0, z.from_centre.y(), 0, 1;
  return out;
}

ReadoutMotion::ReadoutMotion(const ImuHistory& imu, const Motion& middle, double t_s, double half_s) {
  constexpr double longest_step_s = 2e-3;
  const int half_steps = std::max(1, static_cast<int>(std::ceil(half_s / longest_step_s)));
  step_s_ = half_s / half_steps;
  first_s_ = -half_s;
  knots_.resize(static_cast<std::size_t>(2 * half_steps + 1));
  for (const int direction : {1, -1}) {
    Motion m = middle;
    for (int k = 0; k <= half_steps; ++k) {
      const double s = direction * k * step_s_;
      if (k > 0) m = carried(m, imu, t_s + s - direction * step_s_, t_s + s);
      knots_[static_cast<std::size_t>(half_steps + direction * k)] = {
          log_so3(middle.R.conjugate() * m.R), m.p - middle.p, imu.at(t_s + s).gyro - m.gyro_bias, m.v};
    }
  }
}

ReadoutMotion::Moved ReadoutMotion::at(double s) const {
  const double place = std::clamp((s - first_s_) / step_s_, 0.0, static_cast<double>(knots_.size()) - 1 - 1e-9);
  const auto j = static_cast<std::size_t>(place);
  const double u = place - static_cast<double>(j);
  const Knot &a = knots_[j], &b = knots_[j + 1];
  const auto mix = [u](const Vec3& x, const Vec3& y) -> Vec3 { return x + u * (y - x); };
  return {exp_so3(mix(a.turn, b.turn)).toRotationMatrix(), mix(a.shift, b.shift), mix(a.rate, b.rate),
          mix(a.velocity, b.velocity)};
}

Eigen::Matrix<double, 3, 2> tangents(const Vec3& direction) {
  int least = 0;
  direction.cwiseAbs().minCoeff(&least);
  Eigen::Matrix<double, 3, 2> t;
  t.col(0) = direction.cross(Vec3::Unit(least)).normalized();
  t.col(1) = direction.cross(t.col(0)).normalized();
  return t;
}

std::optional<Vec2> residual(const Sighting& z, const Clone& clone, const Extrinsics& x, double line_delay_s,
                             const Landmark& l) {
  const Vec3 q = ray(z, clone.R, clone.p, clone, x, line_delay_s, l).in_camera;
  if (!in_front(z, q)) return std::nullopt;
  return z.misfit * q.normalized();
}

std::optional<Observed> observe(const Sighting& z, const Clone& clone, const Extrinsics& x, double line_delay_s,
                                const Landmark& l, bool first) {
  const auto now = residual(z, clone, x, line_delay_s, l);
  if (!now) return std::nullopt;
  const Ray at = first ? ray(z, clone.R_first, clone.p_first, clone, x, line_delay_s, l)
                       : ray(z, clone.R, clone.p, clone, x, line_delay_s, l);
  const Mat2x3 slope = misfit_slope(z, at.in_camera);
  const Mat2x3 to_imu = slope * at.R_cam_imu;
  const double rho = l.inverse_distance;
  Observed o;
  o.residual = *now;
  const Mat2x3 to_theta = to_imu * hat(at.from_imu);
  const Mat2x3 to_p = -rho * to_imu * at.R_imu_world;
  o.pose.leftCols<3>() = to_theta;
  o.pose.rightCols<3>() = to_p;
  o.line_delay.setZero();
  if (!clone.readout.empty()) {
    o.pose.leftCols<3>() = to_theta * at.moved.turn.transpose();
    o.line_delay = z.rows_from_middle * (to_theta * at.moved.rate + to_p * at.moved.velocity);
  }
  o.extrinsics.leftCols<3>() = slope * hat(at.in_camera);
  o.extrinsics.rightCols<3>() = -rho * to_imu;
  const Mat2x3 to_world = to_imu * at.R_imu_world;
  o.landmark.leftCols<2>() = to_world * tangents(l.direction);
  o.landmark.col(2) = slope * at.by_inverse_distance;
  return o;
}

std::optional<Landmark> triangulate(std::span<const SeenFrom> seen, double* rms_px, Mat3* covariance) {
  if (seen.size() < 2) return std::nullopt;
  const SeenFrom& anchor = seen[seen.size() / 2];
  Landmark l;
  {
    const Mat3 R = anchor.clone->R.toRotationMatrix();
    Mat3 R_row = R;
    Vec3 p_row = anchor.clone->p;
    if (!anchor.clone->readout.empty()) {
      const auto moved = anchor.clone->readout.at(anchor.line_delay_s * anchor.sighting->rows_from_middle);
      R_row = R * moved.turn, p_row += moved.shift;
    }
    l.origin = p_row + R_row * anchor.extrinsics->p_imu_cam;
    l.direction = R_row * (anchor.extrinsics->R_imu_cam * anchor.sighting->bearing);
  }
  // The inverse distance alone first: the residual is linear in it but for the scale of q.
  double up = 0, down = 0;
  for (const SeenFrom& s : seen) {
    const Ray r = ray(*s.sighting, s.clone->R, s.clone->p, *s.clone, *s.extrinsics, s.line_delay_s, l);
    const Vec2 here = s.sighting->misfit * r.in_camera, by = s.sighting->misfit * r.by_inverse_distance;
    up -= here.dot(by), down += by.squaredNorm();
  }
  if (down > 0) l.inverse_distance = up / down;

  struct Normals {
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    double cost = 0;
  };
  const auto normals_at = [&seen](const Landmark& at) -> std::optional<Normals> {
    Normals n;
    for (const SeenFrom& s : seen) {
      const auto o = observe(*s.sighting, *s.clone, *s.extrinsics, s.line_delay_s, at, false);
      if (!o) return std::nullopt;
      n.A += o->landmark.transpose() * o->landmark;
      n.b -= o->landmark.transpose() * o->residual;
      n.cost += o->residual.squaredNorm();
    }
    return n;
  };
  auto here = normals_at(l);
  if (!here) {
    l.inverse_distance = 0;  // infinitely far is in front of all that saw it
    here = normals_at(l);
  }
  if (!here) return std::nullopt;
  double damping = 1e-4;
  for (int round = 0; round < 10; ++round) {
    Mat3 A = here->A;
    A.diagonal() += damping * here->A.diagonal() + Vec3::Constant(1e-9);
    const Vec3 step = A.ldlt().solve(here->b);
    Landmark next = l;
    next.direction = (l.direction + tangents(l.direction) * step.head<2>()).normalized();
    next.inverse_distance += step[2];
    const auto there = normals_at(next);
    if (!there || there->cost > here->cost) {
      damping *= 10;
      continue;
    }
    const bool settled = here->cost - there->cost < 1e-3 + 1e-4 * there->cost;
    l = next, here = there, damping *= 0.1;
    if (settled) break;
  }
  if (rms_px) *rms_px = std::sqrt(here->cost / (2.0 * static_cast<double>(seen.size())));
  if (covariance) *covariance = (here->A + 1e-9 * here->A.trace() * Mat3::Identity()).inverse();
  return l;
}

void project_out(Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, 3>> landmark, Eigen::Ref<Eigen::MatrixXd> states,
                 Eigen::Ref<Eigen::VectorXd> residual) {
  const Eigen::Index rows = landmark.rows();
  // Householder's reflections that make `landmark` upper triangular, applied to the rest.
  for (Eigen::Index c = 0; c < 3; ++c) {
    Eigen::VectorXd v = landmark.col(c).tail(rows - c);
    const double length = v.norm();
    if (!(length > 0)) continue;
    v[0] += v[0] < 0 ? -length : length;
    const double scale = 2 / v.squaredNorm();
    const auto reflect = [&](auto&& block) {
      const Eigen::RowVectorXd along = scale * (v.transpose() * block);
      block.noalias() -= v * along;
    };
    reflect(landmark.bottomRightCorner(rows - c, 3 - c));
    reflect(states.bottomRows(rows - c));
    residual.tail(rows - c) -= (scale * v.dot(residual.tail(rows - c))) * v;
  }
}

}  // namespace takt::online
