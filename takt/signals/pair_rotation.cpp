// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/pair_rotation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "takt/math/median.h"
#include "takt/motion/two_view.h"

namespace takt {

namespace {

/// As TwoViewFit::misfit means it.
constexpr double outlier_sigmas = 4;

BearingPairs columns(const std::vector<BearingMatch>& matches) {
  BearingPairs pairs;
  const auto n = static_cast<Eigen::Index>(matches.size());
  pairs.from.resize(3, n);
  pairs.to.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    pairs.from.col(i) = matches[static_cast<std::size_t>(i)].from.cast<double>();
    pairs.to.col(i) = matches[static_cast<std::size_t>(i)].to.cast<double>();
  }
  return pairs;
}

double median_sigma(const std::vector<BearingMatch>& matches) {
  std::vector<double> sigmas;
  for (const BearingMatch& m : matches) sigmas.push_back(m.sigma_rad);
  return median(std::move(sigmas));
}

/// The rotation that maps the bearings best when translation is left out of account; robust by reweighting.
Vec3 apparent_rotation(const std::vector<BearingMatch>& matches) {
  Mat3 rotation = Mat3::Identity();
  double cut = 1;
  std::vector<double> misfit(matches.size());
  for (int pass = 0; pass < 4; ++pass) {
    Mat3 correlation = Mat3::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Vec3 from = matches[i].from.cast<double>(), to = matches[i].to.cast<double>();
      const double r = misfit[i] / cut;
      correlation += from * to.transpose() / (1 + r * r);
    }
    rotation = align_vectors(correlation).rotation;
    for (std::size_t i = 0; i < matches.size(); ++i)
      misfit[i] = (matches[i].from.cast<double>() - rotation * matches[i].to.cast<double>()).norm();
    cut = std::max(1e-6, 1.5 * median(misfit));
  }
  return log_so3(Quat(rotation));
}

std::vector<BearingMatch> inliers(const std::vector<BearingMatch>& matches, const TwoViewFit& fit) {
  std::vector<BearingMatch> kept;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (fit.misfit[static_cast<Eigen::Index>(i)] < outlier_sigmas) kept.push_back(matches[i]);
  return kept;
}

}  // namespace

PairRotation rotation_of_pair(const std::vector<BearingMatch>& matches, const PairRotationOptions& options) {
  PairRotation out;
  if (matches.size() < options.fewest_matches) return out;
  out.outcome = PairOutcome::unexplained;
  auto fit = fit_two_view(columns(matches));
  if (!fit) return out;
  out.explained_share = fit->explained;
  out.matches = inliers(matches, *fit);
  if (out.explained_share < options.explained_share_least || out.matches.size() < options.fewest_matches) return out;

  // A median of residuals with a quarter of outliers among them takes the noise for half as large again.
  if (out.matches.size() < matches.size()) fit = fit_two_view(columns(out.matches));
  if (!fit) return out;
  out.rotation = log_so3(fit->rotation);
  out.apparent = apparent_rotation(out.matches);
  out.sigma_ratio = fit->sigma_rad / median_sigma(out.matches);
  if (out.sigma_ratio > options.sigma_ratio_most) return out;
  out.outcome = PairOutcome::measured;
  // The fit weighs by the noise that it measured; where the noise is known, that is put right.
  const double correction = options.sigma_is_known ? out.sigma_ratio : 1;
  out.information = fit->information * (correction * correction);
  if (!options.sigma_is_known)
    for (BearingMatch& m : out.matches) m.sigma_rad *= static_cast<float>(out.sigma_ratio);
  return out;
}

namespace {

struct Turn {
  std::size_t given_before;  ///< by the same cell of the view
  std::size_t index;
  auto operator<=>(const Turn&) const = default;
};

/// In which turn each match would be taken, if every cell of the view gave one match a turn; and how many cells there
/// are.
std::pair<std::vector<Turn>, std::size_t> take_turns(const std::vector<BearingMatch>& matches, double cell_rad) {
  std::map<std::pair<int, int>, std::size_t> given;
  std::vector<Turn> turns;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3f& b = matches[i].from;
    const double x = std::atan2(b.x(), b.z()), y = std::atan2(b.y(), std::hypot(b.x(), b.z()));
    const std::pair cell(static_cast<int>(std::floor(x / cell_rad)), static_cast<int>(std::floor(y / cell_rad)));
    turns.push_back({given[cell]++, i});
  }
  return {turns, given.size()};
}

}  // namespace

std::vector<BearingMatch> spread_over_view(std::vector<BearingMatch> matches, std::size_t count) {
  if (matches.size() <= count) return matches;
  // Cells so large that each gives about two.
  double cell_rad = 0.03;
  auto [turns, cells] = take_turns(matches, cell_rad);
  while (2 * cells > count && cell_rad < 3) std::tie(turns, cells) = take_turns(matches, cell_rad *= 1.5);
  std::sort(turns.begin(), turns.end());
  turns.resize(count);
  std::sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.index < b.index; });
  std::vector<BearingMatch> chosen;
  chosen.reserve(count);
  for (const Turn& t : turns) chosen.push_back(matches[t.index]);
  return chosen;
}

}  // namespace takt
