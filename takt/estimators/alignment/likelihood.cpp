// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/likelihood.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <optional>

#include "takt/motion/two_view.h"

namespace takt::alignment {

namespace {

// The unknowns, always in this order; those that are not asked for are held by a prior.
enum Unknown { offset, drift, rotation, bias = rotation + 3, gain = bias + 3, readout = gain + 6, unknowns };
using State = Eigen::Matrix<double, unknowns, 1>;
using Normal = Eigen::Matrix<double, unknowns, unknowns>;
using Rows = Eigen::Matrix<double, 3, unknowns + 1>;  ///< Jacobian, and the residual as its last column

/// How far the sensor's rotation may be from the gyro's by a linear map beside a rotation: scale and misalignment of a
/// gyro, an inexact focal length, a translation that goes with the rotation. Over a short recording such an error would
/// pass for an offset; held this loosely it widens the uncertainty instead.
constexpr double gain_sigma = 0.03;
/// Crystals differ by tens of ppm, cheap resonators by hundreds.
constexpr double drift_sigma = 1e-3;
/// No camera reads a frame more slowly than this or so (s).
constexpr double readout_sigma = 0.1;
constexpr double outlier_sigmas = 4;
/// Weight falls as 1/m⁴ beyond this many sigmas.
constexpr double robust_sigmas = 3;
/// A steady camera's increments may claim more than any model of the world can keep; no claim beyond this counts.
constexpr double information_ceiling = 1e14;

struct Parameters {
  double offset_s, drift, centre_s;
  Mat3 R_reference_sensor;
  Vec3 bias;
  Mat3 gain;  ///< symmetric; predicted rotation vectors are multiplied by I + gain, in the sensor's frame
  double readout_s;
};

/// What is compared with the gyro: a measured rotation, or the bearings of a pair of frames.
struct Item {
  double t0, t1;
  const Step* step;
  const std::vector<BearingMatch>* matches;
};

std::vector<Item> items_of(const Problem& problem, bool bearings) {
  std::vector<Item> items;
  if (bearings)
    for (const PairStep& p : problem.pairs) items.push_back({p.t0, p.t1, nullptr, p.matches});
  else
    for (const Step& s : problem.steps) items.push_back({s.t0, s.t1, &s, nullptr});
  return items;
}

/// One item at the current parameters: whitening not yet applied.
struct Linear {
  bool used = false;
  Vec3 predicted = Vec3::Zero();  ///< rotation, rad
  Vec3 parallax = Vec3::Zero();   ///< from bearings, given the predicted rotation
  bool first = true;              ///< no step directly before it
  Rows rows = Rows::Zero();       ///< residual = rows.last − rows.first · dx, claimed covariance `information`⁻¹
  Mat3 root = Mat3::Zero();       ///< symmetric root of the claimed information
  // What bearings say about the readout beyond the rotation.
  double readout_information = 0;
  double readout_gradient = 0;
};

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

class Model {
 public:
  Model(const Problem& problem, const LikelihoodOptions& options)
      : problem_(problem),
        options_(options),
        gyro_(&problem.reference),
        gyro_density_(problem.reference.noise_density()) {
    two_view_.measure_nearness = true;
  }

  /// Takes a known bias out of the rates themselves. To first order it would do to turn each prediction by the bias,
  /// but over a long step with a changing rate that is not enough.
  void remove_bias(const Vec3& bias) {
    std::vector<Vec3> rates(problem_.reference.rates().begin(), problem_.reference.rates().end());
    for (Vec3& w : rates) w -= bias;
    const auto times = problem_.reference.times_s();
    unbiased_.emplace(std::vector<double>(times.begin(), times.end()), std::move(rates));
    gyro_ = &*unbiased_;
    removed_ = bias;
  }

  void expect_parallax(const Vec3& mean, const Mat3& information) {
    two_view_.parallax_mean = mean;
    two_view_.parallax_information = information;
  }

  /// Errors that grow with the turn: variance per axis over the squared angle.
  void expect_relative_error(double variance) { relative_variance_ = variance; }

  [[nodiscard]] Linear linearise(const Item& item, const Parameters& x) const {
    Linear out;
    const double since0 = item.t0 - x.centre_s, since1 = item.t1 - x.centre_s;
    const double t0 = item.t0 + x.offset_s + x.drift * since0, t1 = item.t1 + x.offset_s + x.drift * since1;
    const GyroCurve& gyro = *gyro_;
    if (!gyro.covers(t0, t1)) return out;
    const Vec3 bias_left = x.bias - removed_;
    const Mat3 to_sensor = x.R_reference_sensor.transpose();
    const Quat seen = gyro.between(t0, t1);
    const double length = t1 - t0;
    // The bias turns the prediction by −Jr(φ)·Δt·b; exact for a constant rate, and the bias is small.
    const Mat3 by_bias = right_jacobian(log_so3(seen)) * length;
    const Quat unbiased = seen * exp_so3(-by_bias * bias_left);
    const Mat3 back = unbiased.toRotationMatrix().transpose();
    const Vec3 w0 = gyro.rate(t0) - bias_left, w1 = gyro.rate(t1) - bias_left;
    const Vec3 turned = to_sensor * log_so3(unbiased);
    const Quat predicted = exp_so3(turned + x.gain * turned);

    Vec3 residual;
    Mat3 information;
    Vec3 by_readout = Vec3::Zero();
    if (item.step) {
      residual = log_so3(predicted.conjugate() * exp_so3(item.step->apparent));
      // An apparent rotation does not tell rotation from translation: what is claimed of its axes says nothing of it.
      information =
          problem_.pairs.empty() ? item.step->information : Mat3(item.step->information.trace() / 3 * Mat3::Identity());
    } else {
      const Vec3 s0 = to_sensor * w0, s1 = to_sensor * w1;
      const Vec3 a0 = to_sensor * gyro.rate_slope(t0), a1 = to_sensor * gyro.rate_slope(t1);
      if (!bearings(*item.matches, predicted, {s0, s1, a0, a1}, item.t1 - item.t0, x, out, residual, information,
                    by_readout))
        return out;
    }
    out.rows.col(offset) = to_sensor * (w1 - back * w0);
    out.rows.col(drift) = to_sensor * (since1 * w1 - since0 * (back * w0));
    // R_reference_sensor ← R·exp(θ): the prediction P becomes P·exp(θ − Pᵀ·θ).
    out.rows.middleCols<3>(rotation) = Mat3::Identity() - predicted.toRotationMatrix().transpose();
    out.rows.middleCols<3>(bias) = -to_sensor * by_bias;
    out.rows.middleCols<6>(gain) = by_gain(turned);
    out.rows.col(readout) = by_readout;
    out.rows.col(unknowns) = residual;
    out.root = symmetric_root(
        with_noise(information, gyro_density_ * gyro_density_ * length + relative_variance_ * turned.squaredNorm()));
    out.predicted = log_so3(predicted);
    out.used = true;
    return out;
  }

 private:
  struct Rates {
    Vec3 w0, w1, slope0, slope1;  ///< sensor frame, at the two frames
  };

  /// d (gain·φ) / d (xx, yy, zz, xy, xz, yz). To first order in φ this is also how the prediction turns.
  static Eigen::Matrix<double, 3, 6> by_gain(const Vec3& phi) {
    Eigen::Matrix<double, 3, 6> j;
    j << phi.x(), 0, 0, phi.y(), phi.z(), 0,  //
        0, phi.y(), 0, phi.x(), 0, phi.z(),   //
        0, 0, phi.z(), 0, phi.x(), phi.y();
    return j;
  }

  /// The residual rotation of a pair and its information from its matches, each brought to its frame's reference row.
  bool bearings(const std::vector<BearingMatch>& matches, const Quat& predicted, const Rates& rates, double length,
                const Parameters& x, Linear& out, Vec3& residual, Mat3& information, Vec3& by_readout) const {
    const auto n = static_cast<Eigen::Index>(matches.size());
    BearingPairs pairs{Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n), {}};
    if (x.readout_s != 0) pairs.parallax_scale.resize(n);
    Eigen::Matrix3Xd shear;
    if (options_.readout) shear.resize(3, n);
    const Mat3 p = predicted.toRotationMatrix();
    const double stretch = std::exp(-options_.log_focal);
    const auto refocus = [&](const Eigen::Vector3f& b) {
      return Vec3(b.x() * stretch, b.y() * stretch, b.z()).normalized();
    };
    for (Eigen::Index i = 0; i < n; ++i) {
      const BearingMatch& m = matches[static_cast<std::size_t>(i)];
      const double dt0 = m.row_from * x.readout_s, dt1 = m.row_to * x.readout_s;
      pairs.from.col(i) = refocus(m.from);
      pairs.to.col(i) = refocus(m.to);
      if (x.readout_s != 0) {
        pairs.from.col(i) = exp_so3(dt0 * (rates.w0 + 0.5 * dt0 * rates.slope0)) * Vec3(pairs.from.col(i));
        pairs.to.col(i) = exp_so3(dt1 * (rates.w1 + 0.5 * dt1 * rates.slope1)) * Vec3(pairs.to.col(i));
        pairs.parallax_scale[i] = 1 + (dt1 - dt0) / length;
      }
      if (!options_.readout) continue;
      const Vec3 d0 = m.row_from * (rates.w0 + dt0 * rates.slope0), d1 = m.row_to * (rates.w1 + dt1 * rates.slope1);
      shear.col(i) = d0.cross(Vec3(pairs.from.col(i))) - p * d1.cross(Vec3(pairs.to.col(i)));
    }
    const std::span<const Eigen::Matrix3Xd> extra(&shear, options_.readout ? 1 : 0);
    const auto normals = two_view_normals(pairs, predicted, extra, two_view_);
    if (!normals) return false;
    out.parallax = normals->parallax;
    information = normals->information.topLeftCorner<3, 3>();
    if (!(information.determinant() > 0)) return false;
    const Mat3 inverse = information.inverse();
    residual = inverse * normals->gradient.head<3>();
    if (options_.readout) {
      // Split the joint information into the rotation's residual, which moves with the readout by `by_readout`, and
      // what is left for the readout once the rotation is free.
      const Vec3 cross = normals->information.topRightCorner<3, 1>();
      by_readout = inverse * cross;
      out.readout_information = normals->information(3, 3) - cross.dot(by_readout);
      out.readout_gradient = normals->gradient[3] - by_readout.dot(normals->gradient.head<3>());
    }
    return true;
  }

  const Problem& problem_;
  LikelihoodOptions options_;
  const GyroCurve* gyro_;
  std::optional<GyroCurve> unbiased_;
  Vec3 removed_ = Vec3::Zero();
  double gyro_density_;
  TwoViewOptions two_view_;
  double relative_variance_ = 0;
};

/// Lenses, misalignments and translation taken for rotation leave errors that grow with the turn. Measured where the
/// sensor turns most, beyond what is claimed for it there.
double relative_variance(const std::vector<Linear>& all, double scale, double before) {
  std::vector<double> turns;
  for (const Linear& l : all)
    if (l.used) turns.push_back(l.predicted.squaredNorm());
  if (turns.size() < 40) return before;
  const auto quarter = turns.begin() + static_cast<std::ptrdiff_t>(3 * turns.size() / 4);
  std::nth_element(turns.begin(), quarter, turns.end());
  const double most = *quarter;
  std::vector<double> excess;
  for (const Linear& l : all) {
    if (!l.used || l.predicted.squaredNorm() < most) continue;
    // The claimed part shrinks with whatever relative error is already allowed for, so put that back.
    const double claimed = scale * scale * 3 / std::max(1e-30, (l.root * l.root).trace() / 3) / 3;
    const double turn = l.predicted.squaredNorm();
    excess.push_back((l.rows.col(unknowns).squaredNorm() / 2.366 - std::max(0.0, claimed - before * turn)) / turn);
  }
  const auto mid = excess.begin() + static_cast<std::ptrdiff_t>(excess.size() / 2);
  std::nth_element(excess.begin(), mid, excess.end());
  return std::clamp(*mid, 0.0, 0.25);
}

/// What the recording as a whole says about the parallax of a pair: a car moves forward, a camera on a tripod not at
/// all. Rotation and sideways translation look alike in a narrow view, so this is worth much of the information. The
/// spread includes the noise and whatever an offset not yet found has turned into parallax, so it promises too little
/// rather than too much.
void expect_parallax(const std::vector<Linear>& all, Model& model) {
  std::vector<Vec3> seen;
  for (const Linear& l : all)
    if (l.used) seen.push_back(l.parallax);
  if (seen.size() < 30) return;
  Vec3 mean = Vec3::Zero();
  Mat3 covariance = Mat3::Identity() * 1e6;
  for (int pass = 0; pass < 8; ++pass) {
    // A heavy-tailed fit (Student t): stops and bursts are part of many recordings.
    constexpr double freedom = 3;
    Vec3 sum = Vec3::Zero();
    Mat3 squares = Mat3::Zero();
    double weights = 0;
    const Mat3 inverse = covariance.inverse();
    for (const Vec3& v : seen) {
      const double w = (freedom + 3) / (freedom + (v - mean).dot(inverse * (v - mean)));
      sum += w * v, weights += w;
      squares += w * (v - mean) * (v - mean).transpose();
    }
    mean = sum / weights;
    covariance = squares / static_cast<double>(seen.size()) + 1e-14 * Mat3::Identity();
  }
  // The spread of a Student t with three degrees of freedom is three times its scale matrix.
  model.expect_parallax(mean, (3 * covariance).inverse());
}

/// All items, on both cores; each step stands alone, so the result does not depend on the number of threads.
std::vector<Linear> linearise_all(const std::vector<Item>& items, const Model& model, const Parameters& x,
                                  std::size_t stride) {
  std::vector<Linear> out(items.size());
  constexpr std::size_t block = 32;  // with a stride, whole blocks are kept so that neighbours stay neighbours
  const auto run = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      if ((i / block) % stride == 0) out[i] = model.linearise(items[i], x);
  };
  const std::size_t half = items.size() / 2;
  if (items.size() < 256) {
    run(0, items.size());
  } else {
    auto second = std::async(std::launch::async, run, half, items.size());
    run(0, half);
    second.get();
  }
  for (std::size_t i = 0; i < items.size(); ++i)
    out[i].first = i == 0 || !out[i - 1].used || std::abs(items[i].t0 - items[i - 1].t1) > 1e-6;
  return out;
}

struct Normals {
  Normal h = Normal::Zero();
  State g = State::Zero();
  double squares = 0;  ///< of the whitened, weighted residuals
  double rows = 0;     ///< weighted count of them
};

double weight_of(double misfit) {
  const double r = misfit / robust_sigmas;
  return 1 / (1 + r * r * r * r);
}

/// Rms size of the residuals in claimed sigmas, by the median (χ²(3) has median 2.366).
double residual_scale(const std::vector<Linear>& all) {
  std::vector<double> m;
  for (const Linear& l : all)
    if (l.used) m.push_back((l.root * l.rows.col(unknowns)).squaredNorm());
  if (m.empty()) return 1;
  const auto mid = m.begin() + static_cast<std::ptrdiff_t>(m.size() / 2);
  std::nth_element(m.begin(), mid, m.end());
  return std::max(1e-9, std::sqrt(*mid / 2.366));
}

/// Visits every used step with its rows whitened in itself (claimed covariance), robustly weighted and whitened in
/// time.
template <class Visit>
void for_each_whitened(const std::vector<Linear>& all, const Arma11& errors, double scale, Visit&& visit) {
  Whitener<Rows> whiten(errors);
  bool broken = true;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Linear& l = all[i];
    if (!l.used) {
      broken = true;
      continue;
    }
    Rows rows = l.root * l.rows;
    const double misfit = rows.col(unknowns).norm() / (scale * std::sqrt(3.0));
    const double w = weight_of(misfit);
    rows *= std::sqrt(w);
    if (broken || l.first) whiten.restart();
    broken = false;
    visit(i, l, w, whiten(rows));
  }
}

Normals accumulate(const std::vector<Linear>& all, const Arma11& errors, double scale) {
  Normals n;
  for_each_whitened(all, errors, scale, [&](std::size_t, const Linear& l, double w, const Rows& rows) {
    const auto j = rows.leftCols<unknowns>();
    n.h.noalias() += j.transpose() * j;
    n.g.noalias() += j.transpose() * rows.col(unknowns);
    n.h(readout, readout) += w * l.readout_information;
    n.g[readout] += w * l.readout_gradient;
    n.squares += rows.col(unknowns).squaredNorm();
    n.rows += 3 * w;
  });
  return n;
}

/// Holds what is not asked for, lends a little stiffness to what the motion may not show (the rotation about the only
/// axis turned about), and pulls the gain towards none. `s2` is the variance that the normals take for one.
void add_priors(Normals& n, const LikelihoodOptions& options, const Parameters& x, double s2) {
  const double hold = 1e30;
  for (int k = 0; k < 3; ++k) n.h(rotation + k, rotation + k) += s2, n.h(bias + k, bias + k) += s2;
  n.h(drift, drift) += options.drift ? s2 / (drift_sigma * drift_sigma) : hold;
  n.h(readout, readout) += options.readout ? s2 / (readout_sigma * readout_sigma) : hold;
  const double stiffness = s2 / (gain_sigma * gain_sigma);
  const double now[6] = {x.gain(0, 0), x.gain(1, 1), x.gain(2, 2), x.gain(0, 1), x.gain(0, 2), x.gain(1, 2)};
  for (int k = 0; k < 6; ++k) {
    n.h(gain + k, gain + k) += stiffness;
    n.g[gain + k] -= stiffness * now[k];
  }
}

Arma11 measure_correlation(const std::vector<Linear>& all, double scale) {
  std::vector<std::vector<double>> stretches;
  std::size_t kept = 0;
  std::array<std::vector<double>, 3> current;
  const auto flush = [&] {
    for (auto& axis : current)
      if (axis.size() > 1) stretches.push_back(std::move(axis));
    current = {};
  };
  for (const Linear& l : all) {
    if (!l.used || l.first) flush();
    if (!l.used) continue;
    const Vec3 u = l.root * l.rows.col(unknowns) / scale;
    const double w = std::sqrt(weight_of(u.norm() / std::sqrt(3.0)));
    for (int k = 0; k < 3; ++k) current[static_cast<std::size_t>(k)].push_back(w * u[k]);
    // Some thousand steps fix two parameters to a few percent.
    if (++kept > 3000) break;
  }
  flush();
  return fit_arma11(stretches);
}

void step_by(Parameters& x, const State& dx) {
  x.offset_s += dx[offset];
  x.drift += dx[drift];
  x.R_reference_sensor = x.R_reference_sensor * exp_so3(dx.segment<3>(rotation)).toRotationMatrix();
  x.bias += dx.segment<3>(bias);
  const auto g = dx.segment<6>(gain);
  Mat3 more;
  more << g[0], g[3], g[4], g[3], g[1], g[5], g[4], g[5], g[2];
  x.gain += more;
  x.readout_s += dx[readout];
}

/// No step may leave the neighbourhood in which the linearisation means something.
State limited(State dx, double lobe_s) {
  double shrink = 1;
  const auto limit = [&](double value, double most) {
    if (std::abs(value) > most) shrink = std::min(shrink, most / std::abs(value));
  };
  limit(dx[offset], 0.5 * lobe_s);
  limit(dx.segment<3>(rotation).norm(), 0.3);
  limit(dx[readout], 0.02);
  limit(dx.segment<6>(gain).cwiseAbs().maxCoeff(), 0.1);
  return shrink * dx;
}

/// Share of the sensor's rotation that the prediction explains, and the outliers' share.
void judge(const std::vector<Linear>& all, double scale, LikelihoodFit& fit) {
  double squares = 0, total = 0, n = 0, outliers = 0;
  Vec3 mean = Vec3::Zero();
  for (const Linear& l : all)
    if (l.used) mean += l.predicted, n += 1;
  if (n == 0) return;
  mean /= n;
  for (const Linear& l : all) {
    if (!l.used) continue;
    const Vec3 residual = l.rows.col(unknowns);
    const double misfit = (l.root * residual).norm() / (scale * std::sqrt(3.0));
    if (misfit > outlier_sigmas) {
      outliers += 1;
      continue;
    }
    squares += residual.squaredNorm();
    total += (l.predicted + residual - mean).squaredNorm();
  }
  fit.used = static_cast<std::size_t>(n);
  fit.outliers = outliers / n;
  fit.explained = total > 0 ? 1 - squares / total : 0;
}

/// Offset alone from the items whose middle lies in [from, to), everything else held.
WindowOffset window_offset(const std::vector<Rows>& whitened, const std::vector<Item>& items, double from, double to,
                           double s2) {
  double h = 0, g = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double middle = 0.5 * (items[i].t0 + items[i].t1);
    if (middle < from || middle >= to) continue;
    h += whitened[i].col(offset).squaredNorm();
    g += whitened[i].col(offset).dot(whitened[i].col(unknowns));
  }
  const double t = 0.5 * (from + to);
  return h > 0 ? WindowOffset{t, g / h, std::sqrt(s2 / h)} : WindowOffset{t, 0, 0};
}

/// A whitened residual and when it was.
struct Timed {
  double t;
  Rows rows;
};

/// What whitening has left of correlation widens the offset's covariance: Σ over lags of the scores' autocovariance.
/// Scores are taken in order of time: interleaved chains look at the same scene over overlapping intervals, so what is
/// wrong with it (depths, moving things) is common to `overlap` of them.
double score_inflation(std::vector<Timed> whitened, const Normal& covariance_shape, double overlap) {
  std::stable_sort(whitened.begin(), whitened.end(), [](const Timed& a, const Timed& b) { return a.t < b.t; });
  // The offset's own score once the other unknowns are fitted.
  const State direction = covariance_shape.row(offset).transpose() / covariance_shape(offset, offset);
  std::vector<double> score;
  for (const Timed& w : whitened) score.push_back((w.rows.leftCols<unknowns>() * direction).dot(w.rows.col(unknowns)));
  double power = 0;
  for (const double s : score) power += s * s;
  if (power <= 0 || score.size() < 40) return 1;
  const double n = static_cast<double>(score.size());
  const auto lags =
      static_cast<std::size_t>(std::min(n / 5, std::max(2.5 * overlap, std::min(12.0, 1.5 * std::cbrt(n)))));
  double sum = power;
  for (std::size_t lag = 1; lag <= lags; ++lag) {
    double c = 0;
    for (std::size_t i = lag; i < score.size(); ++i) c += score[i] * score[i - lag];
    sum += 2 * (1 - static_cast<double>(lag) / static_cast<double>(lags + 1)) * c;
  }
  // The ratio itself scatters by some √(4·lags/3n); within that it is no evidence.
  const double ratio = sum / power;
  const double scatter = std::sqrt(4.0 * static_cast<double>(lags) / (3.0 * n));
  return ratio > 1 + scatter ? std::sqrt(ratio) : 1;
}

/// How many items run at the same time.
double overlap_of(const std::vector<Item>& items) {
  double first = items.front().t0, last = items.front().t1, length = 0;
  for (const Item& i : items) first = std::min(first, i.t0), last = std::max(last, i.t1), length += i.t1 - i.t0;
  return last > first ? std::max(1.0, length / (last - first)) : 1;
}

double largest_autocorrelation(const std::vector<Timed>& whitened) {
  double worst = 0, power = 0;
  for (const Timed& w : whitened) power += w.rows.col(unknowns).squaredNorm();
  if (power <= 0) return 0;
  for (std::size_t lag = 1; lag <= 8 && lag < whitened.size(); ++lag) {
    double c = 0;
    for (std::size_t i = lag; i < whitened.size(); ++i)
      c += whitened[i].rows.col(unknowns).dot(whitened[i - lag].rows.col(unknowns));
    worst = std::max(worst, std::abs(c / power) * std::sqrt(3 * static_cast<double>(whitened.size())));
  }
  return worst;
}

void keep_residuals(const std::vector<Item>& items, const std::vector<Linear>& all, LikelihoodFit& fit) {
  const std::size_t stride = std::max<std::size_t>(1, all.size() / 1500);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < all.size(); i += stride)
    if (all[i].used) kept.push_back(i);
  std::sort(kept.begin(), kept.end(), [&](std::size_t a, std::size_t b) { return items[a].t0 < items[b].t0; });
  for (const std::size_t i : kept) {
    fit.residual_t_s.push_back(0.5 * (items[i].t0 + items[i].t1));
    fit.residual_rad.push_back(all[i].rows.col(unknowns));
  }
}

}  // namespace

LikelihoodFit maximise_likelihood(const Problem& problem, const Coarse& start, const LikelihoodOptions& options,
                                  double readout_start_s) {
  LikelihoodFit fit;
  Model model(problem, options);
  const std::vector<Item> items = items_of(problem, options.bearings);
  Parameters x{start.offset_s, start.drift,  start.centre_s, start.R_reference_sensor,
               Vec3::Zero(),   Mat3::Zero(), readout_start_s};
  Arma11 errors;
  double scale = 1, relative = 0;
  std::vector<Linear> all;
  Normals n;
  LikelihoodOptions held = options;

  // A long recording settles on a part of it first; the whole then takes one or two steps.
  std::size_t stride = std::max<std::size_t>(1, items.size() / 6000);
  constexpr int most = 80;
  for (fit.iterations = 0; fit.iterations < most; ++fit.iterations) {
    // The readout joins once the offset has settled: far from it it would chase its error.
    held.readout = options.readout && (fit.iterations >= 5 || readout_start_s != 0);
    if (options.bearings && (fit.iterations == 2 || fit.iterations == 4)) model.remove_bias(x.bias);
    all = linearise_all(items, model, x, stride);
    // What is expected of the recording is measured once the bias and the rotation are about right, then kept.
    if (fit.iterations >= 3 && fit.iterations < 6) {
      if (options.bearings) expect_parallax(all, model);
      relative = relative_variance(all, residual_scale(all), relative);
      model.expect_relative_error(relative);
      all = linearise_all(items, model, x, stride);
    }
    scale = residual_scale(all);
    if (fit.iterations >= 5) errors = measure_correlation(all, scale);
    n = accumulate(all, errors, scale);
    if (n.rows < 30) return fit;
    const double s2 = n.squares / std::max(1.0, n.rows - double{unknowns});
    add_priors(n, held, x, s2);
    const State dx = limited(n.h.ldlt().solve(n.g), start.lobe_s);
    if (!dx.allFinite()) return fit;
    step_by(x, dx);
    const Normal covariance = n.h.inverse() * s2;
    const double sigma = std::sqrt(std::max(0.0, covariance(offset, offset)));
    // Medians and robust weights move a little with every step, so the last hundredths of a sigma may never rest.
    // The rotation about an axis that the motion does not show may wander for ever: in the end the offset alone counts.
    const bool all_rest = dx.dot(n.h * dx) < 0.2 * s2 || fit.iterations > 24;
    const bool settled = all_rest && std::abs(dx[offset]) < 0.05 * sigma;
    if (!settled || fit.iterations < 8) continue;
    if (stride == 1) {
      fit.converged = true;
      break;
    }
    stride = 1;
  }

  // The last linearisation is at the solution (or next to it): everything that is said of it comes from there.
  all = linearise_all(items, model, x, 1);
  scale = residual_scale(all);
  n = accumulate(all, errors, scale);
  const double s2 = n.squares / std::max(1.0, n.rows - double{unknowns});
  add_priors(n, options, x, s2);
  const Normal shape = n.h.inverse();
  std::vector<Rows> whitened(all.size(), Rows::Zero());
  std::vector<Timed> dense;
  for_each_whitened(all, errors, scale, [&](std::size_t i, const Linear&, double, const Rows& rows) {
    whitened[i] = rows;
    dense.push_back({0.5 * (items[i].t0 + items[i].t1), rows});
  });
  fit.whiteness = largest_autocorrelation(dense);
  fit.inflation = score_inflation(std::move(dense), shape, overlap_of(items));
  const Normal covariance = s2 * fit.inflation * fit.inflation * shape;

  judge(all, scale, fit);
  keep_residuals(items, all, fit);
  fit.errors = errors;
  fit.misfit = scale;
  fit.relative_error = std::sqrt(relative);
  // The centre moves to where offset and drift are uncorrelated: there the offset is known best.
  const double move = options.drift ? -covariance(offset, drift) / covariance(drift, drift) : 0;
  fit.centre_s = x.centre_s + move;
  fit.offset_s = x.offset_s + move * x.drift;
  fit.offset_sigma_s = std::sqrt(std::max(0.0, covariance(offset, offset) + move * covariance(offset, drift)));
  fit.drift = x.drift;
  fit.drift_sigma = options.drift ? std::sqrt(covariance(drift, drift)) : 0;
  fit.R_reference_sensor = x.R_reference_sensor;
  fit.gyro_bias = x.bias;
  fit.rotation_sigma =
      (x.R_reference_sensor * covariance.block<3, 3>(rotation, rotation) * x.R_reference_sensor.transpose())
          .diagonal()
          .cwiseSqrt();
  fit.readout_s = x.readout_s;
  fit.readout_sigma_s = options.readout ? std::sqrt(covariance(readout, readout)) : 0;

  const double window_s2 = s2 * fit.inflation * fit.inflation;
  const double begin = problem.steps.front().t0, length = problem.steps.back().t1 - begin;
  const auto piece = [&](double k, double of) {
    return window_offset(whitened, items, begin + k / of * length, begin + (k + 1) / of * length, window_s2);
  };
  fit.halves[0] = piece(0, 2);
  fit.halves[1] = piece(1, 2);
  const double windows = std::clamp(std::floor(static_cast<double>(items.size()) / 60), 2.0, 24.0);
  for (double w = 0; w < windows; ++w) fit.windows.push_back(piece(w, windows));
  return fit;
}

}  // namespace takt::alignment
