// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/csv_log.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"t_ns,wx,wy,wz,ax,ay,az\n0,1,2,3,4,5,6\n1000000,1,2,3,4,5,6\n",
       "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]\n1403715273262142976,1,2,3\n",
       "Record,Time,X,Y,Z,GyroX,GyroY,GyroZ\n1,0.000,0,0,1,-2.98,0.49,-1.68\n2,0.040,0,0,1,-2.85,0.42,-1.96\n",
       "3.9e-03 3.8e-02 1.4e-02 4.328040426741000265e+06\n6.4e-03 4.2e-02 1.8e-02 4.328040429166999646e+06\n",
       "t_ns;angle_deg\r\n0;\"1.5\"\r\n20000000;1.6\r\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) { (void)takt::read_imu_table(text, "imu.csv"); });
  return takt::fuzz::reads_or_says_why(data, size,
                                       [](std::string_view text) { (void)takt::read_csv_log(text, "log.csv", {}); });
}
