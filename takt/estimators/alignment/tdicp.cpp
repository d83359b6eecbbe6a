// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/tdicp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "takt/math/arrow_system.h"
#include "takt/math/median.h"

namespace takt {
namespace {

/// A stretch of the sensor's orientation curve, short enough not to drift: R_first_i at times_s[i].
struct Window {
  std::vector<double> times_s;
  std::vector<Quat> attitude;
};

/// The unknowns that all windows share: offset, rotation between the sensors, bias (in this order in the equations).
struct Shared {
  double offset_s;
  Quat R_reference_sensor;
  Vec3 bias;
};
constexpr int shared_size = 7;
using SharedJacobian = Eigen::Matrix<double, 3, shared_size>;
using SharedVector = Eigen::Matrix<double, shared_size, 1>;

/// One sensor orientation against its closest point on the reference curve.
struct Pair {
  Vec3 residual;  ///< rad, sliding undone to first order: what remains at sensor time + offset
  Mat3 by_start;  ///< to the window's free rotation
  SharedJacobian by_shared;
};

constexpr std::size_t fewest_points = 8;
constexpr int fewest_windows = 8;  // below that, the scatter of the windows says nothing about the error

/// Cuts the increments into windows; none spans a gap or an increment that could not be measured.
std::vector<Window> cut_windows(const RotationSignal& sensor, Stamp epoch, const TdicpOptions& options) {
  std::vector<Window> windows;
  Window open;
  const auto close = [&] {
    if (open.times_s.size() >= fewest_points) windows.push_back(std::move(open));
    open = {};
  };
  if (sensor.increments.empty()) return windows;
  const double span = seconds_since(sensor.increments.front().from, sensor.increments.back().to);
  const double length = std::min(options.window_s, span / (2 * fewest_windows));
  Stamp end{};
  for (const RotationIncrement& step : sensor.increments) {
    const bool measured = step.information.trace() > 0 && step.rotation.allFinite();
    if (!open.times_s.empty() && (step.from != end || !measured)) close();
    if (!measured) continue;
    if (open.times_s.empty()) {
      open.times_s.push_back(seconds_since(epoch, step.from));
      open.attitude.push_back(Quat::Identity());
    }
    open.times_s.push_back(seconds_since(epoch, step.to));
    open.attitude.push_back((open.attitude.back() * exp_so3(step.rotation)).normalized());
    end = step.to;
    if (open.times_s.back() - open.times_s.front() >= length && open.times_s.size() >= fewest_points) close();
  }
  close();
  return windows;
}

std::vector<Window> spread_evenly(std::vector<Window> windows, int most) {
  const auto n = windows.size(), keep = static_cast<std::size_t>(std::max(1, most));
  if (n <= keep) return windows;
  std::vector<Window> kept;
  for (std::size_t i = 0; i < keep; ++i) kept.push_back(std::move(windows[i * n / keep]));
  return kept;
}

/// The registration of one window: closest points, then the residuals at them.
class Registration {
 public:
  /// `noise` (rad) weighs orientation against `slide` (s), by which a correspondence may leave the common offset.
  Registration(const Window& window, const GyroCurve& reference, const Shared& shared, double noise, double slide)
      : window_(window), reference_(reference), shared_(shared), slides_(window.times_s.size(), 0.0) {
    trace_reference();
    find_start();
    if (slide <= 0) return;
    slide_to_closest(noise / slide, 3 * slide);
    trace_reference();
    find_start();
  }

  [[nodiscard]] std::size_t size() const { return slides_.size(); }
  [[nodiscard]] Pair pair(std::size_t i) const {
    const Vec3 e = residual(i);
    const Mat3 inverse = right_jacobian_inverse(e);
    const Mat3 back = exp_so3(e).toRotationMatrix().transpose();  // M = Exp(e) takes the prediction to the reference
    const Vec3 rate = reference_.rate(time(i)) - shared_.bias;
    Pair p;
    p.by_start = inverse *
                 (start_ * window_.attitude[i] * shared_.R_reference_sensor.conjugate()).toRotationMatrix().transpose();
    p.by_shared.col(0) = -inverse * back * rate;
    p.by_shared.middleCols<3>(1) = -inverse * shared_.R_reference_sensor.toRotationMatrix();
    p.by_shared.rightCols<3>() = inverse * back * drift_[i];
    p.residual = e - p.by_shared.col(0) * slides_[i];
    return p;
  }

 private:
  [[nodiscard]] double time(std::size_t i) const { return window_.times_s[i] + shared_.offset_s + slides_[i]; }
  [[nodiscard]] Vec3 residual(std::size_t i) const {
    return log_so3(curve_[i].conjugate() * (start_ * window_.attitude[i] * shared_.R_reference_sensor.conjugate()));
  }

  /// The reference's orientations with the bias taken out, and how each depends on the bias: ∫ R_i(s)ᵀ ds from the
  /// window's start, taking the rate as constant between two samples of the sensor.
  void trace_reference() {
    curve_.resize(size());
    drift_.resize(size());
    Quat before = curve_[0] = reference_.attitude(time(0));
    drift_[0].setZero();
    for (std::size_t i = 1; i < size(); ++i) {
      const Quat now = reference_.attitude(time(i)), turn = before.conjugate() * now;
      const Mat3 step = (time(i) - time(i - 1)) * right_jacobian(log_so3(turn));
      drift_[i] = turn.toRotationMatrix().transpose() * drift_[i - 1] + step;
      curve_[i] = curve_[i - 1] * turn * exp_so3(-step * shared_.bias);
      before = now;
    }
  }

  /// The window's free rotation that brings both curves together best (chordal mean).
  void find_start() {
    Mat3 sum = Mat3::Zero();
    for (std::size_t i = 0; i < size(); ++i)
      sum += (curve_[i] * shared_.R_reference_sensor * window_.attitude[i].conjugate()).toRotationMatrix();
    start_ = Quat(align_vectors(sum).rotation);
  }

  /// Newton's step along the curve toward the closest point, held back by the stiffness (rad/s) and a limit (s).
  void slide_to_closest(double stiffness, double limit) {
    for (std::size_t i = 0; i < size(); ++i) {
      const Vec3 rate = reference_.rate(time(i)) - shared_.bias;
      const double along = rate.dot(residual(i)) / (rate.squaredNorm() + stiffness * stiffness);
      slides_[i] = std::clamp(along, -limit, limit);
    }
  }

  const Window& window_;
  const GyroCurve& reference_;
  const Shared& shared_;
  std::vector<double> slides_;
  std::vector<Quat> curve_;
  std::vector<Mat3> drift_;
  Quat start_;
};

/// One round over all windows.
struct Round {
  ArrowSystem::Solution solution;
  Eigen::Matrix<double, shared_size, shared_size> scatter;  ///< Σ g·gᵀ of the windows' gradients
  double rms_rad = 0;
  int windows = 0;
};

Round register_all(const std::vector<Window>& windows, const GyroCurve& reference, const Shared& shared, double noise,
                   double slide) {
  std::vector<std::vector<Pair>> registered;
  std::vector<double> mean_square;
  for (const Window& w : windows) {
    const double first = w.times_s.front() + shared.offset_s - 3 * slide,
                 last = w.times_s.back() + shared.offset_s + 3 * slide;
    if (!reference.covers(first, last)) continue;
    const Registration registration(w, reference, shared, noise, slide);
    std::vector<Pair> pairs;
    double sum = 0;
    for (std::size_t i = 0; i < registration.size(); ++i) {
      pairs.push_back(registration.pair(i));
      sum += pairs.back().residual.squaredNorm();
    }
    mean_square.push_back(sum / static_cast<double>(pairs.size()));
    registered.push_back(std::move(pairs));
  }

  Round round;
  round.windows = static_cast<int>(registered.size());
  round.scatter.setZero();
  if (round.windows < fewest_windows) return round;
  const double typical = std::max(median(mean_square), 1e-24);
  ArrowSystem system(3 * round.windows, 2, shared_size);
  double weights = 0;
  for (int k = 0; k < round.windows; ++k) {
    // Cauchy's weight, a window at a time: one bad increment spoils the rest of its window.
    const double weight = 1 / (1 + mean_square[k] / (9 * typical));
    SharedVector gradient = SharedVector::Zero();
    for (const Pair& p : registered[k]) {
      // A correspondence that may slide says less along the curve.
      const Vec3 along = p.by_shared.col(0);
      const double loose = slide * slide / (noise * noise + slide * slide * along.squaredNorm());
      const Mat3 information = weight * (Mat3::Identity() - loose * along * along.transpose());
      Eigen::Matrix<double, 3, 3 + shared_size> jacobian;
      jacobian << p.by_start, p.by_shared;
      const auto weighted = (jacobian.transpose() * information).eval();
      const std::array<ArrowSystem::Block, 2> blocks{{{3 * k, 3}, {3 * round.windows, shared_size}}};
      system.accumulate(blocks, weighted * jacobian, weighted * p.residual);
      gradient += weighted.bottomRows<shared_size>() * p.residual;
    }
    round.scatter += gradient * gradient.transpose();
    round.rms_rad += weight * mean_square[k];
    weights += weight;
  }
  round.rms_rad = std::sqrt(round.rms_rad / weights);
  round.solution = system.solve();
  return round;
}

}  // namespace

TdicpResult tdicp(const RotationSignal& sensor, Stamp sensor_epoch, const GyroCurve& reference, double initial_offset_s,
                  const Mat3& initial_R_reference_sensor, const TdicpOptions& options) {
  constexpr double narrow = 0.3;  // each round lets correspondences slide less, until they move together
  const std::vector<Window> windows = spread_evenly(cut_windows(sensor, sensor_epoch, options), options.max_windows);
  Shared shared{initial_offset_s, Quat(initial_R_reference_sensor).normalized(), Vec3::Zero()};
  TdicpResult result;
  result.sigma_s = std::numeric_limits<double>::infinity();
  double slide = options.slide_s, noise = 0.05;
  while (result.iterations < options.max_iterations) {
    ++result.iterations;
    const Round round = register_all(windows, reference, shared, noise, slide);
    result.rms_rad = round.rms_rad;
    result.windows = round.windows;
    if (round.windows < fewest_windows || !round.solution.ok()) break;
    const SharedVector step = round.solution.step().tail<shared_size>();
    if (!step.allFinite()) break;
    // The equations are linear within a fraction of a turn and of the motion's own time scale; no step beyond.
    const double most = std::max({std::abs(step[0]) / 0.2, step.segment<3>(1).norm() / 0.5, 1.0});
    shared.offset_s += step[0] / most;
    shared.R_reference_sensor = (shared.R_reference_sensor * exp_so3(step.segment<3>(1) / most)).normalized();
    shared.bias += step.tail<3>() / most;
    noise = std::max(round.rms_rad / std::sqrt(3.0), 1e-9);

    const auto& inverse = round.solution.border_covariance();
    const double few = round.windows / static_cast<double>(round.windows - shared_size);
    const double sigma = std::sqrt(few * (inverse * round.scatter * inverse)(0, 0));
    if (slide == 0 && std::abs(step[0]) < std::max(1e-9, 1e-3 * sigma) && most == 1.0) {
      result.converged = true;
      result.sigma_s = sigma;
      break;
    }
    slide *= narrow;
    if (slide < 1e-4) slide = 0;
  }
  result.offset_s = shared.offset_s;
  result.R_reference_sensor = shared.R_reference_sensor.toRotationMatrix();
  result.bias_rad_s = shared.bias;
  return result;
}

}  // namespace takt
