// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "takt/motion/rotation.h"

/// What matched bearings say about the rotation between two views, whatever the translation and the depths.
///
/// Model of one match, with R = R_from_to and p = R·to:
///   from ≈ p + (I − p·pᵀ)·(1 + ε)·v + noise,     v = translation · mean inverse depth  (rad, in `from`'s frame)
/// ε, the scatter of inverse depth about its mean, is unknown and not independent from match to match (a ground plane,
/// a wall), so along v's image the residual is given a variance of (κ·√n·|v|)², which leaves the information of all n
/// matches together about that direction no larger than one common error of size κ·|v|. Across it (the epipolar
/// constraint) nothing but noise remains. With v → 0 the model becomes the rotation-only one by itself.
namespace takt {

/// Matched unit bearings, one column a match.
struct BearingPairs {
  Eigen::Matrix3Xd from, to;
  /// Empty, or what v is for each match: scale·v + extra (rolling shutter: each row is seen at its own time).
  Eigen::VectorXd parallax_scale;
  Eigen::Matrix3Xd parallax_extra;
};

/// What each match is taken for. A rotation that is not quite right looks like depth, noise and outliers in part, so
/// weights that are measured anew at every trial rotation absorb some of its error, and the information claims more
/// than the residuals can tell. Where a rotation from elsewhere is tried, they are settled once, near the pair's own
/// best rotation, and kept.
struct MatchWeights {
  Vec3 parallax = Vec3::Zero();  ///< v
  double sigma_rad = 0;          ///< measured noise of one bearing, one axis (robust)
  std::vector<float> nearness;   ///< per match: inverse depth over the mean's
  std::vector<float> misfit;     ///< per match: residual in sigmas
};

/// Weighted normal equations in (δ, extra parameters), v eliminated; R_true = R·exp(δ).
struct TwoViewNormals {
  Eigen::MatrixXd information;  ///< (3+E)×(3+E)
  Eigen::VectorXd gradient;     ///< information·x = gradient at the least-squares x
  Vec3 parallax;                ///< v given δ = 0
  double sigma_rad = 0;         ///< measured noise of one bearing, one axis (robust)
  double explained = 0;         ///< share of the matches that lie within 4σ of the model
  Eigen::MatrixXd each;         ///< (3+E)×n: what each match adds to the gradient, where that is asked for
};

struct TwoViewOptions {
  /// Each match's own nearness is read off its displacement along v. Right where the rotation is known from elsewhere;
  /// where it is what is sought, a wrong rotation would look like depth.
  bool measure_nearness = false;
  double depth_scatter = 0.5;                ///< κ
  Vec3 parallax_mean = Vec3::Zero();         ///< what is known of v beforehand (rad)
  Mat3 parallax_information = Mat3::Zero();  ///< how well (1/rad²); zero: nothing is
  double sigma_floor_rad = 1e-6;
  bool each_match = false;  ///< fill TwoViewNormals::each
};

/// Linearised at the rotation R_from_to. `extra[e]` holds, per match, the derivative of (from − p) to parameter e
/// (3×n). Needs at least 6 matches; nothing where there are fewer.
[[nodiscard]] std::optional<TwoViewNormals> two_view_normals(const BearingPairs& pairs, const Quat& R_from_to,
                                                             std::span<const Eigen::Matrix3Xd> extra = {},
                                                             const TwoViewOptions& options = {});

/// The matches' weights given the rotation; nothing where there are fewer than 6 matches.
[[nodiscard]] std::optional<MatchWeights> weigh_matches(const BearingPairs& pairs, const Quat& R_from_to,
                                                        const TwoViewOptions& options = {});
/// As above, with weights that were settled before.
[[nodiscard]] TwoViewNormals two_view_normals(const BearingPairs& pairs, const Quat& R_from_to,
                                              const MatchWeights& weights, std::span<const Eigen::Matrix3Xd> extra = {},
                                              const TwoViewOptions& options = {});

/// Rotation between two views without any first guess: consensus of two-match rotations, then robust least squares.
struct TwoViewFit {
  Quat rotation;     ///< R_from_to
  Mat3 information;  ///< of δ in R_true = R·exp(δ), 1/rad²
  Vec3 parallax;
  double sigma_rad;
  double explained;
  Eigen::VectorXd misfit;  ///< per match: residual in sigmas; above 4 is an outlier
};
[[nodiscard]] std::optional<TwoViewFit> fit_two_view(const BearingPairs& pairs, const TwoViewOptions& options = {});

}  // namespace takt
