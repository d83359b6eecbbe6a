// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/batch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "takt/calibration/words.h"
#include "takt/estimators/batch/answer.h"
#include "takt/estimators/batch/evidence.h"
#include "takt/estimators/batch/verdict.h"

namespace takt {

using namespace batch;

namespace {

constexpr double significant_sigmas = 4;
/// Rows that ask for less than this between the first and the last are a global shutter's (s).
constexpr double shortest_readout_s = 2e-5;
constexpr double usual_knots_s = 0.02, closest_knots_s = 0.005;
/// Neighbouring residuals that are alike by more than this: the spline is too stiff for the motion.
constexpr double stiff_correlation = 0.1;
constexpr double seconds_a_window = 5;
/// The models look at the same data: they may differ by this share of what those know. Where the spline has more
/// sensors to look at, by more.
constexpr double models_agree_sigmas = 2, joint_agrees_sigmas = 4;

// --- One camera against one IMU, by the discrete model ---

struct Pair {
  const CameraSession* camera = nullptr;
  const ImuSession* imu = nullptr;
  Start start;
  DiscreteFit fast;
  std::vector<std::string> refusals;  ///< empty: it is calibrated
};

Pair fit_pair(const CameraSession& camera, const ImuSession& imu, const BatchOptions& options) {
  Pair out{&camera, &imu, {}, {}, {}};
  if (!imu.counts_metres()) {
    out.refusals = {
        fmt::format("{} reads {:.3g} m/s² in the middle, where gravity alone makes 9.8: in which unit does "
                    "its accelerometer count?",
                    imu.stream->name, imu.typical_accel)};
    return out;
  }
  out.start = find_start(camera, imu);
  if (!out.start.refusal.empty()) {
    out.refusals = {out.start.refusal};
    if (const std::string advice = turn_advice(turn_excitation(camera)); !advice.empty())
      out.refusals.push_back(advice);
    return out;
  }
  out.fast = fit_discrete(camera, imu, out.start, options.threads);
  if (out.fast.converged) return out;
  out.refusals = {out.fast.failure};
  const TurnExcitation turn = turn_excitation(imu, out.start.R_imu_cam, imu.curve.begin_s(), imu.curve.end_s());
  if (const std::string advice = turn_advice(turn); !advice.empty()) out.refusals.push_back(advice);
  return out;
}

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

bool wants_rows(const Pair& pair, const BatchOptions& options) {
  return options.line_delay || pair.camera->stream->timing.shutter == Shutter::rolling ||
         rows_ask(pair.fast, *pair.camera);
}

// --- All of them, by the spline ---

struct SplineAnswer {
  std::optional<SplineModel> model;
  bool converged = false;
  Residuals residuals;
  std::vector<std::vector<WindowOffset>> windows;           ///< one list a camera
  std::vector<double> camera_drift_sigma, imu_drift_sigma;  ///< before it was fixed at none
  std::vector<ImuEvidence> imu_left;                        ///< what the IMUs ask for and did not get
};

double lag_one(const std::vector<Vec3>& r) {
  double squares = 0, products = 0;
  for (std::size_t i = 1; i < r.size(); ++i) squares += r[i].squaredNorm(), products += r[i].dot(r[i - 1]);
  return squares > 0 ? products / squares : 0;
}

/// How alike neighbouring residuals of the IMUs are, the worst of them.
double likeness(const Residuals& residuals) {
  double most = 0;
  for (const ImuResiduals& r : residuals.imus) most = std::max({most, lag_one(r.gyro), lag_one(r.accel)});
  return most;
}

/// With knots as close as the residuals ask for.
void choose_knots(SplineAnswer& out, const Rig& rig, const MotionStart& start, SplineOptions wanted,
                  const BatchOptions& options) {
  const double finest = 2 * rig.imus[0]->curve.median_step_s();
  wanted.knot_interval_s = options.knots_s.value_or(std::max(usual_knots_s, finest));
  double stiffness = std::numeric_limits<double>::infinity();
  for (;;) {
    SplineModel model(rig, start, wanted);
    if (options.imu_model == "scale-misalignment")
      for (std::size_t m = 0; m < rig.imus.size(); ++m) model.free_matrices(m);
    const bool converged = model.solve();
    const double now = converged ? likeness(model.residuals()) : 0;
    // Closer knots are kept only where they help: noise that is itself correlated they cannot whiten.
    const bool helped = now < stiffness - 0.05;
    if (helped || !out.model) {
      out.model.emplace(std::move(model));
      out.converged = converged;
    }
    const double closer = 0.5 * wanted.knot_interval_s;
    const bool again = converged && helped && now > stiff_correlation && !options.knots_s &&
                       closer >= std::max(closest_knots_s, finest);
    if (!again) break;
    stiffness = now;
    wanted.knot_interval_s = closer;
  }
}

/// What the data do not ask for is fixed at none: the offset then is not burdened with its uncertainty.
void fix_small(SplineAnswer& out, const Rig& rig, const BatchOptions& options) {
  SplineModel& model = *out.model;
  const BorderLayout layout = model.layout();
  const Eigen::MatrixXd covariance = model.covariance();
  const auto small = [&](double value, int at) {
    return at >= 0 && std::abs(value) < significant_sigmas * std::sqrt(covariance(at, at));
  };
  const auto sigma = [&](int at) { return at < 0 ? 0 : std::sqrt(covariance(at, at)); };
  bool fixed = false;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const CameraLink& link = model.calibration().cameras[c];
    const BorderLayout::Camera& at = layout.cameras[c];
    out.camera_drift_sigma.push_back(sigma(at.drift));
    const bool rolling = rig.cameras[c]->stream->timing.shutter == Shutter::rolling;
    const bool no_drift = !options.drift && small(link.drift, at.drift);
    const bool no_rows = !options.line_delay && !rolling && small(link.line_delay_s, at.line_delay);
    if (no_drift) model.fix_camera_drift(c);
    if (no_rows) model.fix_line_delay(c);
    fixed = fixed || no_drift || no_rows;
  }
  for (std::size_t m = 0; m < rig.imus.size(); ++m) {
    out.imu_drift_sigma.push_back(sigma(layout.imus[m].drift));
    if (options.drift || !small(model.calibration().imus[m].drift, layout.imus[m].drift)) continue;
    model.fix_imu_drift(m);
    fixed = true;
  }
  if (fixed) out.converged = model.settle();
}

SplineAnswer fit_rig(const std::vector<const Pair*>& cameras, const std::vector<const Pair*>& imus,
                     const BatchOptions& options) {
  SplineAnswer out;
  SplineOptions wanted;
  wanted.threads = options.threads;
  wanted.find_imus = options.imu_model == "auto";
  Rig rig;
  rig.imus.push_back(cameras.front()->imu);
  std::vector<const DiscreteFit*> camera_fits, imu_fits;
  for (const Pair* pair : cameras) {
    rig.cameras.push_back(pair->camera);
    camera_fits.push_back(&pair->fast);
    wanted.line_delay.push_back(wants_rows(*pair, options));
  }
  for (const Pair* pair : imus) {
    rig.imus.push_back(pair->imu);
    imu_fits.push_back(&pair->fast);
  }
  choose_knots(out, rig, join_pairs(camera_fits, imu_fits), wanted, options);
  if (out.converged) fix_small(out, rig, options);
  if (!out.converged) return out;
  out.residuals = out.model->residuals();
  out.imu_left = out.model->imu_evidence();
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const std::vector<double>& t = out.residuals.cameras[c].frame_t;
    const double length = t.back() - t.front();
    out.windows.push_back(out.model->window_offsets(c, std::clamp(static_cast<int>(length / seconds_a_window), 2, 24)));
  }
  return out;
}

// --- Doubts ---

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
void compare_models(Estimate& spline, Estimate& discrete, bool same_data) {
  if (!discrete.answered() || !spline.answered()) return;
  if (spline.line_delay_s.value_or(0) != discrete.line_delay_s.value_or(0)) {
    discrete.doubt(Verdict::weak, "this model knows no rolling shutter: its offset is for some middle row");
    return;
  }
  for (const Extra& x : spline.extras) {
    const bool jitters = x.name == "stamp_jitter_s" && x.value > noted_jitter_s;
    const bool imperfect = x.name == "gyro_matrix_00" || x.name == "accel_lag_s";
    if (!jitters && !imperfect) continue;
    discrete.doubt(Verdict::weak, jitters ? "this model knows no jitter of the stamps"
                                          : "this model takes the IMU for what its data sheet says");
    return;
  }
  const double apart = to_seconds(*spline.offset - *discrete.offset) +
                       spline.drift.value_or(0) * to_seconds(discrete.epoch - spline.epoch);
  const double allowed = std::max(*spline.sigma_s, *discrete.sigma_s);
  if (std::abs(apart) > (same_data ? models_agree_sigmas : joint_agrees_sigmas) * allowed)
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

void check(const BatchOptions& options, std::size_t cameras, std::size_t imus) {
  if (options.model != "auto" && options.model != "discrete" && options.model != "spline")
    throw std::invalid_argument("calibrate: no model is called " + options.model +
                                "; there are auto, discrete, spline");
  if (options.imu_model != "auto" && options.imu_model != "calibrated" && options.imu_model != "scale-misalignment")
    throw std::invalid_argument("calibrate: no model of an IMU is called " + options.imu_model +
                                "; there are auto, calibrated, scale-misalignment");
  if (cameras == 0 || imus == 0)
    throw std::invalid_argument(fmt::format("calibrate: {} cameras and {} IMUs: one of each is needed", cameras, imus));
}

// --- Answers ---

Estimate blank_camera(const CornerStream& camera, const ImuStream& imu, const std::string& method) {
  Estimate e = blank(camera.name, imu.name, method);
  e.frame_instant = "middle";
  e.frame_row = camera.timing.row == RowReference::first ? "first" : "middle";
  return e;
}

std::string answering(const BatchOptions& options) {
  return options.model == "discrete" ? "discrete" : "spline";
}

/// A camera by one of the models, with all doubts that both share.
Estimate camera_answer(const Found& f, std::size_t c, const Pair& pair, const std::string& method,
                       const BatchOptions& options) {
  Estimate e = blank_camera(*pair.camera->stream, *pair.imu->stream, method);
  write_camera(e, f, c, *pair.camera, *pair.imu, options.drift);
  const CameraLink& link = f.calibration.cameras[c];
  const double from = pair.fast.chain.front().time_s, to = pair.fast.chain.back().time_s;
  const TurnExcitation turn =
      turn_excitation(*pair.imu, link.T_imu_cam.rotation.toRotationMatrix(), link.imu_time(from), link.imu_time(to));
  doubt_geometry(e, pose_sigma(f.covariance, f.layout.cameras[c]), turn);
  doubt_views(e, *pair.camera, pair.fast.chain.size(), pair.fast.strangers, to - from, f.noise.cameras[c].corner_px);
  doubt_scale(e, f.calibration, f.sigma(f.layout.board_scale), f.sigma(f.layout.gravity));
  rescale_translation(e, f.calibration);
  if (pair.imu->was_in_g)
    e.reasons.push_back(
        fmt::format("the accelerometer of {} counts in g: taken as 9.80665 m/s² each", pair.imu->stream->name));
  e.extras.push_back({"frames", static_cast<double>(pair.fast.chain.size()), std::nullopt});
  e.extras.push_back({"stray_corners", static_cast<double>(pair.camera->poses.stray), std::nullopt});
  return e;
}

Estimate discrete_answer(Pair& pair, bool rows_known, const BatchOptions& options) {
  drop_small_drift(pair.fast, options.drift);
  const Found f{pair.fast.calibration, pair.fast.layout, pair.fast.covariance, pair.fast.noise};
  Estimate e = camera_answer(f, 0, pair, "discrete", options);
  if (rows_ask(pair.fast, *pair.camera) && !rows_known)
    e.doubt(Verdict::weak,
            "the rows of the picture are not read at once, which this model does not know: its "
            "offset is for some middle row (--model spline)");
  doubt_sigma(e);
  return e;
}

Estimate spline_answer(const SplineAnswer& fine, std::size_t c, const std::vector<const Pair*>& cameras,
                       Estimate& discrete, const BatchOptions& options) {
  const Pair& pair = *cameras[c];
  const SplineModel& m = *fine.model;
  const Found f{m.calibration(), m.layout(), m.covariance(), m.noise()};
  Estimate e = camera_answer(f, c, pair, "spline", options);
  if (!e.drift_sigma) e.drift_sigma = fine.camera_drift_sigma[c];
  if (c > 0) write_chain(e, f, c - 1, c, cameras[c - 1]->camera->stream->name);
  e.extras.push_back({"knot_interval_s", m.knot_interval_s(), std::nullopt});
  e.extras.push_back({"reprojection_rms_px", m.noise().cameras[c].corner_px, std::nullopt});
  doubt_lens(e, fine.residuals.cameras[c], *pair.camera, m.noise().cameras[c].corner_px,
             pose_sigma(f.covariance, f.layout.cameras[c]), options.threads);
  doubt_windows(e, fine.windows[c]);
  doubt_sigma(e);
  doubt_imu(e, m.calibration().imus[0], m.layout().imus[0], fine.imu_left[0]);
  compare_models(e, discrete, m.calibration().cameras.size() + m.calibration().imus.size() == 2);
  return e;
}

void add_panels(Estimate& e, const SplineAnswer& fine, std::size_t c) {
  const Calibration& found = fine.model->calibration();
  e.evidence.panels.insert(e.evidence.panels.end(),
                           {windows_panel(fine.windows[c], found.cameras[c].offset_s, e.sigma_s.value_or(0)),
                            reprojection_panel(fine.residuals.cameras[c]), lateness_panel(fine.residuals.cameras[c]),
                            gyro_panel(fine.residuals.imus[0]), accel_panel(fine.residuals.imus[0]),
                            bias_panel(found.imus[0].bias, true), bias_panel(found.imus[0].bias, false)});
}

/// A further IMU against the first by what the discrete model says of the first camera against both. The camera's
/// errors, which they share, are counted twice.
Estimate imu_by_pairs(const Pair& body, const Pair& further) {
  const MotionStart joined = join_pairs({&body.fast}, {&further.fast});
  const ImuLink& link = joined.calibration.imus[1];
  Estimate e = blank(further.imu->stream->name, body.imu->stream->name, "discrete");
  e.offset = (body.imu->epoch - further.imu->epoch) + from_seconds(link.offset_s);
  const auto sigma = [](const Pair& p, int at) { return at < 0 ? 0 : std::sqrt(p.fast.covariance(at, at)); };
  const BorderLayout::Camera &a = body.fast.layout.cameras[0], &b = further.fast.layout.cameras[0];
  e.sigma_s = std::hypot(sigma(body, a.offset), sigma(further, b.offset));
  e.epoch = further.imu->epoch + from_seconds(link.centre_s);
  e.drift = link.drift;
  e.drift_sigma = std::hypot(sigma(body, a.drift), sigma(further, b.drift));
  e.T_reference_sensor = link.T_body_imu.matrix();
  return e;
}

Estimate imu_answer(const SplineAnswer& fine, std::size_t m, const Pair& body, const Pair& further) {
  const SplineModel& model = *fine.model;
  const Found f{model.calibration(), model.layout(), model.covariance(), model.noise()};
  Estimate e = blank(further.imu->stream->name, body.imu->stream->name, "spline");
  write_imu(e, f, m, *further.imu, *body.imu);
  if (!e.drift_sigma) e.drift_sigma = fine.imu_drift_sigma[m];
  doubt_imu(e, model.calibration().imus[m], model.layout().imus[m], fine.imu_left[m]);
  doubt_sigma(e);
  return e;
}

Estimate refused(Estimate e, const std::vector<std::string>& reasons) {
  for (const std::string& why : reasons) e.doubt(Verdict::refused, why);
  return e;
}

/// The rig's sensors as they are opened and paired: every camera with the first IMU, the first camera that this
/// calibrates with every further IMU.
struct Paired {
  std::deque<CameraSession> camera_sessions;
  std::deque<ImuSession> imu_sessions;
  std::vector<Pair> cameras, imus;  ///< one each, in order; imus[0] is empty
};

Paired pair_up(std::span<const CornerStream> cameras, std::span<const ImuStream> imus, const BatchOptions& options) {
  Paired out;
  out.cameras.resize(cameras.size());
  out.imus.resize(imus.size());
  const auto open = [&](const ImuStream& imu) -> const ImuSession& {
    return out.imu_sessions.emplace_back(open_imu(imu));
  };
  const ImuSession* body = nullptr;
  const Pair* first = nullptr;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (const std::string why = no_data(cameras[c], imus[0]); !why.empty()) {
      out.cameras[c].refusals = {why};
      continue;
    }
    if (!body) body = &open(imus[0]);
    const CameraSession& camera = out.camera_sessions.emplace_back(open_camera(cameras[c], options.threads));
    out.cameras[c] = fit_pair(camera, *body, options);
    if (!first && out.cameras[c].refusals.empty()) first = &out.cameras[c];
  }
  for (std::size_t m = 1; m < imus.size(); ++m) {
    if (!first)
      out.imus[m].refusals = {fmt::format("no camera has an answer against {}", imus[0].name)};
    else if (const std::string why = no_data(*first->camera->stream, imus[m]); !why.empty())
      out.imus[m].refusals = {why};
    else
      out.imus[m] = fit_pair(*first->camera, open(imus[m]), options);
  }
  return out;
}

std::vector<const Pair*> usable(const std::vector<Pair>& pairs) {
  std::vector<const Pair*> out;
  for (const Pair& p : pairs)
    if (p.camera && p.refusals.empty()) out.push_back(&p);
  return out;
}

}  // namespace

std::vector<Estimate> calibrate_rig(std::span<const CornerStream> cameras, std::span<const ImuStream> imus,
                                    const BatchOptions& options) {
  check(options, cameras.size(), imus.size());
  Paired paired = pair_up(cameras, imus, options);
  const std::vector<const Pair*> good_cameras = usable(paired.cameras), good_imus = usable(paired.imus);
  const SplineAnswer fine =
      options.model == "discrete" || good_cameras.empty() ? SplineAnswer{} : fit_rig(good_cameras, good_imus, options);

  std::vector<Estimate> out;
  std::size_t at = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    Pair& pair = paired.cameras[c];
    const bool good = pair.camera && pair.refusals.empty();
    Estimate e = refused(blank_camera(cameras[c], imus[0], answering(options)), pair.refusals);
    std::vector<Estimate> both;
    if (good) {
      both.push_back(discrete_answer(pair, fine.converged, options));
      if (fine.converged)
        both.push_back(spline_answer(fine, at, good_cameras, both[0], options));
      else if (fine.model)
        both.push_back(refused(blank_camera(cameras[c], imus[0], "spline"), {fine.model->failure()}));
      e = both.back();
    }
    if (!pair.start.curve.name.empty()) e.evidence.panels.push_back(pair.start.curve);
    if (pair.camera) e.evidence.panels.push_back(coverage_panel(pair.camera->poses.views));
    if (good && fine.converged) add_panels(e, fine, at);
    e.estimates = std::move(both);
    if (good) ++at;
    out.push_back(std::move(e));
  }
  at = 1;
  for (std::size_t m = 1; m < imus.size(); ++m) {
    const Pair& pair = paired.imus[m];
    const bool good = pair.camera && pair.refusals.empty();
    Estimate e = refused(blank(imus[m].name, imus[0].name, answering(options)), pair.refusals);
    if (good && fine.converged)
      e = imu_answer(fine, at, *good_cameras.front(), pair);
    else if (good && fine.model)
      e.doubt(Verdict::refused, fine.model->failure());
    else if (good)
      e = imu_by_pairs(*good_cameras.front(), pair);
    if (good) ++at;
    out.push_back(std::move(e));
  }
  return out;
}

Estimate calibrate_batch(const CornerStream& camera, const ImuStream& imu, const BatchOptions& options) {
  return calibrate_rig({&camera, 1}, {&imu, 1}, options).front();
}

}  // namespace takt
