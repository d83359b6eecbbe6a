// SPDX-License-Identifier: Apache-2.0
// How long a 720p video takes from its file to the offset, as `takt align` does it. The video is rendered and encoded
// first (ffmpeg is needed), with the gyro's log beside it.
//   speed_video_to_offset [SECONDS]   length of the video (default 10)
#include <fmt/core.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <stdexcept>

#include "takt/simulation/handheld.h"
#include "takt/workflows/align.h"

namespace {

using namespace takt;

constexpr int width = 1280, height = 720;
constexpr double rate_hz = 30;

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void write_video(const CameraStream& camera, const std::string& path) {
  const std::string command = fmt::format(
      "ffmpeg -y -loglevel error -f rawvideo -pix_fmt gray -s {}x{} -r {} -i - -c:v libx264 -preset veryfast -crf 20 "
      "-pix_fmt yuv420p '{}'",
      width, height, rate_hz, path);
  std::FILE* pipe = popen(command.c_str(), "w");
  if (!pipe) throw std::runtime_error("ffmpeg cannot be started");
  const auto reader = camera.open();
  while (const auto frame = reader->next())
    for (int row = 0; row < height; ++row)
      std::fwrite(frame->image.row(row), 1, static_cast<std::size_t>(width), pipe);
  if (pclose(pipe) != 0) throw std::runtime_error("ffmpeg failed");
}

void write_log(const ImuStream& imu, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (!file) throw std::runtime_error("cannot write " + path);
  std::fputs("t_ns,wx_rad_s,wy_rad_s,wz_rad_s\n", file);
  for (std::size_t i = 0; i < imu.size(); ++i)
    fmt::print(file, "{},{:.7f},{:.7f},{:.7f}\n", to_ns(imu.stamps[i]), imu.gyro_rad_s[i].x(), imu.gyro_rad_s[i].y(),
               imu.gyro_rad_s[i].z());
  std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) try {
  HandheldOptions made;
  made.duration_s = argc > 1 ? std::atof(argv[1]) : 10;
  made.camera.width = width, made.camera.height = height, made.camera.rate_hz = rate_hz;
  const SimulatedRecording run = simulate_handheld(made);
  const auto folder = std::filesystem::temp_directory_path() / "takt_speed_video";
  std::filesystem::create_directories(folder);
  write_video(run.recording.cameras.front(), folder / "ride.mp4");
  write_log(run.recording.imus.front(), folder / "ride.csv");

  const double wall = wall_s(), cpu = cpu_s();
  AlignJob job;
  job.inputs = {folder / "ride.mp4"};
  const Estimate found = align(job).estimate;
  const double took = wall_s() - wall, worked = cpu_s() - cpu;
  std::filesystem::remove_all(folder);
  // The video's own clock begins with its first frame.
  const Duration known = *run.truth.offset + run.exposures.front().stamp.time_since_epoch();
  fmt::print(
      "{:.0f} s of 720p at {:.0f} Hz: {:.2f} s wall, {:.2f} s CPU: {:.1f} times real time ({:.1f} by CPU on two "
      "cores)\n",
      made.duration_s, rate_hz, took, worked, made.duration_s / took, 2 * made.duration_s / worked);
  fmt::print("{}", to_string(found.verdict));
  if (found.answered())
    fmt::print(", error {:+.3f} ms, σ {:.3f} ms", 1e3 * to_seconds(*found.offset - known), 1e3 * *found.sigma_s);
  for (const std::string& why : found.reasons) fmt::print("; {}", why);
  fmt::print("\n");
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
