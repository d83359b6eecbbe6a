// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/calibrate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/motion/rigid.h"
#include "takt/recording/camera_file.h"
#include "takt/recording/kalibr_files.h"
#include "takt/recording/open_recording.h"
#include "takt/streams/audit.h"
#include "takt/workflows/pick_named.h"
#include "takt/workflows/see_board.h"

namespace takt {

namespace {

/// Noise figures that differ from the measured ones by more than this factor are worth a word.
constexpr double noted_noise_factor = 3;

std::vector<CameraStream> cameras_of(const Recording& recording, const CalibrateJob& job) {
  std::vector<CameraStream> cameras = pick_named(recording.cameras, job.sensor, "camera", job.input);
  for (CameraStream& camera : cameras) {
    if (!job.camchain.empty()) camera.model = read_camera_file(job.camchain, camera.name);
    if (!camera.model)
      throw Error(fmt::format("no intrinsics for {}", camera.name), job.input,
                  "give them with --camchain FILE, or find them with --cameras-only");
  }
  return cameras;
}

std::vector<ImuStream> imus_of(const Recording& recording, const CalibrateJob& job, std::vector<std::string>& notes) {
  std::vector<ImuStream> imus;
  for (const ImuStream& imu : pick_named(recording.imus, job.reference, "IMU", job.input)) {
    Tidied tidied = tidy(imu);
    for (const std::string& word : tidied.words) notes.push_back(fmt::format("{}: {}", imu.name, word));
    imus.push_back(std::move(tidied.imu));
  }
  return imus;
}

/// imuN against imu0, by what both say of the first camera. Errors of the camera that they share are counted twice.
Estimate between_imus(const Estimate& cam_to_0, const Estimate& cam_to_n) {
  Estimate e;
  e.method = cam_to_n.method;
  e.sensor = cam_to_n.reference;
  e.reference = cam_to_0.reference;
  e.verdict = Verdict::trusted;
  for (const Estimate* one : {&cam_to_0, &cam_to_n})
    if (!one->answered()) {
      e.doubt(Verdict::refused, fmt::format("{} against {} has no answer", one->sensor, one->reference));
      return e;
    }
  // t_0 = t_cam + a, t_n = t_cam + b: t_0 = t_n + (a − b), at the instant that is b's epoch on imuN's clock.
  const Duration there = *cam_to_n.offset;
  const Duration here =
      *cam_to_0.offset + from_seconds(cam_to_0.drift.value_or(0) * to_seconds(cam_to_n.epoch - cam_to_0.epoch));
  e.offset = here - there;
  e.sigma_s = std::hypot(*cam_to_0.sigma_s, *cam_to_n.sigma_s);
  e.epoch = cam_to_n.epoch + there;
  e.drift = cam_to_0.drift.value_or(0) - cam_to_n.drift.value_or(0);
  if (cam_to_0.drift_sigma && cam_to_n.drift_sigma)
    e.drift_sigma = std::hypot(*cam_to_0.drift_sigma, *cam_to_n.drift_sigma);
  if (cam_to_0.T_reference_sensor && cam_to_n.T_reference_sensor)
    e.T_reference_sensor = *cam_to_0.T_reference_sensor * cam_to_n.T_reference_sensor->inverse();
  for (const Estimate* one : {&cam_to_0, &cam_to_n})
    if (one->verdict != Verdict::trusted)
      e.doubt(Verdict::weak, fmt::format("{} against {} is weak", one->sensor, one->reference));
  return e;
}

double extra(const Estimate& e, const std::string& name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  return 0;
}

/// Kalibr would weigh by these figures; here they are measured, so that a wrong one does no harm, but is said.
void compare_noise(Estimate& e, const CalibrateJob& job, const std::vector<KalibrImu>& said) {
  if (said.empty() || !e.answered()) return;
  const auto compare = [&](const char* what, double stated, double measured) {
    if (!(stated > 0 && measured > 0)) return;
    const double factor = measured / stated;
    if (factor < noted_noise_factor && factor > 1 / noted_noise_factor) return;
    e.reasons.push_back(
        fmt::format("the noise of the {} is {:.2g} times what {} says ({:.3g}); the measured one was used", what,
                    factor, job.imu, stated));
  };
  compare("gyro", said.front().noise.gyro_density, extra(e, "gyro_noise_rad_s_sqrthz"));
  compare("accelerometer", said.front().noise.accel_density, extra(e, "accel_noise_m_s2_sqrthz"));
}

void join_others(Estimate& main, const std::vector<Estimate>& all) {
  for (std::size_t i = 1; i < all.size(); ++i) {
    Estimate other = all[i];
    other.evidence = {};
    other.estimates.clear();
    if (!other.answered())
      main.doubt(Verdict::weak, fmt::format("{} against {}: {}", other.sensor, other.reference,
                                            other.reasons.empty() ? "no answer" : other.reasons.front()));
    else if (other.verdict == Verdict::weak)
      main.doubt(Verdict::weak, fmt::format("{} against {} is weak: {}", other.sensor, other.reference,
                                            other.reasons.empty() ? "" : other.reasons.front()));
    main.estimates.push_back(std::move(other));
  }
}

/// What has to be added to a frame's stamp to get the middle of its exposure (s), in the mean.
double stamp_to_middle(const CornerStream& s) {
  double exposure = s.timing.exposure_s;
  if (!s.exposures_s.empty()) {
    exposure = 0;
    for (const double e : s.exposures_s) exposure += e / static_cast<double>(s.exposures_s.size());
  }
  return s.timing.to_exposure_middle_s(exposure);
}

}  // namespace

Calibrated calibrate(const CalibrateJob& job) {
  Calibrated out;
  const Target target = read_kalibr_target_file(job.target);
  const std::vector<KalibrImu> said = job.imu.empty() ? std::vector<KalibrImu>{} : read_kalibr_imus_file(job.imu);
  const Recording recording = open_recording(job.input, job.open);
  std::vector<std::string> notes = recording.notes;
  const std::vector<CameraStream> cameras = cameras_of(recording, job);
  const std::vector<ImuStream> imus = imus_of(recording, job, notes);
  out.cameras = see_board(cameras, target, job.batch.threads, job.progress);
  out.imu_rate_hz = audit(imus.front().stamps).rate_hz.value_or(0);

  for (const CornerStream& camera : out.cameras) out.all.push_back(calibrate_batch(camera, imus.front(), job.batch));
  for (std::size_t i = 1; i < imus.size(); ++i) {
    const Estimate other = calibrate_batch(out.cameras.front(), imus[i], job.batch);
    out.all.push_back(between_imus(out.all.front(), other));
  }
  out.estimate = out.all.front();
  compare_noise(out.estimate, job, said);
  join_others(out.estimate, out.all);
  out.estimate.notes = std::move(notes);
  out.files = recording.files;
  for (const std::string& file : {job.target, job.camchain, job.imu})
    if (!file.empty()) out.files.push_back(file);
  return out;
}

KalibrFiles kalibr_files(const Calibrated& result, bool opencv) {
  const KalibrStyle style = opencv ? KalibrStyle::opencv : KalibrStyle::kalibr;
  KalibrFiles out;
  KalibrCamchain chain;
  std::optional<Rigid> before;
  out.results = fmt::format("Calibration results\n===================\n");
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const CornerStream& seen = result.cameras[i];
    const Estimate& e = result.all[i];
    if (!e.answered() || !e.T_reference_sensor || !seen.model) continue;
    KalibrCamera camera;
    camera.model = *seen.model;
    camera.rostopic = seen.name;
    const Rigid T_imu_cam = Rigid::from_matrix(*e.T_reference_sensor);
    camera.T_cam_imu = T_imu_cam.inverse().matrix();
    if (before) camera.T_cn_cnm1 = (T_imu_cam.inverse() * *before).matrix();
    camera.timeshift_cam_imu_s = to_seconds(*e.offset) + stamp_to_middle(seen);
    if (e.line_delay_s.value_or(0) != 0) camera.line_delay_s = e.line_delay_s;
    before = T_imu_cam;
    chain.push_back(std::move(camera));
    out.results += fmt::format("\n{} against {} ({})\n", e.sensor, e.reference, to_string(e.verdict));
    for (const std::string& why : e.reasons) out.results += fmt::format("  {}\n", why);
    out.results += fmt::format("  timeshift (t_imu = t_cam + shift): {}\n", time_words(*e.offset, e.sigma_s));
    if (e.drift.value_or(0) != 0)
      out.results += fmt::format("  drift: {} ppm\n", value_words(1e6 * *e.drift, 1e6 * e.drift_sigma.value_or(0)));
    for (const Extra& x : e.extras) out.results += fmt::format("  {}: {}\n", x.name, value_words(x.value, x.sigma));
  }
  out.camchain = write_kalibr_camchain(chain, style);

  const Estimate& e = result.estimate;
  KalibrImu imu;
  imu.noise.gyro_density = extra(e, "gyro_noise_rad_s_sqrthz");
  imu.noise.accel_density = extra(e, "accel_noise_m_s2_sqrthz");
  imu.update_rate_hz = result.imu_rate_hz;
  imu.rostopic = e.reference;
  imu.model = "calibrated";
  imu.T_i_b = Mat4::Identity();
  imu.time_offset_s = 0;
  std::vector<KalibrImu> imus{imu};
  for (std::size_t i = result.cameras.size(); i < result.all.size(); ++i) {
    const Estimate& other = result.all[i];
    if (!other.answered()) continue;
    KalibrImu more = imu;
    more.rostopic = other.sensor;
    more.time_offset_s = to_seconds(*other.offset);
    if (other.T_reference_sensor) more.T_i_b = other.T_reference_sensor->inverse();
    imus.push_back(more);
  }
  out.imu = write_kalibr_imus(imus, style);
  return out;
}

}  // namespace takt
