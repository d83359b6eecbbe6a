// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_folder.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {"timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n"
                                  "1385030208726607500,0.5,-0.1,0.02,9.1,0.2,-3.2\n"
                                  "1385030208731607500,0.5,-0.1,0.02,9.1,0.2,-3.2\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size,
                                       [](std::string_view text) { (void)takt::read_kalibr_imu(text, "imu0.csv"); });
}
