// SPDX-License-Identifier: Apache-2.0
// How long an hour takes: a 400 Hz gyro against the 30 Hz rotation rate of a camera, two CSV files, ±30 min search.
//   speed_alignment [SECONDS]   length of the recordings (default 3600); last the peak memory
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <string>

#include "takt/estimators/alignment/alignment.h"
#include "takt/recording/open_recording.h"
#include "takt/signals/gyro_rotation.h"
#include "takt/simulation/random.h"

namespace {

using namespace takt;

constexpr double true_offset_s = 417.0123;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// A hand that never does the same again: noise through two low-passes of some 3 Hz, in steps of 1/1200 s.
class Hand {
 public:
  static constexpr double rate_hz = 1200;
  Vec3 next() {
    const double keep = std::exp(-2 * 3.1416 * 3 / rate_hz);
    for (int axis = 0; axis < 3; ++axis) {
      first_[axis] = keep * first_[axis] + (1 - keep) * 25 * random_.normal();
      second_[axis] = keep * second_[axis] + (1 - keep) * first_[axis];
    }
    return second_;
  }

 private:
  Random random_{1, "hand"};
  Vec3 first_ = Vec3::Zero(), second_ = Vec3::Zero();
};

void write_row(std::FILE* file, double t, const Vec3& w, Random& random, double noise) {
  std::fprintf(file, "%.6f,%.6f,%.6f,%.6f\n", t, w.x() + noise * random.normal(), w.y() + noise * random.normal(),
               w.z() + noise * random.normal());
}

/// The camera's rate is the mean over its frame, stamped in the middle, as a front end would export it.
void write_logs(const std::string& gyro_file, const std::string& camera_file, double length_s) {
  std::FILE* gyro = std::fopen(gyro_file.c_str(), "w");
  std::FILE* camera = std::fopen(camera_file.c_str(), "w");
  if (!gyro || !camera) throw std::runtime_error("cannot write " + gyro_file + " and " + camera_file);
  for (std::FILE* f : {gyro, camera}) std::fputs("t_s,wx_rad_s,wy_rad_s,wz_rad_s\n", f);
  Hand hand;
  Random gyro_noise(1, "gyro"), camera_noise(1, "camera");
  Vec3 sum = Vec3::Zero();
  const auto steps = static_cast<long>(length_s * Hand::rate_hz);
  for (long i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / Hand::rate_hz;
    const Vec3 w = hand.next();
    if (i % 3 == 0) write_row(gyro, t, w, gyro_noise, 0.004);
    sum += w;
    if (i % 40 == 39) {
      write_row(camera, t - 19.5 / Hand::rate_hz - true_offset_s, sum / 40, camera_noise, 0.01);
      sum.setZero();
    }
  }
  std::fclose(gyro), std::fclose(camera);
}

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace

int main(int argc, char** argv) try {
  const double length_s = argc > 1 ? std::atof(argv[1]) : 3600;
  const auto folder = std::filesystem::temp_directory_path() / "takt_speed_alignment";
  std::filesystem::create_directories(folder);
  const std::string gyro_file = folder / "gyro.csv", camera_file = folder / "camera.csv";
  write_logs(gyro_file, camera_file, length_s);

  const double t0 = now_s(), c0 = cpu_s();
  const Recording gyro = open_recording(gyro_file), camera = open_recording(camera_file);
  const double t1 = now_s(), c1 = cpu_s();
  const RotationSignal signal = gyro_rotation(camera.imus.at(0));
  const double t2 = now_s(), c2 = cpu_s();
  AlignmentOptions options;
  options.search_s = 1800;
  const Estimate found = align_rotation(signal, gyro.imus.at(0), options);
  const double t3 = now_s(), c3 = cpu_s();
  std::filesystem::remove_all(folder);

  std::printf("          wall s   CPU s\n");
  std::printf("read      %6.2f  %6.2f  (%zu and %zu samples)\n", t1 - t0, c1 - c0, gyro.imus[0].size(),
              camera.imus[0].size());
  std::printf("rotation  %6.2f  %6.2f  (%zu increments)\n", t2 - t1, c2 - c1, signal.increments.size());
  std::printf("align     %6.2f  %6.2f  (%s)\n", t3 - t2, c3 - c2, to_string(found.verdict));
  std::printf("all       %6.2f  %6.2f, peak memory %.0f MB\n", t3 - t0, c3 - c0, peak_mb());
  if (found.answered())
    std::printf("error %+.1f µs, σ %.1f µs\n", 1e6 * (to_seconds(*found.offset) - true_offset_s), 1e6 * *found.sigma_s);
  for (const std::string& why : found.reasons) std::printf("%s\n", why.c_str());
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
