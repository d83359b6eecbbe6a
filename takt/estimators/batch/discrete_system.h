// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <vector>

#include "takt/estimators/batch/discrete.h"
#include "takt/math/arrow_system.h"

/// Normal equations of the discrete model: frames' poses and velocities in a band, the calibration as a border. The
/// chain is cut where the biases' control points change; between cuts only three of these act, so that a stretch has a
/// border of fixed size and time is linear in the recording's length, whatever the biases do.
namespace takt::batch {

inline constexpr int state_size = 9;  ///< rotation (on the right), position, velocity

/// The three sorts of residuals: the frames' poses; turns and, together, velocities and positions of the joins.
enum ResidualSort { camera_sort, rotation_sort, translation_sort, residual_sorts };
using SortWeights = std::array<double, residual_sorts>;
struct ResidualSums {
  SortWeights squares{};  ///< of residuals whitened by the noise assumed, weights not applied
  SortWeights count{};
};

/// Where the unknowns of the border stand; one camera, one IMU.
[[nodiscard]] BorderLayout discrete_layout(int bias_points);

/// ξ that takes the pose measured on the board to the one that frame k's state predicts.
[[nodiscard]] Vec6 pose_error(const DiscreteFit& fit, std::size_t k);

/// One step of Gauss–Newton.
struct DiscreteStep {
  bool ok = false;         ///< false: the motion does not determine the calibration; nothing below holds
  Eigen::VectorXd states;  ///< state_size a frame
  Eigen::VectorXd border;
  Eigen::MatrixXd covariance;  ///< of the border
  double log_determinant = 0;
  ResidualSums sums;
};

/// The residuals linearised where `fit` stands, for steps with one or the other weights. Both arguments must stay.
class DiscreteSystem {
 public:
  DiscreteSystem(const DiscreteFit& fit, const ImuCurve& imu, int threads);
  [[nodiscard]] DiscreteStep solve(const SortWeights& weight = {1, 1, 1}) const;

 private:
  static constexpr int columns = 30;
  using Vec9 = Eigen::Matrix<double, 9, 1>;

  /// What the IMU says between two frames, whitened.
  struct Join {
    Eigen::Matrix<double, 9, columns> jacobian;  ///< by both states, offset, drift, gravity, scale, the biases there
    Vec9 residual;
    BiasCurve::Place bias;
  };
  /// Frames first … last: those two belong to the neighbours too and stay, those between are eliminated.
  struct Stretch {
    std::size_t first = 0, last = 0;
    int bias_first = 0;  ///< the control points that act
    [[nodiscard]] int band() const { return last > first ? state_size * static_cast<int>(last - first - 1) : 0; }
    [[nodiscard]] int state(std::size_t k) const;
  };

  [[nodiscard]] double imu_time(std::size_t k) const;
  [[nodiscard]] BiasCurve::Place bias_of_join(std::size_t k) const;
  [[nodiscard]] Join linearise(std::size_t k) const;
  void cut();
  void add_view(std::size_t k, const Stretch& at, const SortWeights& weight, ArrowSystem& system,
                ResidualSums& sums) const;
  void add_join(std::size_t k, const Stretch& at, const SortWeights& weight, ArrowSystem& system,
                ResidualSums& sums) const;
  [[nodiscard]] ArrowSystem::Elimination eliminate(std::size_t stretch, const SortWeights& weight,
                                                   ResidualSums& sums) const;
  /// Where a stretch's border stands in the system that is left; `kept` unknowns of frames come first.
  [[nodiscard]] std::array<ArrowSystem::Block, 3> places(std::size_t stretch, int kept) const;
  [[nodiscard]] Eigen::VectorXd all_states(const std::vector<ArrowSystem::Elimination>& eliminated,
                                           const Eigen::VectorXd& kept_step) const;

  const DiscreteFit& fit_;
  const ImuCurve& imu_;
  int threads_;
  std::vector<Stretch> stretches_;
  std::vector<Join> joins_;  ///< one a frame; empty where it is not joined to the next
};

}  // namespace takt::batch
