// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <random>
#include <string>

#include "takt/calibration/estimate.h"

/// What an alignment of a 60 s recording looks like: all its panels, with realistic sizes. Tests only.
namespace takt::report {

inline Panel rates_panel(const std::string& name, const std::string& title, double camera_shift_s) {
  Panel p{name, "lines", title, "Rotation rate of both sensors, each by its own stamps.", {"time", "s", {}, {}},
          {},   {}};
  Series camera{"cam0", "rad/s", {}, {}}, imu{"imu0", "rad/s", {}, {}};
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  const auto rate = [](double t) {
    return std::abs(0.9 * std::sin(2.1 * t) + 0.6 * std::sin(5.3 * t + 1) + 0.3 * std::sin(11.7 * t + 2)) *
           (0.6 + 0.4 * std::sin(0.21 * t));
  };
  for (int i = 0; i < 4 * 200; ++i) {  // the liveliest seconds: over a minute 12 ms would not show
    const double t = 20 + i / 200.0;
    p.x.values.push_back(t);
    imu.values.push_back(rate(t) + 0.004 * noise(random));
    const bool gap = t > 22.5 && t < 22.7;
    camera.values.push_back(gap ? std::nan("") : rate(t + camera_shift_s) + 0.008 * noise(random));
  }
  p.y = {imu, camera};
  return p;
}

inline Panel correlation_panel() {
  Panel p{"correlation",
          "lines",
          "Correlation of the rotation rates",
          "One clear peak means one possible offset; a second one nearly as high would leave a doubt.",
          {"offset", "s", {}, {}},
          {{"correlation", "", {}, {}}},
          {}};
  for (int i = -1500; i <= 1500; ++i) {
    const double t = i / 1000.0, d = t - 0.0123;
    p.x.values.push_back(t);
    p.y[0].values.push_back(0.62 * std::exp(-d * d / 0.012) + 0.35 * std::cos(6.4 * d) * std::exp(-d * d));
  }
  p.marks = {{"12.3 ms", 0.0123}, {"second peak, 0.35", 0.98}};
  return p;
}

inline Panel residuals_panel() {
  Panel p{"residuals",
          "points",
          "Residuals of the fit",
          "What is left of each frame's rotation; no trend and no growth is good.",
          {"time", "s", {}, {}},
          {{"about x", "rad", {}, {}}, {"about y", "rad", {}, {}}},
          {}};
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 4e-4);
  for (int i = 0; i < 1200; ++i) {
    p.x.values.push_back(i / 20.0);
    for (Series& s : p.y) {
      s.values.push_back(noise(random));
      s.sigma.push_back(4e-4);
    }
  }
  return p;
}

inline Panel windows_panel() {
  Panel p{"windows",
          "points",
          "Offset in windows of six seconds",
          "Each window alone; all should agree with the band, which is the answer with its ±1 σ.",
          {"time", "s", {}, {}},
          {{"one window", "s", {}, {}}, {"answer", "s", {}, {}}},
          {}};
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  for (int i = 0; i < 10; ++i) {
    p.x.values.push_back(3 + 6.0 * i);
    const double sigma = 0.00022 + 0.00004 * (i % 4);
    p.y[0].values.push_back(0.01234 + sigma * noise(random));
    p.y[0].sigma.push_back(sigma);
    p.y[1].values.push_back(0.01234);
    p.y[1].sigma.push_back(0.00008);
  }
  p.y[1].kind = "lines";
  return p;
}

inline Panel coherence_panel() {
  Panel p{"coherence",
          "spectrum",
          "Coherence and phase",
          "Where the coherence is high, the phase is a straight line whose slope is the offset.",
          {"frequency", "Hz", {}, {}},
          {{"coherence", "", {}, {}}, {"phase", "rad", {}, {}}},
          {}};
  for (int i = 0; i < 300; ++i) {
    const double f = i / 30.0;
    p.x.values.push_back(f);
    p.y[0].values.push_back(1 / (1 + std::pow(f / 4.5, 6)));
    p.y[1].values.push_back(2 * 3.14159265 * f * 0.01234 + 0.02 * std::sin(40 * f) * (1 + f));
  }
  p.y[1].kind = "points";
  return p;
}

inline Panel histogram_panel() {
  Panel p{"histogram",
          "histogram",
          "Normalised residuals",
          "They should follow a standard normal distribution.",
          {"residual / σ", "", {}, {}},
          {{"frames", "", {}, {}}},
          {}};
  for (int i = -8; i <= 8; ++i) {
    p.x.values.push_back(i * 0.5);
    p.y[0].values.push_back(std::round(240 * std::exp(-0.125 * i * i)));
  }
  return p;
}

inline Panel stems_panel() {
  Panel p{"taps", "stems", "Filter taps", "", {"tap", "", {}, {}}, {{"weight", "", {}, {}}}, {}};
  for (int i = 0; i < 24; ++i) {
    p.x.values.push_back(i);
    p.y[0].values.push_back(std::cos(i * 0.7) * std::exp(-0.1 * i));
  }
  return p;
}

inline Estimate method(const std::string& name, double offset_s, double sigma_s) {
  Estimate e;
  e.method = name;
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = from_seconds(offset_s);
  e.sigma_s = sigma_s;
  e.epoch = from_ns(1'700'000'114'480'613'928);
  return e;
}

inline Estimate sample() {
  Estimate e = method("ml", 0.01234, 0.00008);
  e.drift = 1.2e-6;
  e.drift_sigma = 2.1e-6;
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.line_delay_s = 29.4e-6;
  e.line_delay_sigma_s = 0.6e-6;
  Mat4 T = Mat4::Identity();
  T.topRows<3>() << 0.0148655, -0.999881, 0.0041403, -0.0216401, 0.999557, 0.0149672, 0.0257155, -0.064677, -0.0257744,
      0.00375619, 0.999661, 0.00981073;
  e.T_reference_sensor = T;
  e.extras = {{"focal_px", 458.654, 0.9}, {"gyro_bias_x_rad_s", -0.00213, 0.00004}};
  e.notes = {"cam0: stamps taken as the middle of the exposure", "imu0: rates taken as rad/s (rms 0.71)"};
  Estimate tdicp = method("tdicp", 0.01222, 0.0003);
  tdicp.doubt(Verdict::weak, "converged to within 0.4 ms only");
  e.estimates = {method("correlation", 0.0121, 0.0006), method("phase", 0.01241, 0.00012), tdicp,
                 method("ml", 0.01234, 0.00008)};
  e.estimates.push_back(Estimate::refusal("attitude", "the recording has no attitude"));
  e.evidence.panels = {rates_panel("rates_before", "Rotation rates, as stamped", 0.06),
                       rates_panel("rates_after", "Rotation rates, aligned", 0),
                       correlation_panel(),
                       windows_panel(),
                       residuals_panel(),
                       coherence_panel(),
                       histogram_panel(),
                       stems_panel()};
  e.provenance = {"0.1.0",
                  "takt align drive --sensor cam0 --report report.html",
                  {{"drive/mav0/cam0/data.csv", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
                   {"drive/mav0/imu0/data.csv", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"}},
                  1,
                  {{"eigen", "3.4.0"}, {"opencv", "4.6.0"}}};
  return e;
}

}  // namespace takt::report
