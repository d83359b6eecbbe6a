// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/calibrate.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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

std::optional<double> extra(const Estimate& e, const std::string& name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  return std::nullopt;
}

/// Kalibr would weigh by these figures; here they are measured, so that a wrong one does no harm, but is said.
void compare_noise(Estimate& e, const Estimate& measured_by, const KalibrImu& said, const std::string& file) {
  if (!e.answered()) return;
  const auto compare = [&](const char* what, double stated, const char* name) {
    const double measured = extra(measured_by, name).value_or(0);
    if (!(stated > 0 && measured > 0)) return;
    const double factor = measured / stated;
    if (factor < noted_noise_factor && factor > 1 / noted_noise_factor) return;
    e.reasons.push_back(
        fmt::format("the noise of {}'s {} is {:.2g} times what {} says ({:.3g}); the measured one was used",
                    measured_by.sensor.starts_with("imu") ? measured_by.sensor : measured_by.reference, what, factor,
                    file, stated));
  };
  compare("gyro", said.noise.gyro_density, "gyro_noise_rad_s_sqrthz");
  compare("accelerometer", said.noise.accel_density, "accel_noise_m_s2_sqrthz");
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

const Estimate* first_answer(const Calibrated& result) {
  for (std::size_t i = 0; i < result.cameras.size(); ++i)
    if (result.all[i].answered()) return &result.all[i];
  return nullptr;
}

/// What an answer says of its IMU. M of the gyro is lower triangular times a rotation, as Kalibr has it: G = M·C.
KalibrImu kalibr_imu(const Estimate& e, const std::string& name, double rate_hz) {
  KalibrImu imu;
  imu.noise.gyro_density = extra(e, "gyro_noise_rad_s_sqrthz").value_or(0);
  imu.noise.accel_density = extra(e, "accel_noise_m_s2_sqrthz").value_or(0);
  imu.update_rate_hz = rate_hz;
  imu.rostopic = name;
  imu.model = "calibrated";
  imu.T_i_b = Mat4::Identity();
  imu.time_offset_s = 0;
  if (!extra(e, "gyro_matrix_00")) return imu;
  Mat3 gyro = Mat3::Identity(), accel = Mat3::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      gyro(row, column) = extra(e, fmt::format("gyro_matrix_{}{}", row, column)).value_or(row == column);
      accel(row, column) = extra(e, fmt::format("accel_matrix_{}{}", row, column)).value_or(row == column);
    }
  // G·Gᵀ = M·Mᵀ.
  const Mat3 M = Eigen::LLT<Mat3>(gyro * gyro.transpose()).matrixL();
  imu.model = "scale-misalignment";
  imu.accelerometers = KalibrTriad{.M = accel};
  imu.gyroscopes = KalibrTriad{.M = M, .C_gyro_i = Mat3(M.inverse() * gyro), .A = Mat3::Zero()};
  return imu;
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

  out.all = calibrate_rig(out.cameras, imus, job.batch);
  out.estimate = out.all.front();
  for (std::size_t m = 0; m < std::min(said.size(), imus.size()); ++m)
    compare_noise(out.estimate, m == 0 ? out.all.front() : out.all[out.cameras.size() + m - 1], said[m], job.imu);
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

  std::vector<KalibrImu> imus;
  if (const Estimate* body = first_answer(result))
    imus.push_back(kalibr_imu(*body, body->reference, result.imu_rate_hz));
  for (std::size_t i = result.cameras.size(); i < result.all.size(); ++i) {
    const Estimate& other = result.all[i];
    if (!other.answered()) continue;
    KalibrImu more = kalibr_imu(other, other.sensor, result.imu_rate_hz);
    more.time_offset_s = to_seconds(*other.offset);
    if (other.T_reference_sensor) more.T_i_b = other.T_reference_sensor->inverse();
    imus.push_back(std::move(more));
  }
  out.imu = write_kalibr_imus(imus, style);
  return out;
}

}  // namespace takt
