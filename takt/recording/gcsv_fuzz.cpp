// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gcsv.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {"GYROFLOW IMU LOG\nversion,1.3\norientation,YxZ\ntscale,0.001\ngscale,0.001\n"
                                  "t,gx,gy,gz,ax,ay,az\n0,39,86,183,-1137,-15689,-2986\n1,1,1,1,1,1,1\n",
                                  "GYROFLOW IMU LOG\nt,gx,gy,gz\n1.5,1,2,3\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size,
                                       [](std::string_view text) { (void)takt::read_gcsv(text, "clip.gcsv"); });
}
