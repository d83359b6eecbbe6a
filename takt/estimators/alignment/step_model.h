// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "takt/estimators/alignment/camera_way.h"
#include "takt/estimators/alignment/likelihood.h"
#include "takt/motion/two_view.h"

/// The likelihood's model of one step: what the gyro predicts, how that moves with the unknowns, and what is left.
namespace takt::alignment {

// The unknowns, always in this order; those that are not asked for are held by a prior.
enum Unknown { offset, drift, rotation, bias = rotation + 3, gain = bias + 3, readout = gain + 6, unknowns };
using State = Eigen::Matrix<double, unknowns, 1>;
using Rows = Eigen::Matrix<double, 3, unknowns + 1>;  ///< Jacobian, and the residual as its last column

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
[[nodiscard]] std::vector<Item> items_of(const Problem& problem, bool bearings);

/// One item at the current parameters: whitening not yet applied.
struct Linear {
  bool used = false;
  Vec3 predicted = Vec3::Zero();  ///< rotation, rad
  Vec3 parallax = Vec3::Zero();   ///< from bearings, given the predicted rotation
  Vec3 moved = Vec3::Zero();      ///< the same along the reference's axes at the start of its stretch
  bool first = true;              ///< no step directly before it
  Rows rows = Rows::Zero();       ///< residual = rows.last − rows.first · dx, claimed covariance (root·root)⁻¹
  Mat3 root = Mat3::Zero();       ///< symmetric root of the claimed information
  // What bearings say about the readout beyond the rotation.
  double readout_information = 0;
  double readout_gradient = 0;
};

/// What a recording as a whole says of the parallax of its pairs (rad). A car moves forward, a hand turns about a
/// wrist, a camera on a tripod does nothing of either.
struct ParallaxExpectation {
  Vec3 mean = Vec3::Zero();
  Mat3 information = Mat3::Zero();  ///< inverse covariance of the scatter about it
};

class StepModel {
 public:
  StepModel(const Problem& problem, const LikelihoodOptions& options);

  /// Takes a known bias out of the rates themselves. To first order it would do to turn each prediction by the bias,
  /// but over a long step with a changing rate that is not enough.
  void remove_bias(const Vec3& bias);
  void expect_parallax(const ParallaxExpectation& expected) { parallax_ = expected; }
  /// How the camera moves while a frame is read.
  void expect_way(CameraWay way) { way_ = std::move(way); }
  /// Errors that grow with the turn: variance per axis over the squared angle.
  void expect_relative_error(double variance) { relative_variance_ = variance; }

  /// Weighs a pair's matches at its own best rotation and readout, near what is predicted; nothing for other items.
  [[nodiscard]] std::optional<MatchWeights> settle(const Item& item, const Parameters& x) const;
  /// With the weights that were settled, or new ones.
  [[nodiscard]] Linear linearise(const Item& item, const Parameters& x, const MatchWeights* settled) const;
  /// What each of a pair's matches adds to the residual rotation (a column a match); nothing for other items.
  [[nodiscard]] Eigen::Matrix3Xd by_match(const Item& item, const Parameters& x, const MatchWeights& settled) const;

 private:
  /// What the gyro says of a step.
  struct Prediction {
    Quat turn;      ///< sensor frame
    Vec3 turned;    ///< log of it before the gain
    Vec3 w0, w1;    ///< reference frame
    double t0, t1;  ///< reference seconds
    double since0, since1;
    Mat3 back, by_bias;
  };
  /// A pair's matches, each brought to its frame's reference row, and how they move with the readout.
  struct Seen {
    BearingPairs pairs;
    Eigen::Matrix3Xd shear;
    [[nodiscard]] std::span<const Eigen::Matrix3Xd> extra() const { return {&shear, shear.cols() > 0 ? 1u : 0u}; }
  };

  [[nodiscard]] std::optional<Prediction> predict(const Item& item, const Parameters& x) const;
  [[nodiscard]] Seen see(const Item& item, const Prediction& predicted, const Quat& turn, const Parameters& x,
                         double readout_s) const;
  [[nodiscard]] TwoViewOptions two_view() const;
  bool compare_bearings(const Item& item, const Prediction& predicted, const Parameters& x, const MatchWeights* settled,
                        Linear& out, Mat3& information) const;

  const Problem& problem_;
  LikelihoodOptions options_;
  const GyroCurve* gyro_;
  std::optional<GyroCurve> unbiased_;
  Vec3 removed_ = Vec3::Zero();
  double gyro_density_;
  ParallaxExpectation parallax_;
  CameraWay way_;
  double relative_variance_ = 0;
};

/// All items, on both cores; each step stands alone, so the result does not depend on the number of threads. With a
/// stride, whole blocks are kept so that neighbours stay neighbours.
class Items {
 public:
  Items(const Problem& problem, bool bearings) : all_(items_of(problem, bearings)) {}
  [[nodiscard]] const std::vector<Item>& all() const { return all_; }
  void settle(const StepModel& model, const Parameters& x, std::size_t stride);
  [[nodiscard]] std::vector<Linear> linearise(const StepModel& model, const Parameters& x, std::size_t stride) const;
  /// StepModel::by_match of each item at its settled weights.
  [[nodiscard]] std::vector<Eigen::Matrix3Xd> by_match(const StepModel& model, const Parameters& x) const;
  /// The camera's way by the items' parallaxes.
  [[nodiscard]] CameraWay way(const std::vector<Linear>& linear) const;
  /// How many items run at the same time.
  [[nodiscard]] double overlap() const;

 private:
  std::vector<Item> all_;
  std::vector<std::optional<MatchWeights>> settled_;
};

}  // namespace takt::alignment
