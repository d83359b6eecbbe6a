// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "takt/recording/asl.h"
#include "tests/fuzz.h"

namespace {

/// The three files of a sensor folder, with a bar between them.
std::array<std::string_view, 3> three_files(std::string_view text) {
  std::array<std::string_view, 3> files;
  for (std::string_view& file : files) {
    const std::size_t bar = std::min(text.find('|'), text.size());
    file = text.substr(0, bar);
    text.remove_prefix(std::min(bar + 1, text.size()));
  }
  return files;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const std::string sensor =
      "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\nresolution: [640, 480]\n"
      "intrinsics: [400, 401, 320, 240]\ndistortion_model: radtan\ndistortion_coeffs: [0.1, 0, 0, 0]\n"
      "exposure_s: 0.01\nstamp: start\nreadout_s: 0.03\nshutter: rolling\n";
  const std::string imu = "T_BS: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\ngyroscope_noise_density: 1e-4\n";
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {"#timestamp [ns],filename\n1000,a.png\n2000,b.png\n|" + sensor + "|1000,2000000\n",
                                  "0,1,2,3,4,5,6\n1000,1,2,3,4,5,6\n|" + imu + "|"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    const auto [frames, sensor, exposure] = three_files(text);
    std::vector<std::string> notes;
    (void)takt::read_asl_camera({frames, sensor, exposure}, "cam0", "/nonexistent/cam0", notes);
  });
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    const auto [rows, sensor, unused] = three_files(text);
    std::vector<std::string> notes;
    (void)takt::read_asl_imu(rows, sensor, "imu0", "/nonexistent/imu0", notes);
  });
}
