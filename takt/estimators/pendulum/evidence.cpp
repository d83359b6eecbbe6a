// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/evidence.h"

#include <algorithm>
#include <numbers>

namespace takt::pendulum {
namespace {

constexpr double deg = 180 / std::numbers::pi;
constexpr std::size_t most_points = 1500;

/// Every n-th value, scaled, so that a plot stays light.
std::vector<double> thinned(const std::vector<double>& values, double factor) {
  const std::size_t every = values.size() / most_points + 1;
  std::vector<double> out;
  for (std::size_t i = 0; i < values.size(); i += every) out.push_back(values[i] * factor);
  return out;
}

/// Measured and fitted values over the first `length_s` seconds.
Panel fit_panel(const std::string& name, const std::string& title, const std::string& unit,
                const std::vector<double>& time, const std::vector<double>& value, const std::vector<double>& residual,
                double length_s) {
  Panel p{name, "lines", title, "Measured and fitted: the two should not be told apart.", {"time", "s", {}, {}},
          {},   {}};
  Series measured{"measured", unit, {}, {}}, fitted{"fitted", unit, {}, {}};
  for (std::size_t i = 0; i < time.size() && time[i] < time.front() + length_s; ++i) {
    p.x.values.push_back(time[i]);
    measured.values.push_back(value[i] * deg);
    fitted.values.push_back((value[i] - residual[i]) * deg);
  }
  p.y = {measured, fitted};
  return p;
}

Panel residual_panel(const std::string& name, const std::string& title, const std::string& unit,
                     const std::vector<double>& time, const std::vector<double>& residual) {
  return {name,
          "points",
          title,
          "Noise without a pattern means that the model holds; waves mean that it does not.",
          {"time", "s", thinned(time, 1), {}},
          {{"residual", unit, thinned(residual, deg), {}}},
          {}};
}

Panel delay_panel(const SplineFit& spline, const std::vector<SwingDelay>& extrema,
                  const std::vector<SwingDelay>& damped) {
  Panel p{"delay_by_amplitude",
          "points",
          "Delay of each swing",
          "The published estimator falls with the amplitude because it leaves out the phase that friction adds; with "
          "that phase, and in the joint fit, the delay is the same for all swings.",
          {"amplitude", "deg", {}, {}},
          {{"extrema", "ms", {}, {}}, {"damped", "ms", {}, {}}, {"spline", "ms", {}, {}}},
          {}};
  for (const SwingDelay& d : damped) {
    const auto same = [&](const SwingDelay& e) { return e.swing.from_s == d.swing.from_s; };
    const auto e = std::find_if(extrema.begin(), extrema.end(), same);
    const auto s = std::find_if(spline.stretches.begin(), spline.stretches.end(), [&](const StretchDelay& x) {
      return x.middle_s >= d.swing.from_s && x.middle_s < d.swing.to_s;
    });
    if (e == extrema.end() || s == spline.stretches.end()) continue;
    p.x.values.push_back(d.swing.amplitude_rad * deg);
    p.y[0].values.push_back(e->delay_s * 1e3);
    p.y[1].values.push_back(d.delay_s * 1e3);
    p.y[2].values.push_back(s->delay_s * 1e3);
    p.y[2].sigma.push_back(s->sigma_s * 1e3);
  }
  return p;
}

}  // namespace

Evidence evidence(const SplineFit& spline, const std::vector<SwingDelay>& extrema,
                  const std::vector<SwingDelay>& damped, const Swings& swings) {
  Evidence e;
  const double length = 4 * swings.period_s;
  e.panels.push_back(fit_panel("angle", "Angle of the dial", "deg", spline.angle_time_s, spline.angle_rad,
                               spline.angle_residual_rad, length));
  e.panels.push_back(fit_panel("rate", "Rate of the gyro along the pivot", "deg/s", spline.rate_time_s,
                               spline.rate_rad_s, spline.rate_residual_rad_s, length));
  if (Panel p = delay_panel(spline, extrema, damped); !p.x.values.empty()) e.panels.push_back(std::move(p));
  e.panels.push_back(residual_panel("angle_residuals", "What the fit leaves of the angle", "deg", spline.angle_time_s,
                                    spline.angle_residual_rad));
  e.panels.push_back(residual_panel("rate_residuals", "What the fit leaves of the rate", "deg/s", spline.rate_time_s,
                                    spline.rate_residual_rad_s));
  return e;
}

}  // namespace takt::pendulum
