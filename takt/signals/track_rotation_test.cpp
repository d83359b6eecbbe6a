// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/track_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "takt/motion/gyro_curve.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

CameraModel euroc_like() {
  CameraModel m;
  m.width = 752, m.height = 480;
  m.fx = 458.654, m.fy = 457.296, m.cx = 367.215, m.cy = 248.375;
  m.distortion = Distortion::radtan;
  m.coeffs = {-0.28340811, 0.07395907, 0.00019359, 0.00001762};
  return m;
}

Quat swing(double t) {
  return exp_so3(Vec3(0.10 * std::sin(3.1 * t), 0.14 * std::sin(2.3 * t + 1), 0.08 * std::sin(4.3 * t + 2)));
}

/// Far landmarks seen by a turning camera, 0.5 px noise; one in eight is someone else's.
TrackStream simulated(std::size_t frames, double outliers) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec3> landmarks;
  for (int i = 0; i < 300; ++i) landmarks.push_back(Vec3(uniform(random), uniform(random), 1).normalized());
  TrackStream out;
  out.name = "cam0";
  out.model = euroc_like();
  for (std::size_t f = 0; f < frames; ++f) {
    const double t = 0.05 * static_cast<double>(f);
    out.stamps.push_back(from_ns(0) + from_seconds(t));
    out.features.emplace_back();
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto px = out.model.project(swing(t).conjugate() * landmarks[i]);
      if (!px || px->x() < 0 || px->y() < 0 || px->x() > 751 || px->y() > 479) continue;
      Vec2 seen = *px + 0.5 * Vec2(gauss(random), gauss(random));
      if (std::abs(uniform(random)) < outliers) seen += 60 * Vec2(uniform(random), uniform(random));
      out.features.back().push_back({static_cast<std::int64_t>(i), seen});
    }
  }
  return out;
}

double normalised_error(const RotationSignal& signal) {
  double nees = 0;
  for (const RotationIncrement& r : signal.increments) {
    const double t0 = seconds_since(from_ns(0), r.from), t1 = seconds_since(from_ns(0), r.to);
    const Vec3 e = log_so3(exp_so3(r.rotation).conjugate() * swing(t0).conjugate() * swing(t1));
    nees += e.dot(r.information * e) / 3;
  }
  return nees / static_cast<double>(signal.increments.size());
}

TEST(TrackRotation, ErrorOverSigmaIsOneWhetherTheNoiseIsGivenOrMeasured) {
  TrackStream tracks = simulated(300, 0);
  const RotationSignal measured = track_rotation(tracks);
  ASSERT_EQ(measured.increments.size(), 299u);
  // Neighbouring pairs share a frame's noise, so 300 pairs scatter as 200 would: 4·√(2/3/200), and 4 % for σ's own
  // error.
  EXPECT_NEAR(normalised_error(measured), 1, 0.27);
  tracks.pixel_sigma = 0.5;
  const RotationSignal given = track_rotation(tracks);
  EXPECT_NEAR(normalised_error(given), 1, 0.27);
  EXPECT_NEAR(given.pairs[0].matches[0].sigma_rad, 0.5 / 458, 0.3 / 458);
}

TEST(TrackRotation, OutliersAreSurvived) {
  const RotationSignal signal = track_rotation(simulated(300, 0.12));
  ASSERT_EQ(signal.increments.size(), 299u);
  EXPECT_LT(normalised_error(signal), 1.4);
  EXPECT_EQ(signal.unexplained_fraction, 0);
}

TEST(TrackRotation, FeaturesOfOneFrameOnlyAreNoMatch) {
  TrackStream tracks = simulated(4, 0);
  for (TrackedFeature& f : tracks.features[2]) f.id += 1000;
  const RotationSignal signal = track_rotation(tracks);
  ASSERT_EQ(signal.increments.size(), 1u);
  ASSERT_EQ(signal.notes.size(), 1u);
  EXPECT_EQ(signal.notes[0].substr(0, 14), "2 of 4 frames ");
}

TEST(TrackRotation, EmptyAndSingleFramesAreNoSignal) {
  EXPECT_TRUE(track_rotation(simulated(0, 0)).increments.empty());
  EXPECT_TRUE(track_rotation(simulated(1, 0)).increments.empty());
}

using Row = std::vector<double>;

/// Rows of a CSV file: nanoseconds, then numbers.
std::vector<std::pair<std::int64_t, Row>> rows(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::pair<std::int64_t, Row>> out;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::int64_t t = 0;
    fields >> t;
    Row row;
    for (double v = 0; fields >> v;) row.push_back(v);
    out.emplace_back(t, std::move(row));
  }
  return out;
}

TEST(TrackRotation, CorridorTurnsAsItsGroundTruthSays) {
  const fs::path folder = fs::path(TAKT_DATA_DIR) / "vio_tracks/c01_corridor_p5";
  if (!fs::exists(folder)) GTEST_SKIP() << "the recording vio_tracks/c01_corridor_p5 is not here";
  TrackStream tracks;
  tracks.model = euroc_like();
  tracks.pixel_sigma = 1;
  std::map<std::int64_t, std::vector<TrackedFeature>> frames;
  for (const auto& [t, row] : rows(folder / "cam0_tracks.csv"))
    frames[t].push_back({static_cast<std::int64_t>(row[0]), {row[1], row[2]}});
  for (auto& [t, features] : frames) {
    tracks.stamps.push_back(from_ns(t));
    std::sort(features.begin(), features.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    tracks.features.push_back(features);
  }
  // True turns: the gyro without the true bias. Its noise, 0.05 mrad over a pair, is small against 1 px.
  const auto truth = rows(folder / "groundtruth.csv");
  std::vector<double> times;
  std::vector<Vec3> rates;
  std::size_t k = 0;
  for (const auto& [t, row] : rows(folder / "imu0.csv")) {
    while (k + 1 < truth.size() && truth[k + 1].first <= t) ++k;
    const Row& b = truth[k].second;
    times.push_back(seconds_since(tracks.stamps.front(), from_ns(t)));
    rates.emplace_back(row[0] - b[10], row[1] - b[11], row[2] - b[12]);
  }
  const GyroCurve gyro(times, rates);
  Mat3 R_imu_cam;
  R_imu_cam << 0.014865542982, -0.999880929698, 0.004140296794, 0.999557249008, 0.014967213325, 0.025715529948,
      -0.025774436697, 0.003756188358, 0.999660727178;

  const RotationSignal signal = track_rotation(tracks);
  EXPECT_GE(signal.increments.size(), 590u);
  double residual = 0, total = 0, nees = 0, n = 0;
  for (const RotationIncrement& r : signal.increments) {
    const double t0 = seconds_since(tracks.stamps.front(), r.from) + 0.005;
    const double t1 = seconds_since(tracks.stamps.front(), r.to) + 0.005;
    if (!gyro.covers(t0, t1)) continue;
    const Vec3 turned = R_imu_cam.transpose() * log_so3(gyro.between(t0, t1));
    const Vec3 e = log_so3(exp_so3(r.rotation).conjugate() * exp_so3(turned));
    residual += e.squaredNorm(), total += turned.squaredNorm(), n += 1;
    nees += e.dot(r.information * e) / 3;
  }
  const double r2 = 1 - residual / total;
  std::cout << "    R² " << r2 << ", rms residual " << std::sqrt(residual / 3 / n) * 1e3 << " mrad, (error/σ)² "
            << nees / n << "\n";
  EXPECT_GT(r2, 0.99);
  EXPECT_LT(nees / n, 2);
  EXPECT_GT(nees / n, 0.3);
}

}  // namespace
}  // namespace takt
