// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/camera_truth.h"

#include "takt/version.h"

namespace takt {

Estimate camera_truth(const std::string& name, const SimulatedCamera& camera, const SimulatedImu& imu,
                      const SimulatedClocks& clocks, double duration_s, std::uint64_t seed) {
  const ClockMap<> map = clocks.sensor_to_reference(duration_s);
  const auto& piece = map.pieces().front();
  Estimate e;
  e.method = "truth";
  e.sensor = name;
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = piece.offset + from_seconds(imu.delay_s());
  e.sigma_s = 0;
  e.epoch = as_stamp(piece.epoch);
  e.drift = piece.drift;
  e.drift_sigma = 0;
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.line_delay_s = camera.timing().line_delay_s();
  e.line_delay_sigma_s = 0;
  e.T_reference_sensor = (Eigen::Isometry3d(imu.T_body_imu).inverse() * Eigen::Isometry3d(camera.T_body_cam)).matrix();
  e.extras = {{"clock_offset_s", clocks.offset_s, 0.0}, {"imu_delay_s", imu.delay_s(), 0.0}};
  e.provenance.version = version;
  e.provenance.seed = seed;
  return e;
}

}  // namespace takt
