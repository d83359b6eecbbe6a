// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/batch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/calibration/words.h"
#include "takt/estimators/batch/evidence.h"
#include "takt/estimators/batch/verdict.h"

namespace takt {

using namespace batch;

namespace {

constexpr double significant_sigmas = 4;
/// Rows that ask for less than this between the first and the last are a global shutter's (s).
constexpr double shortest_readout_s = 2e-5;
constexpr double plausible_drift = 5e-4;
constexpr double usual_knots_s = 0.02, closest_knots_s = 0.005;
/// Neighbouring residuals that are alike by more than this: the spline is too stiff for the motion.
constexpr double stiff_correlation = 0.1;
constexpr double seconds_a_window = 5;
/// The models look at the same data: they may differ by this share of what those know.
constexpr double models_agree_sigmas = 2;
/// Stamps that jitter by less are as good as any.
constexpr double noted_jitter_s = 2e-5;

/// One model's answer in internal units, before it is written as an Estimate.
struct Found {
  const Calibration& calibration;
  const BorderLayout& layout;
  const Eigen::MatrixXd& covariance;
  const Noise& noise;

  [[nodiscard]] double sigma(int border) const { return border < 0 ? 0 : std::sqrt(covariance(border, border)); }
};

Estimate blank(const CornerStream& camera, const ImuStream& imu) {
  Estimate e;
  e.method = "spline";
  e.sensor = camera.name;
  e.reference = imu.name;
  e.verdict = Verdict::trusted;
  e.frame_instant = "middle";
  e.frame_row = camera.timing.row == RowReference::first ? "first" : "middle";
  return e;
}

void add_triple(Estimate& e, const char* pattern, const Vec3& value, const Found& f, int border) {
  for (int i = 0; i < 3; ++i)
    e.extras.push_back({fmt::format(fmt::runtime(pattern), "xyz"[i]), value[i], f.sigma(border + i)});
}

/// The calibration block as a result: everything with its σ.
void write_block(Estimate& e, const Found& f, const CameraSession& camera, const ImuSession& imu) {
  const CameraLink& link = f.calibration.cameras[0];
  const BorderLayout::Camera& at = f.layout.cameras[0];
  e.offset = (imu.epoch - camera.epoch) + from_seconds(link.offset_s);
  e.sigma_s = f.sigma(at.offset);
  e.epoch = camera.epoch + from_seconds(link.centre_s);
  e.drift = link.drift;
  if (at.drift >= 0) e.drift_sigma = f.sigma(at.drift);
  e.line_delay_s = link.line_delay_s;
  if (at.line_delay >= 0) e.line_delay_sigma_s = f.sigma(at.line_delay);
  e.T_reference_sensor = link.T_imu_cam.matrix();

  add_triple(e, "rotation_{}_rad", log_so3(link.T_imu_cam.rotation), f, at.rotation);
  add_triple(e, "translation_{}_m", link.T_imu_cam.translation, f, at.translation);
  add_triple(e, "gravity_board_{}_m_s2", f.calibration.gravity_board, f, f.layout.gravity);
  e.extras.push_back({"board_scale", f.calibration.board_scale, f.sigma(f.layout.board_scale)});
  const BiasCurve& bias = f.calibration.bias;
  const auto middle = bias.at(bias.begin_s + 0.5 * bias.knots.duration_s());
  const int bias_at = f.layout.bias + 6 * (middle.first + 1);  // the control point that acts most
  add_triple(e, "gyro_bias_{}_rad_s", bias.gyro(middle), f, bias_at);
  add_triple(e, "accel_bias_{}_m_s2", bias.accel(middle), f, bias_at + 3);
  e.extras.push_back({"corner_noise_px", f.noise.corner_px, std::nullopt});
  e.extras.push_back({"gyro_noise_rad_s_sqrthz", f.noise.gyro_density, std::nullopt});
  e.extras.push_back({"accel_noise_m_s2_sqrthz", f.noise.accel_density, std::nullopt});
}

// --- The discrete model ---

/// A drift that the data do not ask for is fixed at none: by conditioning, exact for Gaussian errors.
void drop_small_drift(DiscreteFit& fit, bool keep) {
  const int at = fit.layout.cameras[0].drift;
  const double drift = fit.calibration.cameras[0].drift, variance = fit.covariance(at, at);
  if (keep || std::abs(drift) > significant_sigmas * std::sqrt(variance)) return;
  const Eigen::VectorXd along = fit.covariance.col(at) / variance;
  retract(fit.calibration, fit.layout, -drift * along);
  fit.calibration.cameras[0].drift = 0;
  const double sigma2 = variance;
  fit.covariance -= along * along.transpose() * variance;
  fit.covariance(at, at) = sigma2;  // how small it is known to be
}

bool rows_ask(const DiscreteFit& fit, const CameraSession& camera) {
  return std::abs(fit.row_slope_s) > significant_sigmas * fit.row_slope_sigma_s &&
         std::abs(fit.row_slope_s) * camera.model().height > shortest_readout_s;
}

// --- The spline ---

struct SplineAnswer {
  std::optional<SplineModel> model;
  bool converged = false;
  Residuals residuals;
  std::vector<WindowOffset> windows;
  double drift_sigma = 0;  ///< before it was fixed at none
};

double lag_one(const std::vector<Vec3>& r) {
  double squares = 0, products = 0;
  for (std::size_t i = 1; i < r.size(); ++i) squares += r[i].squaredNorm(), products += r[i].dot(r[i - 1]);
  return squares > 0 ? products / squares : 0;
}

SplineAnswer fit_spline_model(const CameraSession& camera, const ImuSession& imu, const DiscreteFit& start,
                              bool free_rows, const BatchOptions& options) {
  SplineAnswer out;
  SplineOptions wanted;
  wanted.line_delay = free_rows;
  wanted.threads = options.threads;
  wanted.knot_interval_s = options.knots_s.value_or(std::max(usual_knots_s, 2 * imu.curve.median_step_s()));
  double stiffness = std::numeric_limits<double>::infinity();
  for (;;) {
    SplineModel model({&camera}, imu, start, wanted);
    const bool converged = model.solve();
    Residuals residuals = converged ? model.residuals() : Residuals{};
    const double now = converged ? std::max(lag_one(residuals.gyro), lag_one(residuals.accel)) : 0;
    // Closer knots are kept only where they help: noise that is itself correlated they cannot whiten.
    const bool helped = now < stiffness - 0.05;
    if (helped || !out.model) {
      out.model.emplace(std::move(model));
      out.converged = converged;
      out.residuals = std::move(residuals);
    }
    const double closer = 0.5 * wanted.knot_interval_s;
    const bool again = converged && helped && now > stiff_correlation && !options.knots_s &&
                       closer >= std::max(closest_knots_s, 2 * imu.curve.median_step_s());
    if (!again) break;
    stiffness = now;
    wanted.knot_interval_s = closer;
  }
  if (!out.converged) return out;

  // What the data do not ask for is fixed at none: the offset then is not burdened with its uncertainty.
  SplineModel& model = *out.model;
  const auto sigma = [&](int at) { return std::sqrt(model.covariance()(at, at)); };
  const BorderLayout::Camera at = model.layout().cameras[0];
  const CameraLink& link = model.calibration().cameras[0];
  const bool no_drift = !options.drift && std::abs(link.drift) < significant_sigmas * sigma(at.drift);
  out.drift_sigma = sigma(at.drift);
  const bool rolling = camera.stream->timing.shutter == Shutter::rolling;
  const bool no_rows = at.line_delay >= 0 && !options.line_delay && !rolling &&
                       std::abs(link.line_delay_s) < significant_sigmas * sigma(at.line_delay);
  if (no_drift) model.fix_drift();
  if (no_rows) model.fix_line_delay();
  if (no_drift || no_rows) out.converged = model.settle();
  if (!out.converged) return out;
  out.residuals = model.residuals();
  const double length = out.residuals.frame_t.back() - out.residuals.frame_t.front();
  out.windows = model.window_offsets(std::clamp(static_cast<int>(length / seconds_a_window), 2, 24));
  return out;
}

// --- Words ---

void say_what_was_found(Estimate& e, const Found& f, const CameraSession& camera, const BatchOptions& options) {
  const CameraLink& link = f.calibration.cameras[0];
  const BorderLayout::Camera& at = f.layout.cameras[0];
  if (link.drift != 0 && !options.drift)
    e.reasons.push_back(fmt::format("the clocks drift by {:.2f} ± {:.2f} ppm, which is part of the answer",
                                    1e6 * link.drift, 1e6 * f.sigma(at.drift)));
  if (std::abs(link.drift) > plausible_drift)
    e.doubt(Verdict::weak,
            fmt::format("a drift of {:.0f} ppm is more than two crystals can differ by", 1e6 * link.drift));
  if (at.line_delay >= 0 && link.line_delay_s != 0 && camera.stream->timing.shutter != Shutter::rolling)
    e.reasons.push_back(fmt::format(
        "a rolling shutter: each row is read {:.3f} ± {:.3f} µs after the one above, and the "
        "offset is for the {} row{}",
        1e6 * link.line_delay_s, 1e6 * f.sigma(at.line_delay), *e.frame_row,
        camera.stream->timing.shutter == Shutter::global ? ", though the recording says that the shutter is global"
                                                         : ""));
  if (f.noise.jitter_s > 0) {
    e.extras.push_back({"stamp_jitter_s", f.noise.jitter_s, std::nullopt});
    if (f.noise.jitter_s > noted_jitter_s)
      e.reasons.push_back(fmt::format("the frames' stamps jitter by {} (σ), which is part of the model",
                                      rounded_time_words(f.noise.jitter_s)));
  }
}

void doubt_windows(Estimate& e, const std::vector<WindowOffset>& windows) {
  const WindowCheck check = check_windows(windows);
  e.extras.push_back({"half_difference_s", check.halves_apart_s, check.halves_sigma_s});
  e.extras.push_back({"window_chi2_per_dof", check.chi2_per_dof, std::nullopt});
  if (check.halves_sigma_s > 0 && std::abs(check.halves_apart_s) > significant_sigmas * check.halves_sigma_s)
    e.doubt(Verdict::weak, fmt::format("the two halves disagree by {}, {:.1f} times the uncertainty of that",
                                       time_words(check.halves_apart_s, check.halves_sigma_s),
                                       std::abs(check.halves_apart_s) / check.halves_sigma_s));
  if (check.scatter() && e.sigma_s) {
    const double wider = std::sqrt(check.chi2_per_dof);
    *e.sigma_s *= wider;
    e.reasons.push_back(fmt::format(
        "the offset's pieces scatter {:.1f} times as far as their noise allows: its σ is widened by as much", wider));
  }
}

void doubt_sigma(Estimate& e) {
  if (e.sigma_s && *e.sigma_s > 1e-3)
    e.doubt(Verdict::weak, fmt::format("little is known: the motion fixes the offset to {} only; turn faster",
                                       rounded_time_words(*e.sigma_s)));
}

/// Where the spline found what the discrete model does not have, that one's answer is no witness.
void compare_models(Estimate& spline, Estimate& discrete) {
  if (!discrete.answered() || !spline.answered()) return;
  if (spline.line_delay_s.value_or(0) != discrete.line_delay_s.value_or(0)) {
    discrete.doubt(Verdict::weak, "this model knows no rolling shutter: its offset is for some middle row");
    return;
  }
  for (const Extra& x : spline.extras)
    if (x.name == "stamp_jitter_s" && x.value > noted_jitter_s) {
      discrete.doubt(Verdict::weak, "this model knows no jitter of the stamps");
      return;
    }
  const double apart = to_seconds(*spline.offset - *discrete.offset) +
                       spline.drift.value_or(0) * to_seconds(discrete.epoch - spline.epoch);
  const double allowed = std::max(*spline.sigma_s, *discrete.sigma_s);
  if (std::abs(apart) > models_agree_sigmas * allowed)
    spline.doubt(Verdict::weak, fmt::format("the discrete model's offset is {} away, {:.1f} times the uncertainty",
                                            rounded_time_words(std::abs(apart)), std::abs(apart) / allowed));
}

/// Metres as the accelerometer has them, where the board is not what its file says.
void rescale_translation(Estimate& e, const Calibration& c) {
  const double ratio = c.board_scale / (c.gravity_board.norm() / earth_gravity);
  if (!e.T_reference_sensor || std::abs(ratio - 1) < 0.02) return;
  e.T_reference_sensor->topRightCorner<3, 1>() *= ratio;
  for (Extra& x : e.extras)
    if (x.name.starts_with("translation_")) {
      x.value *= ratio;
      if (x.sigma) *x.sigma *= ratio;
    }
}

/// What is wrong before anything is fitted.
std::string no_data(const CornerStream& camera, const ImuStream& imu) {
  if (camera.size() == 0) return fmt::format("{} has no frames", camera.name);
  if (imu.size() < 20) return fmt::format("{} has only {} samples", imu.name, imu.size());
  if (imu.accel_m_s2.empty())
    return fmt::format(
        "{} has no accelerometer, without which the camera's place cannot be found: takt align needs the gyro alone",
        imu.name);
  const bool seen = std::ranges::any_of(camera.corners, [](const auto& c) { return !c.empty(); });
  if (!seen)
    return fmt::format(
        "the board was found in none of {} frames: is the target file the right one, and is the picture "
        "sharp and lit?",
        camera.size());
  return "";
}

void check(const BatchOptions& options) {
  if (options.model != "auto" && options.model != "discrete" && options.model != "spline")
    throw std::invalid_argument("calibrate_batch: no model is called " + options.model +
                                "; there are auto, discrete, spline");
}

}  // namespace

Estimate calibrate_batch(const CornerStream& camera_stream, const ImuStream& imu_stream, const BatchOptions& options) {
  check(options);
  const Estimate base = blank(camera_stream, imu_stream);
  const auto refuse = [&](const std::string& why) {
    Estimate e = base;
    e.doubt(Verdict::refused, why);
    return e;
  };
  if (const std::string why = no_data(camera_stream, imu_stream); !why.empty()) return refuse(why);

  const CameraSession camera = open_camera(camera_stream, options.threads);
  const ImuSession imu = open_imu(imu_stream);
  const Start start = find_start(camera, imu);
  if (!start.refusal.empty()) {
    Estimate e = refuse(start.refusal);
    if (!start.curve.name.empty()) e.evidence.panels.push_back(start.curve);
    e.evidence.panels.push_back(coverage_panel(camera));
    return e;
  }
  DiscreteFit fast = fit_discrete(camera, imu, start, {.threads = options.threads});
  if (!fast.converged) {
    Estimate e = refuse(fast.failure);
    const TurnExcitation turn = turn_excitation(imu, start.R_imu_cam, imu.curve.begin_s(), imu.curve.end_s());
    if (const std::string advice = turn_advice(turn); !advice.empty()) e.reasons.push_back(advice);
    e.evidence.panels = {start.curve, coverage_panel(camera)};
    return e;
  }
  const bool rows = options.line_delay || camera_stream.timing.shutter == Shutter::rolling || rows_ask(fast, camera);
  const SplineAnswer fine =
      options.model == "discrete" ? SplineAnswer{} : fit_spline_model(camera, imu, fast, rows, options);
  drop_small_drift(fast, options.drift);

  const CameraLink& link = fast.calibration.cameras[0];
  const double from = fast.chain.front().time_s, to = fast.chain.back().time_s;
  const TurnExcitation turn =
      turn_excitation(imu, link.T_imu_cam.rotation.toRotationMatrix(), link.imu_time(from), link.imu_time(to));
  const auto common = [&](Estimate& e, const Found& f) {
    write_block(e, f, camera, imu);
    doubt_geometry(e, pose_sigma(f.covariance, f.layout.cameras[0]), turn);
    doubt_views(e, camera, fast.chain.size(), fast.strangers, to - from, f.noise.corner_px);
    doubt_scale(e, f.calibration, f.sigma(f.layout.board_scale), f.sigma(f.layout.gravity));
    rescale_translation(e, f.calibration);
    say_what_was_found(e, f, camera, options);
    if (imu.was_in_g)
      e.reasons.push_back(
          fmt::format("the accelerometer of {} counts in g: taken as 9.80665 m/s² each", imu_stream.name));
    e.extras.push_back({"frames", static_cast<double>(fast.chain.size()), std::nullopt});
    e.extras.push_back({"stray_corners", static_cast<double>(camera.poses.stray), std::nullopt});
  };

  Estimate discrete = base;
  discrete.method = "discrete";
  const Found by_discrete{fast.calibration, fast.layout, fast.covariance, fast.noise};
  common(discrete, by_discrete);
  if (rows_ask(fast, camera) && fine.converged == false)
    discrete.doubt(Verdict::weak,
                   "the rows of the picture are not read at once, which this model does not know: its "
                   "offset is for some middle row (--model spline)");
  doubt_sigma(discrete);

  Estimate spline = base;
  if (fine.converged) {
    const SplineModel& m = *fine.model;
    common(spline, {m.calibration(), m.layout(), m.covariance(), m.noise()});
    if (!spline.drift_sigma) spline.drift_sigma = fine.drift_sigma;
    spline.extras.push_back({"knot_interval_s", m.knot_interval_s(), std::nullopt});
    spline.extras.push_back({"reprojection_rms_px", m.noise().corner_px, std::nullopt});
    doubt_windows(spline, fine.windows);
    doubt_sigma(spline);
    compare_models(spline, discrete);
  } else if (fine.model) {
    spline.doubt(Verdict::refused, fine.model->failure());
  }

  Estimate answer = options.model == "discrete" ? discrete : spline;
  answer.evidence.panels = {start.curve, coverage_panel(camera)};
  if (fine.converged) {
    const CameraLink& found = fine.model->calibration().cameras[0];
    answer.evidence.panels.insert(
        answer.evidence.panels.end(),
        {windows_panel(fine.windows, found.offset_s, spline.sigma_s.value_or(0)), reprojection_panel(fine.residuals),
         lateness_panel(fine.residuals), gyro_panel(fine.residuals), accel_panel(fine.residuals),
         bias_panel(fine.model->calibration().bias, true), bias_panel(fine.model->calibration().bias, false)});
  }
  answer.estimates.push_back(discrete);
  if (fine.model) answer.estimates.push_back(spline);
  return answer;
}

}  // namespace takt
