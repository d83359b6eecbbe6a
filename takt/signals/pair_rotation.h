// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/streams/rotation_signal.h"

/// The step that pictures and track files share: from the matches of two frames to a rotation with its information.
namespace takt {

struct PairRotationOptions {
  std::size_t fewest_matches = 12;     ///< below this nothing is said about the rotation
  double explained_share_least = 0.5;  ///< share of matches that rotation + translation must explain
  double sigma_ratio_most = 12;        ///< more scatter than this many times the expected is a motion not understood
  bool sigma_is_known = false;         ///< the matches' sigma_rad are their noise, else a first guess to be measured
};

enum class PairOutcome { measured, too_few_matches, unexplained };

struct PairRotation {
  PairOutcome outcome = PairOutcome::too_few_matches;
  Vec3 rotation = Vec3::Zero();       ///< R_from_to as in RotationIncrement
  Vec3 apparent = Vec3::Zero();       ///< likewise
  Mat3 information = Mat3::Zero();    ///< 1/rad², for the sigma that the matches came with, or the measured one
  std::vector<BearingMatch> matches;  ///< inliers
  double explained_share = 0;         ///< inliers among all matches
  double sigma_ratio = 1;             ///< measured scatter over the matches' sigma_rad
};

/// How the camera turned between two frames, robust against outliers, the camera's own translation included.
[[nodiscard]] PairRotation rotation_of_pair(const std::vector<BearingMatch>& matches,
                                            const PairRotationOptions& options = {});

/// At most `count` matches, spread over the view: the choice depends on the matches alone.
[[nodiscard]] std::vector<BearingMatch> spread_over_view(std::vector<BearingMatch> matches, std::size_t count);

}  // namespace takt
