// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_files.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"ttarget_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n",
       "ttarget_type: circlegrid\ntargetCols: 4\ntargetRows: 11\nspacingMeters: 0.02\nasymmetricGrid: True\n",
       "ccam0:\n  T_cam_imu:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n  cam_overlaps: "
       "[1]\n  camera_model: omni\n  distortion_coeffs: [0.1, 0, 0, 0]\n  distortion_model: radtan\n  intrinsics: "
       "[1.2, 800, 800, 300, 200]\n  resolution: [640, 480]\n  rostopic: /cam0\n  timeshift_cam_imu: 0.001\n",
       "iimu0:\n  accelerometer_noise_density: 0.01\n  accelerometer_random_walk: 0.001\n  gyroscope_noise_density: "
       "0.001\n  gyroscope_random_walk: 0.0001\n  update_rate: 200.0\n  gyroscopes:\n    M:\n    - [1, 0, 0]\n    - "
       "[0, 1, 0]\n    - [0, 0, 1]\n"});
}

/// The first byte says which file it is; what was read must be written so that it reads again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    if (text.empty()) return;
    const char kind = text.front();
    text.remove_prefix(1);
    if (kind == 't') {
      const std::string written = takt::write_kalibr_target(takt::read_kalibr_target(text, "target.yaml"));
      if (takt::write_kalibr_target(takt::read_kalibr_target(written, "again")) != written) __builtin_trap();
    } else if (kind == 'c') {
      const std::string written = takt::write_kalibr_camchain(takt::read_kalibr_camchain(text, "camchain.yaml"));
      if (takt::write_kalibr_camchain(takt::read_kalibr_camchain(written, "again")) != written) __builtin_trap();
    } else {
      const std::string written = takt::write_kalibr_imus(takt::read_kalibr_imus(text, "imu.yaml"));
      if (takt::write_kalibr_imus(takt::read_kalibr_imus(written, "again")) != written) __builtin_trap();
    }
  });
}
