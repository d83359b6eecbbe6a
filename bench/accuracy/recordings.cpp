// SPDX-License-Identifier: Apache-2.0
// What takt finds in real recordings, beside what is known of them. Prints Markdown.
//   accuracy_recordings FOLDER [NAME]   the folder of the recordings; only those whose name contains NAME
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "takt/calibration/words.h"
#include "takt/workflows/align.h"

namespace {

using namespace takt;

struct Known {
  const char* name;
  std::vector<std::string> inputs;
  const char* sensor;
  const char* reference;
  const char* says;
};

std::vector<Known> known() {
  return {
      {"EuRoC, cam0", {"euroc_micro"}, "cam0", "imu0", "0 ± 1 ms"},
      {"EuRoC, cam1", {"euroc_micro"}, "cam1", "imu0", "0 ± 1 ms"},
      {"phone gyro, MCU gyro",
       {"phone_mcu_gyro/mcu_gyro_data.csv", "phone_mcu_gyro/smartphone_gyro_data.csv"},
       "",
       "",
       "947848.6384 s (published), ± 100 µs"},
      {"Hero8 gyro, RaceBox",
       {"hero8_racebox/5f2167b0-gopro-hero8-black.mp4", "hero8_racebox/5f2167b0-racebox.csv"},
       "GYRO",
       "",
       "407.58 ± 0.1 s between the logs (published)"},
      {"GoPro Karma, picture", {"gopro/karma.mp4"}, "", "", "about −20 ms"},
      {"GoPro Max, stabilised picture", {"gopro/max-heromode.mp4"}, "cam0", "", "to be refused"},
      {"GoPro Max, CORI", {"gopro/max-heromode.mp4"}, "CORI", "", "+13.0 ± 0.5 ms"},
      {"phone, rolling shutter", {"phone_rolling_shutter"}, "", "", "readout near 33 ms"},
      {"OpenVINS tracks, corridor", {"vio_tracks/c01_corridor_p5"}, "", "", "+5 ms, ± 0.5"},
      {"OpenVINS tracks, gore", {"vio_tracks/c03_gore_p50"}, "", "", "+50 ms, ± 0.5"},
      {"OpenVINS tracks, car", {"vio_tracks/c06_neighborhood_m33"}, "", "", "−33.3 ms, ± 0.5"},
  };
}

void print_row(const Known& k, const std::string& folder) {
  AlignJob job;
  for (const std::string& input : k.inputs) job.inputs.push_back(folder + "/" + input);
  job.sensor = k.sensor;
  job.reference = k.reference;
  std::string found = "–", verdict, reasons, readout, halves;
  try {
    const Estimate e = align(job).estimate;
    verdict = to_string(e.verdict);
    if (e.answered()) found = time_words(*e.offset, e.sigma_s);
    for (const std::string& why : e.reasons) reasons += (reasons.empty() ? "" : "; ") + why;
    for (const Extra& x : e.extras) {
      if (x.name == "readout_s") readout = time_words(x.value, x.sigma);
      if (x.name == "half_difference_s") halves = time_words(x.value, x.sigma);
    }
  } catch (const std::exception& error) {
    verdict = "failed";
    reasons = error.what();
    if (const auto at = reasons.find(folder); at != std::string::npos) reasons.erase(at, folder.size() + 1);
  }
  fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", k.name, found, verdict, k.says, halves, readout, reasons);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2 || !std::filesystem::exists(argv[1])) {
    std::fprintf(stderr, "accuracy_recordings FOLDER [NAME]: the folder with the recordings is needed\n");
    return 2;
  }
  fmt::print("| recording | offset found | verdict | what is known | second half − first | readout | reasons |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const Known& k : known())
    if (argc < 3 || std::string(k.name).find(argv[2]) != std::string::npos) print_row(k, argv[1]);
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
