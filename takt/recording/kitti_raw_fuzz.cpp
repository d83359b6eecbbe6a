// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kitti_calibration.h"
#include "takt/recording/kitti_raw.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"s2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.074397448\n\n",
       "o49.0 8.4 116.4 0.03 -0.01 2.6 -3.5 5.1 6.2 0 -0.04 0.1 -0.2 9.8 0.1 -0.2 9.8 0.01 -0.02 0.03 0 0 0 1 1 4 8 5 "
       "5 "
       "0\n",
       "ccalib_time: 09-Jan-2012\nS_02: 4 3\nK_02: 9 0 2 0 9 1 0 0 1\nD_02: -0.3 0.2 0 0 -0.07\n"
       "R_02: 1 0 0 0 1 0 0 0 1\nT_02: 0.06 0 0\nS_rect_02: 3 2\nP_rect_02: 7 0 1 44 0 7 1 0.2 0 0 1 0.003\n"
       "R_rect_00: 1 0 0 0 1 0 0 0 1\n"});
}

// The first byte says which of the three files the others are.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  return takt::fuzz::reads_or_says_why(data + 1, size - 1, [&](std::string_view text) {
    if (data[0] == 's') {
      (void)takt::read_kitti_stamps(text, "timestamps.txt");
    } else if (data[0] == 'o') {
      (void)takt::read_oxts(text, "0000000000.txt");
    } else {
      const takt::KittiFields fields(text, "calib_cam_to_cam.txt");
      (void)takt::kitti_camera(fields, "02", 4, 3);
      (void)takt::kitti_camera(fields, "02", 3, 2);
    }
  });
}
