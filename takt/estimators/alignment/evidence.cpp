// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/estimators/alignment/rate_grid.h"

namespace takt::alignment {

namespace {

constexpr std::size_t most_points = 1500;

Panel panel(std::string name, std::string kind, std::string title, std::string caption) {
  Panel p;
  p.name = std::move(name);
  p.kind = std::move(kind);
  p.title = std::move(title);
  p.caption = std::move(caption);
  return p;
}

}  // namespace

Panel correlation_panel(const Problem& problem, const Correlation& c) {
  Panel p =
      panel("correlation", "lines", "Correlation of the two rates against the offset",
            "Under the best rotation between the sensors at each offset; one peak should stand clear of all others.");
  const double base = to_seconds(problem.between_epochs());
  p.x = {"offset", "s", {}, {}};
  for (const double o : c.curve_offset_s) p.x.values.push_back(o + base);
  p.y.push_back({"correlation", "", c.curve_r, {}});
  static constexpr const char* names[] = {"best", "second"};
  for (std::size_t i = 0; i < std::min<std::size_t>(2, c.peaks.size()); ++i)
    p.marks.push_back({names[i], c.peaks[i].offset_s + base});
  return p;
}

Panel rates_panel(const Problem& problem, double offset_s, double drift, double centre_s, const Mat3& R, bool after) {
  const std::string lie = "The two should lie on each other, in every swing";
  const std::string seen =
      problem.pairs.empty()
          ? "."
          : ", but for what the camera's own way adds to its apparent turning; the answer knows the two apart.";
  Panel p = after ? panel("rates_after", "lines", "Angular rate after alignment", lie + seen)
                  : panel("rates_before", "lines", "Angular rate before alignment",
                          "Both as stamped; where the clocks have nothing in common their starts are laid together.");
  p.x = {"time on the sensor's clock since its first stamp", "s", {}, {}};
  Series sensor{problem.signal.name, "rad/s", {}, {}}, reference{"reference", "rad/s", {}, {}};
  // The axis that moves most tells more than the norm: signs count.
  Vec3 power = Vec3::Zero();
  for (const Step& s : problem.steps) power += (s.apparent / (s.t1 - s.t0)).cwiseAbs2();
  Eigen::Index axis = 0;
  power.maxCoeff(&axis);
  // A stretch that can be read: at most this many steps from the middle of the recording.
  const std::size_t n = problem.steps.size(), shown = std::min(n, most_points), first = (n - shown) / 2;
  const double between = to_seconds(problem.between_epochs());
  const bool same_clock = std::abs(between) < 60;
  for (std::size_t i = first; i < first + shown; ++i) {
    const Step& s = problem.steps[i];
    const double t = 0.5 * (s.t0 + s.t1);
    const double shift = after ? offset_s + drift * (t - centre_s) : (same_clock ? -between : 0);
    const double half = 0.5 * (s.t1 - s.t0);
    p.x.values.push_back(t);
    sensor.values.push_back(s.apparent[axis] / (s.t1 - s.t0));
    const double at = t + shift;
    reference.values.push_back(problem.reference.covers(at - half, at + half)
                                   ? (R.transpose() * log_so3(problem.reference.between(at - half, at + half)))[axis] /
                                         (s.t1 - s.t0)
                                   : std::numeric_limits<double>::quiet_NaN());
  }
  p.y = {std::move(sensor), std::move(reference)};
  return p;
}

Panel coherence_panel(const PhaseFit& fit) {
  Panel p = panel("coherence", "lines", "Coherence of the two rates",
                  "Near 1 where both saw the same motion; the phase method weighs each frequency by it.");
  p.x = {"frequency", "Hz", fit.frequency_hz, {}};
  p.y.push_back({"coherence", "", fit.coherence, {}});
  return p;
}

Panel residuals_panel(const LikelihoodFit& fit) {
  Panel p = panel("residuals", "points", "Rotation that the gyro does not explain",
                  "Each point is one step of the sensor; structure here means that the model misses something.");
  p.x = {"time on the sensor's clock since its first stamp", "s", fit.residual_t_s, {}};
  static constexpr const char* axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    Series s{axes[k], "mrad", {}, {}};
    for (const Vec3& r : fit.residual_rad) s.values.push_back(1e3 * r[k]);
    p.y.push_back(std::move(s));
  }
  return p;
}

Panel windows_panel(const LikelihoodFit& fit) {
  Panel p = panel("windows", "points", "Offset in pieces of the recording, against the answer",
                  "All should scatter about zero within their bars; a slope is a drift, a step a clock that jumped.");
  p.x = {"time on the sensor's clock since its first stamp", "s", {}, {}};
  Series s{"offset − answer", "ms", {}, {}};
  for (const WindowOffset& w : fit.windows) {
    if (w.sigma_s <= 0) continue;
    p.x.values.push_back(w.centre_s);
    s.values.push_back(1e3 * w.offset_s);
    s.sigma.push_back(1e3 * w.sigma_s);
  }
  p.y.push_back(std::move(s));
  return p;
}

}  // namespace takt::alignment
