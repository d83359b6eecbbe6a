// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/simulate.h"

#include <fmt/core.h>

#include <array>

#include "takt/recording/kalibr_files.h"
#include "takt/simulation/clock_rig.h"
#include "takt/simulation/folder_writer.h"
#include "takt/simulation/handheld_parameters.h"
#include "takt/simulation/pendulum_film.h"
#include "takt/simulation/pendulum_parameters.h"
#include "takt/simulation/scenario.h"
#include "takt/simulation/target_parameters.h"

namespace takt {

namespace {

/// Defaults, then the scenario, then the request's own changes.
/// `named`: the field that a scenario without a file stands for.
template <class Parameters>
Parameters parameters_for(const SimulationRequest& request, const std::string& named, Parameters p = {}) {
  if (is_scenario(request.scenario))
    change(p, read_scenario(request.scenario));
  else if (!request.scenario.empty())
    change(p, {{named, request.scenario}});
  change(p, request.changes);
  return p;
}

/// A camera and an IMU carried about: `p` are all its parameters.
Estimate write_carried(const SimulationRequest& request, const HandheldParameters& p, const char* kind) {
  HandheldOptions options = to_options(p);
  options.seed = request.seed;
  options.threads = request.threads;
  SimulatedRecording made = simulate_handheld(options);
  made.truth.provenance.command = request.command;

  NewFolder folder(request.folder);
  if (options.footage == Footage::images)
    write_asl(made.recording, folder, request.threads, request.progress);
  else
    write_tracks(made.recording, folder);
  folder.write("truth.json", truth_json(made.truth, kind, parameters(p)));
  folder.finish();
  return made.truth;
}

Estimate write_handheld(const SimulationRequest& request) {
  return write_carried(request, parameters_for<HandheldParameters>(request, "motion"), "handheld");
}

/// A slow robot that stops every now and then.
HandheldParameters robot() {
  HandheldParameters p;
  p.motion = "rig";
  p.duration_s = 60;
  p.go_s = 12, p.stop_s = 4;
  return p;
}

Estimate write_rig(const SimulationRequest& request) {
  return write_carried(request, parameters_for(request, "motion", robot()), "rig");
}

std::string angle_csv(const AngleStream& dial) {
  std::string csv = "t_ns,angle_rad\n";
  for (std::size_t i = 0; i < dial.size(); ++i)
    csv += fmt::format("{},{:.9f}\n", to_ns(dial.stamps[i]), dial.angle_rad[i]);
  return csv;
}

/// What the dial's stamps mean, for `takt pendulum`.
std::string rig_yaml(const PendulumRig& rig, const PendulumParameters& p) {
  return fmt::format("# simulated by takt\nexposure_s: {}\nstamp: {}\nstart_angle_rad: {}\nlength_m: {:.6f}\n",
                     rig.camera.exposure_s, p.stamp, rig.start_angle_rad,
                     9.80665 / (rig.pendulum.natural_rad_s * rig.pendulum.natural_rad_s));
}

/// And what its pictures show.
std::string dial_yaml(const DialScene& scene, const PendulumParameters& p) {
  const Dial& d = scene.dial;
  return fmt::format(
      "dial: {}\ndial_radius_m: {}\ndial_height_m: {}\ngraduation_deg: {}\nline_deg: {}\ncell_deg: {}\n"
      "camera_distance_m: {}\nroll_deg: {}\nyaw_deg: {}\npitch_deg: {}\nrest_reading_deg: {}\n",
      p.dial, d.radius_m, d.height_m, d.graduation_deg, d.line_deg, d.cell_deg, scene.view.pivot_distance_m, p.roll_deg,
      p.yaw_deg, p.pitch_deg, scene.rest_deg + p.rest_reading_deg.value_or(0));
}

/// Pictures of the dial, or its angles in `angle.csv`; `rig.yaml`; the IMUs. Cameras and IMUs as an ASL folder.
Estimate write_pendulum(const SimulationRequest& request) {
  const auto p = parameters_for<PendulumParameters>(request, "rig");
  const PendulumRig rig = to_rig(p);
  const DialScene scene = to_scene(p);
  PendulumRecording made = simulate_pendulum(rig, request.seed);
  Estimate truth = made.truth.front();
  truth.provenance.command = request.command;
  truth.provenance.seed = request.seed;
  truth.estimates = made.truth;

  NewFolder folder(request.folder);
  Recording recording;
  recording.imus = std::move(made.imus);
  if (!p.angles) recording.cameras.push_back(film_pendulum(rig, scene, request.seed, request.threads).camera);
  write_asl(recording, folder, request.threads, request.progress);
  if (p.angles) folder.write("angle.csv", angle_csv(made.dial));
  folder.write("rig.yaml", rig_yaml(rig, p) + (p.angles ? "" : dial_yaml(scene, p)));
  folder.write("truth.json", truth_json(truth, "pendulum", parameters(p)));
  folder.finish();
  return truth;
}

/// pps.csv, gnss.nmea and gnss.ubx with their arrivals, pairs.csv: what `takt clock DIR` reads. Beside them the same as
/// the gateware sends it, and each camera's frames as the host has them.
Estimate write_clock(const SimulationRequest& request) {
  const auto p = parameters_for<ClockParameters>(request, "oscillator");
  ClockRecording made = simulate_clock(p, request.seed);
  made.truth.provenance.command = request.command;
  made.truth.provenance.seed = request.seed;
  std::string pps = "sequence,ticks\n", pairs = "request_ns,device_ns,response_ns\n";
  for (const Pulse& pulse : made.pulses.pulses) pps += fmt::format("{},{}\n", *pulse.sequence, pulse.ticks);
  for (const ClockPair& pair : made.pairs.pairs)
    pairs += fmt::format("{},{},{}\n", pair.request_ns, pair.device_ns, pair.arrival_ns);
  NewFolder folder(request.folder);
  folder.write("pps.csv", fmt::format("# a counter of {} Hz, {} bits\n", p.tick_hz, p.counter_bits) + pps);
  folder.write("gnss.nmea", made.nmea);
  folder.write("gnss.nmea.arrivals.csv", made.nmea_arrivals);
  folder.write("gnss.ubx", made.ubx);
  folder.write("gnss.ubx.arrivals.csv", made.ubx_arrivals);
  if (made.pairs.size() > 0) folder.write("pairs.csv", pairs);
  if (const std::string bytes = as_gateware_capture(made, p); !bytes.empty()) folder.write("capture.takt", bytes);
  for (const TriggeredCamera& camera : made.cameras) {
    std::string frames = "t_ns,exposure_s,arrival_ns\n";
    for (const TriggeredCamera::Frame& f : camera.frames)
      frames += fmt::format("{},{:.7f},{}\n", f.stamp_ns, f.exposure_s, f.arrival_ns);
    folder.write(camera.strobes.name + "_frames.csv", frames);
  }
  folder.write("truth.json", truth_json(made.truth, "clock", parameters(p)));
  folder.finish();
  return made.truth;
}

/// What Kalibr would be given: the cameras' models and how they stand to each other, without the answer.
KalibrCamchain camchain_of(const Recording& recording) {
  KalibrCamchain chain;
  for (const CameraStream& camera : recording.cameras) {
    KalibrCamera entry{.model = *camera.model, .rostopic = "/" + camera.name + "/image_raw"};
    if (!chain.empty()) {
      const Mat4& before = *recording.cameras[chain.size() - 1].T_body_cam;
      entry.T_cn_cnm1 = (Eigen::Isometry3d(*camera.T_body_cam).inverse() * Eigen::Isometry3d(before)).matrix();
    }
    chain.push_back(std::move(entry));
  }
  return chain;
}

/// Pictures and IMU as an ASL folder; target.yaml, camchain.yaml and imu.yaml as Kalibr has them.
Estimate write_target(const SimulationRequest& request) {
  const auto p = parameters_for<TargetParameters>(request, "target");
  TargetFilmOptions options = to_options(p);
  options.seed = request.seed;
  options.threads = request.threads;
  TargetFilm made = simulate_target(options);
  made.truth.provenance.command = request.command;
  std::vector<KalibrImu> imus;
  for (const ImuStream& imu : made.recording.imus)
    imus.push_back({.noise = *imu.noise, .update_rate_hz = p.imu.imu_rate_hz, .rostopic = "/" + imu.name});

  NewFolder folder(request.folder);
  // What is to be found does not stand beside the pictures: how the sensors are mounted is in truth.json alone.
  Recording told = made.recording;
  for (CameraStream& camera : told.cameras) camera.T_body_cam.reset();
  for (ImuStream& imu : told.imus) imu.T_body_imu.reset();
  write_asl(told, folder, request.threads, request.progress);
  folder.write("target.yaml", write_kalibr_target(options.scene.target));
  folder.write("camchain.yaml", write_kalibr_camchain(camchain_of(made.recording)));
  folder.write("imu.yaml", write_kalibr_imus(imus));
  folder.write("truth.json", truth_json(made.truth, "target", parameters(p)));
  folder.finish();
  return made.truth;
}

const std::array<SimulationKind, 5> kinds{{
    {"handheld", "a camera and an IMU in a hand or on a vehicle, in a textured room",
     [] { return parameters(HandheldParameters{}); }, write_handheld},
    {"rig", "a camera and an IMU on a robot or a car that stops every now and then", [] { return parameters(robot()); },
     write_rig},
    {"pendulum", "a camera before a dial and one or more IMUs on a pendulum's bob",
     [] { return parameters(PendulumParameters{}); }, write_pendulum},
    {"target", "cameras and IMUs moved before a calibration board, as for Kalibr",
     [] { return parameters(TargetParameters{}); }, write_target},
    {"clock", "a counter with a 1PPS, a GNSS receiver's messages, and exchanges with a host",
     [] { return parameters(ClockParameters{}); }, write_clock},
}};

}  // namespace

std::span<const SimulationKind> simulation_kinds() {
  return kinds;
}

std::string scenario_advice(const std::string& scenario) {
  if (scenario.empty() || is_scenario(scenario)) return "";
  return "; nor is it a file or one of the scenarios " + scenario_names();
}

std::string truth_json(const Estimate& truth, const std::string& kind, const std::vector<Parameter>& list) {
  // Inserted as text, so that the result's own digits stay as they are.
  std::string out = to_json(truth);
  const auto last = out.find_last_of('}');
  const auto end = out.find_last_not_of(" \n", last - 1) + 1;
  return out.substr(0, end) + ",\n  \"simulation\": {\"kind\": \"" + kind +
         "\", \"parameters\": " + parameters_json(list) + "}\n}\n";
}

}  // namespace takt
