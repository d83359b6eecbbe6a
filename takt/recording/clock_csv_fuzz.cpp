// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/clock_csv.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"sequence,ticks\n1,123\n2,48000123\n3,96000123\n4,144000124\n",
       "t_ns,edge,utc_s\n0,rising,1700000000\n1000000000,falling,1700000001\n2000000000,1,\n",
       "6688\n6692\n6688\n-986548\n6692\n6688\n6692\n6688\n6692\n6688\n",
       "request_ns,device_ns,response_ns\n0,100,200\n1000,1100,1200\n", "0.1 0.2\n0.3 0.4\n0x10,12\n",
       "t_ns,exposure_us\n1000,4000\n2000,4100\n", "start_ns,end_ns\n1000,4000\n5000,7000\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  takt::fuzz::reads_or_says_why(data, size,
                                [](std::string_view text) { (void)takt::read_pairs_csv(text, "pairs.csv"); });
  takt::fuzz::reads_or_says_why(data, size,
                                [](std::string_view text) { (void)takt::read_frames_csv(text, "frames.csv"); });
  takt::fuzz::reads_or_says_why(data, size,
                                [](std::string_view text) { (void)takt::read_strobes_csv(text, "strobes.csv"); });
  return takt::fuzz::reads_or_says_why(data, size,
                                       [](std::string_view text) { (void)takt::read_pulses_csv(text, "pps.csv"); });
}
