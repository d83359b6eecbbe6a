// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/live_lines.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {R"({"imu":"imu0","t_ns":1700000000,"gyro":[0.1,-2,3e-3],"accel":[0,0,9.8]})",
                                  R"({"cam":"cam0","t_ns":5,"exposure_s":0.004,"features":[[7,10.5,20],[9,1,2]]})"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    std::string why;
    (void)takt::read_live_line(text, why);
  });
}
