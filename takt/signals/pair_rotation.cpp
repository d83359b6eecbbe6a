// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/pair_rotation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace takt {

namespace {

double median(std::vector<double> v) {
  const auto mid = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), mid, v.end());
  return *mid;
}

}  // namespace

PairRotation rotation_of_pair(const std::vector<BearingMatch>& matches, const PairRotationOptions& options) {
  PairRotation out;
  if (matches.size() < options.fewest_matches) return out;
  Mat3 R = Mat3::Identity();
  std::vector<double> norm(matches.size());
  double scale = 1;
  Mat3 information = Mat3::Zero();
  for (int round = 0; round < 12; ++round) {
    information.setZero();
    Vec3 gradient = Vec3::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const BearingMatch& m = matches[i];
      const Vec3 b = m.to.cast<double>();
      const Vec3 r = R.transpose() * m.from.cast<double>() - b;
      norm[i] = r.norm() / (std::sqrt(2.0) * m.sigma_rad);
      const double cauchy = round == 0 ? 1 : 1 / (1 + std::pow(norm[i] / (3 * scale), 2));
      const double w = cauchy / (2 * std::pow(m.sigma_rad, 2));
      information += w * hat(b).transpose() * hat(b);
      gradient += w * b.cross(r);
    }
    // R exp(e) b ≈ R(b − b × e): the step that makes R·b follow `from`.
    R = R * exp_so3(information.ldlt().solve(gradient));
    scale = std::max(1e-3, median(norm) / 1.1774);  // the median of a Rayleigh variable
  }
  out.rotation = log_so3(Quat(R));
  out.sigma_ratio = scale;
  const double used = options.sigma_is_known ? 1 : scale;
  out.information = information / (used * used);
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (norm[i] < 4 * scale) {
      out.matches.push_back(matches[i]);
      if (!options.sigma_is_known) out.matches.back().sigma_rad *= static_cast<float>(scale);
    }
  out.explained_share = static_cast<double>(out.matches.size()) / static_cast<double>(matches.size());
  out.outcome = out.explained_share >= options.explained_share_least ? PairOutcome::measured : PairOutcome::unexplained;
  return out;
}

std::vector<BearingMatch> spread_over_view(std::vector<BearingMatch> matches, std::size_t count) {
  if (matches.size() <= count) return matches;
  // One from each cell of the view in turn, until there are enough.
  constexpr double cell_rad = 0.1;
  std::map<std::pair<int, int>, std::size_t> in_cell;
  std::vector<std::pair<std::size_t, std::size_t>> turn;  // (how many its cell gave before, index)
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3f& b = matches[i].from;
    const double x = std::atan2(b.x(), b.z()), y = std::atan2(b.y(), std::hypot(b.x(), b.z()));
    const std::pair cell(static_cast<int>(std::floor(x / cell_rad)), static_cast<int>(std::floor(y / cell_rad)));
    turn.emplace_back(in_cell[cell]++, i);
  }
  std::stable_sort(turn.begin(), turn.end());
  turn.resize(count);
  std::sort(turn.begin(), turn.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<BearingMatch> chosen;
  chosen.reserve(count);
  for (const auto& [before, i] : turn) chosen.push_back(matches[i]);
  return chosen;
}

}  // namespace takt
