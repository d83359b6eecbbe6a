// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/focal.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace takt::alignment {

double fit_log_focal(const Problem& problem, const Coarse& start) {
  struct Pair {
    Vec3 sensor, reference;
  };
  std::vector<Pair> pairs;
  for (const Step& s : problem.steps) {
    const double shift = start.offset_s + start.drift * (s.t0 - start.centre_s);
    if (!problem.reference.covers(s.t0 + shift, s.t1 + shift)) continue;
    pairs.push_back({s.apparent, log_so3(problem.reference.between(s.t0 + shift, s.t1 + shift))});
  }
  Vec3 mean_sensor = Vec3::Zero(), mean_reference = Vec3::Zero();
  for (const Pair& p : pairs) mean_sensor += p.sensor, mean_reference += p.reference;
  mean_sensor /= std::max<double>(1, static_cast<double>(pairs.size()));
  mean_reference /= std::max<double>(1, static_cast<double>(pairs.size()));

  // The rotation between the sensors and the scale are found in turns; each makes the other better.
  double scale = 1;  // apparent over true, sideways and up
  Mat3 rotation = start.R_reference_sensor;
  for (int pass = 0; pass < 10; ++pass) {
    const Vec3 true_of_apparent(1 / scale, 1 / scale, 1);
    Mat3 correlation = Mat3::Zero();
    for (const Pair& p : pairs)
      correlation += (p.reference - mean_reference) * true_of_apparent.cwiseProduct(p.sensor - mean_sensor).transpose();
    rotation = align_vectors(correlation).rotation;
    double cross = 0, power = 0;
    for (const Pair& p : pairs) {
      const Vec3 expected = rotation.transpose() * (p.reference - mean_reference), seen = p.sensor - mean_sensor;
      cross += expected.head<2>().dot(seen.head<2>());
      power += expected.head<2>().squaredNorm();
    }
    if (!(power > 0)) return 0;
    scale = std::clamp(cross / power, 0.3, 3.0);
  }
  // Displacements over an assumed focal length that is too short look too large.
  return std::log(scale);
}

}  // namespace takt::alignment
