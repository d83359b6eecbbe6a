// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/step_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <future>

#include "takt/estimators/alignment/readout_turn.h"
#include "takt/math/median.h"

namespace takt::alignment {

namespace {

/// A steady camera's increments may claim more than any model of the world can keep; no claim beyond this counts.
constexpr double information_ceiling = 1e14;
/// How far a pair's own best rotation and readout are looked for around what is predicted. Where its matches fix them
/// better than this, the prediction has no say in the weights.
constexpr double own_rotation_rad = 0.01, own_readout_s = 3e-3;

Mat3 symmetric_root(const Mat3& m) {
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(m);
  const Vec3 roots = eigen.eigenvalues().cwiseMax(0).cwiseMin(information_ceiling).cwiseSqrt();
  return eigen.eigenvectors() * roots.asDiagonal() * eigen.eigenvectors().transpose();
}

/// Adds white noise of variance `s` per axis to an information matrix that may be singular: (Λ⁻¹ + s·I)⁻¹.
Mat3 with_noise(const Mat3& information, double s) {
  return information * (Mat3::Identity() + s * information).inverse();
}

/// d (gain·φ) / d (xx, yy, zz, xy, xz, yz). To first order in φ this is also how the prediction turns.
Eigen::Matrix<double, 3, 6> by_gain(const Vec3& phi) {
  Eigen::Matrix<double, 3, 6> j;
  j << phi.x(), 0, 0, phi.y(), phi.z(), 0,  //
      0, phi.y(), 0, phi.x(), 0, phi.z(),   //
      0, 0, phi.z(), 0, phi.x(), phi.y();
  return j;
}

template <class Do>
void on_both_cores(std::size_t count, std::size_t stride, const Do& work) {
  constexpr std::size_t block = 32;
  const auto run = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      if ((i / block) % stride == 0) work(i);
  };
  const std::size_t half = count / 2;
  if (count < 256) return run(0, count);
  auto second = std::async(std::launch::async, run, half, count);
  run(0, half);
  second.get();
}

}  // namespace

std::vector<Item> items_of(const Problem& problem, bool bearings) {
  std::vector<Item> items;
  if (bearings)
    for (const PairStep& p : problem.pairs) items.push_back({p.t0, p.t1, nullptr, p.matches});
  else
    for (const Step& s : problem.steps) items.push_back({s.t0, s.t1, &s, nullptr});
  return items;
}

StepModel::StepModel(const Problem& problem, const LikelihoodOptions& options)
    : problem_(problem),
      options_(options),
      gyro_(&problem.reference),
      gyro_density_(problem.reference.noise_density()) {}

void StepModel::remove_bias(const Vec3& bias) {
  std::vector<Vec3> rates(problem_.reference.rates().begin(), problem_.reference.rates().end());
  for (Vec3& w : rates) w -= bias;
  const auto times = problem_.reference.times_s();
  unbiased_.emplace(std::vector<double>(times.begin(), times.end()), std::move(rates));
  gyro_ = &*unbiased_;
  removed_ = bias;
}

std::optional<StepModel::Prediction> StepModel::predict(const Item& item, const Parameters& x) const {
  Prediction p;
  p.since0 = item.t0 - x.centre_s, p.since1 = item.t1 - x.centre_s;
  p.t0 = item.t0 + x.offset_s + x.drift * p.since0, p.t1 = item.t1 + x.offset_s + x.drift * p.since1;
  const GyroCurve& gyro = *gyro_;
  if (!gyro.covers(p.t0, p.t1)) return std::nullopt;
  const Vec3 bias_left = x.bias - removed_;
  const Quat seen = gyro.between(p.t0, p.t1);
  // The bias turns the prediction by −Jr(φ)·Δt·b; exact for a constant rate, and the bias is small.
  p.by_bias = right_jacobian(log_so3(seen)) * (p.t1 - p.t0);
  const Quat unbiased = seen * exp_so3(-p.by_bias * bias_left);
  p.back = unbiased.toRotationMatrix().transpose();
  p.w0 = gyro.rate(p.t0) - bias_left, p.w1 = gyro.rate(p.t1) - bias_left;
  p.turned = x.R_reference_sensor.transpose() * log_so3(unbiased);
  p.turn = exp_so3(p.turned + x.gain * p.turned);
  return p;
}

Linear StepModel::linearise(const Item& item, const Parameters& x, const MatchWeights* settled) const {
  Linear out;
  const auto p = predict(item, x);
  if (!p) return out;
  const Mat3 to_sensor = x.R_reference_sensor.transpose();
  Mat3 information;
  if (item.step) {
    out.rows.col(unknowns) = log_so3(p->turn.conjugate() * exp_so3(item.step->apparent));
    // An apparent rotation does not tell rotation from translation: what is claimed of its axes says nothing of it.
    information =
        problem_.pairs.empty() ? item.step->information : Mat3(item.step->information.trace() / 3 * Mat3::Identity());
  } else if (!compare_bearings(item, *p, x, settled, out, information)) {
    return out;
  }
  out.rows.col(offset) = to_sensor * (p->w1 - p->back * p->w0);
  out.rows.col(drift) = to_sensor * (p->since1 * p->w1 - p->since0 * (p->back * p->w0));
  // R_reference_sensor ← R·exp(θ): the prediction P becomes P·exp(θ − Pᵀ·θ).
  out.rows.middleCols<3>(rotation) = Mat3::Identity() - p->turn.toRotationMatrix().transpose();
  out.rows.middleCols<3>(bias) = -to_sensor * p->by_bias;
  out.rows.middleCols<6>(gain) = by_gain(p->turned);
  out.root = symmetric_root(with_noise(
      information, gyro_density_ * gyro_density_ * (p->t1 - p->t0) + relative_variance_ * p->turned.squaredNorm()));
  out.predicted = log_so3(p->turn);
  out.moved = gyro_->attitude(p->t0) * (x.R_reference_sensor * out.parallax);
  out.used = true;
  return out;
}

StepModel::Seen StepModel::see(const Item& item, const Prediction& predicted, const Quat& turn, const Parameters& x,
                               double readout_s) const {
  const std::vector<BearingMatch>& matches = *item.matches;
  const auto n = static_cast<Eigen::Index>(matches.size());
  Seen seen{{Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n), {}, {}}, {}};
  const double stretch = std::exp(-options_.log_focal);
  const auto refocus = [&](const Eigen::Vector3f& b) {
    return Vec3(b.x() * stretch, b.y() * stretch, b.z()).normalized();
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    seen.pairs.from.col(i) = refocus(matches[static_cast<std::size_t>(i)].from);
    seen.pairs.to.col(i) = refocus(matches[static_cast<std::size_t>(i)].to);
  }
  if (readout_s == 0 && !options_.readout) return seen;

  seen.pairs.parallax_scale.resize(n), seen.pairs.parallax_extra.resize(3, n);
  if (options_.readout) seen.shear.resize(3, n);
  const Vec3 bias_left = x.bias - removed_;
  const double first = problem_.signal.timing.row == RowReference::first ? 0 : -0.5;
  const ReadoutTurn from(*gyro_, predicted.t0, readout_s, first, bias_left, x.R_reference_sensor);
  const ReadoutTurn to(*gyro_, predicted.t1, readout_s, first, bias_left, x.R_reference_sensor);
  const Mat3 R = turn.toRotationMatrix();
  // Over the pair as a whole its way is what the bearings say; how it goes on while the rows are read is the curve's.
  const Mat3 to_from = (gyro_->attitude(predicted.t0).toRotationMatrix() * x.R_reference_sensor).transpose();
  const double length = item.t1 - item.t0;
  const Vec3 whole = way_.between(item.t0, item.t1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BearingMatch& m = matches[static_cast<std::size_t>(i)];
    const double share = (m.row_to - m.row_from) * readout_s / length;
    const Mat3 E0 = exp_so3(from.turned(m.row_from)).toRotationMatrix(),
               E1 = exp_so3(to.turned(m.row_to)).toRotationMatrix();
    const Vec3 way =
        way_.between(item.t1, item.t1 + m.row_to * readout_s) - way_.between(item.t0, item.t0 + m.row_from * readout_s);
    seen.pairs.parallax_scale[i] = 1 + share;
    seen.pairs.parallax_extra.col(i) = to_from * (way - share * whole);
    seen.pairs.from.col(i) = E0 * Vec3(seen.pairs.from.col(i));
    seen.pairs.to.col(i) = E1 * Vec3(seen.pairs.to.col(i));
    if (!options_.readout) continue;
    const Vec3 d0 = m.row_from * from.rate(m.row_from), d1 = m.row_to * to.rate(m.row_to);
    seen.shear.col(i) = d0.cross(Vec3(seen.pairs.from.col(i))) - R * d1.cross(Vec3(seen.pairs.to.col(i)));
  }
  return seen;
}

TwoViewOptions StepModel::two_view() const {
  TwoViewOptions options;
  options.measure_nearness = true;
  options.parallax_mean = parallax_.mean;
  options.parallax_information = parallax_.information;
  return options;
}

std::optional<MatchWeights> StepModel::settle(const Item& item, const Parameters& x) const {
  if (!item.matches) return std::nullopt;
  const auto predicted = predict(item, x);
  if (!predicted) return std::nullopt;
  Quat turn = predicted->turn;
  double readout_s = x.readout_s;
  std::optional<MatchWeights> weights;
  for (int pass = 0; pass < 4; ++pass) {
    const Seen seen = see(item, *predicted, turn, x, readout_s);
    const TwoViewOptions expected = two_view();
    weights = weigh_matches(seen.pairs, turn, expected);
    if (!weights) return std::nullopt;
    TwoViewNormals n = two_view_normals(seen.pairs, turn, *weights, seen.extra(), expected);
    n.information.diagonal().head<3>().array() += 1 / (own_rotation_rad * own_rotation_rad);
    n.gradient.head<3>() -= log_so3(predicted->turn.conjugate() * turn) / (own_rotation_rad * own_rotation_rad);
    if (options_.readout) {
      n.information(3, 3) += 1 / (own_readout_s * own_readout_s);
      n.gradient[3] -= (readout_s - x.readout_s) / (own_readout_s * own_readout_s);
    }
    const Eigen::VectorXd step = n.information.ldlt().solve(n.gradient);
    if (!step.allFinite()) break;
    turn = turn * exp_so3(step.head<3>());
    if (options_.readout) readout_s += step[3];
  }
  return weights;
}

/// The residual rotation of a pair and its information.
bool StepModel::compare_bearings(const Item& item, const Prediction& predicted, const Parameters& x,
                                 const MatchWeights* settled, Linear& out, Mat3& information) const {
  const Seen seen = see(item, predicted, predicted.turn, x, x.readout_s);
  const TwoViewOptions expected = two_view();
  const auto fresh = settled ? std::nullopt : weigh_matches(seen.pairs, predicted.turn, expected);
  if (!settled && !fresh) return false;
  const TwoViewNormals normals =
      two_view_normals(seen.pairs, predicted.turn, settled ? *settled : *fresh, seen.extra(), expected);
  out.parallax = normals.parallax;
  information = normals.information.topLeftCorner<3, 3>();
  if (!(information.determinant() > 0)) return false;
  const Mat3 inverse = information.inverse();
  out.rows.col(unknowns) = inverse * normals.gradient.head<3>();
  if (options_.readout) {
    // Split the joint information into the rotation's residual, which moves with the readout by its column, and what is
    // left for the readout once the rotation is free.
    const Vec3 cross = normals.information.topRightCorner<3, 1>();
    const Vec3 by_readout = inverse * cross;
    out.rows.col(readout) = by_readout;
    out.readout_information = normals.information(3, 3) - cross.dot(by_readout);
    out.readout_gradient = normals.gradient[3] - by_readout.dot(normals.gradient.head<3>());
  }
  return true;
}

Eigen::Matrix3Xd StepModel::by_match(const Item& item, const Parameters& x, const MatchWeights& settled) const {
  const auto predicted = predict(item, x);
  if (!item.matches || !predicted) return {};
  const Seen seen = see(item, *predicted, predicted->turn, x, x.readout_s);
  TwoViewOptions expected = two_view();
  expected.each_match = true;
  const TwoViewNormals normals = two_view_normals(seen.pairs, predicted->turn, settled, seen.extra(), expected);
  return normals.information.topLeftCorner<3, 3>().inverse() * normals.each.topRows<3>();
}

void Items::settle(const StepModel& model, const Parameters& x, std::size_t stride) {
  settled_.assign(all_.size(), std::nullopt);
  on_both_cores(all_.size(), stride, [&](std::size_t i) { settled_[i] = model.settle(all_[i], x); });
}

std::vector<Linear> Items::linearise(const StepModel& model, const Parameters& x, std::size_t stride) const {
  std::vector<Linear> out(all_.size());
  on_both_cores(all_.size(), stride, [&](std::size_t i) {
    const MatchWeights* settled = settled_.empty() || !settled_[i] ? nullptr : &*settled_[i];
    out[i] = model.linearise(all_[i], x, settled);
  });
  for (std::size_t i = 0; i < all_.size(); ++i)
    out[i].first = i == 0 || !out[i - 1].used || std::abs(all_[i].t0 - all_[i - 1].t1) > 1e-6;
  return out;
}

std::vector<Eigen::Matrix3Xd> Items::by_match(const StepModel& model, const Parameters& x) const {
  std::vector<Eigen::Matrix3Xd> out(all_.size());
  on_both_cores(all_.size(), 1, [&](std::size_t i) {
    if (i < settled_.size() && settled_[i]) out[i] = model.by_match(all_[i], x, *settled_[i]);
  });
  return out;
}

CameraWay Items::way(const std::vector<Linear>& linear) const {
  std::vector<WayPiece> pieces;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (!linear[i].used) continue;
    pieces.push_back({all_[i].t0, all_[i].t1, linear[i].moved});
    lengths.push_back(all_[i].t1 - all_[i].t0);
  }
  return pieces.empty() ? CameraWay() : CameraWay(pieces, median(std::move(lengths)));
}

double Items::overlap() const {
  double first = all_.front().t0, last = all_.front().t1, length = 0;
  for (const Item& i : all_) first = std::min(first, i.t0), last = std::max(last, i.t1), length += i.t1 - i.t0;
  return last > first ? std::max(1.0, length / (last - first)) : 1;
}

}  // namespace takt::alignment
