// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/frame_folder.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {"SOF  4328040426246,  frameNum :1 exp time 0.005248\nframeid:1 gyro:0 x 0.1\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    (void)takt::read_frame_log(text);
    (void)takt::number_in(text);
  });
}
