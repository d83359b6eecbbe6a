// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gopro.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "takt/error.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

const std::string karma = TAKT_DATA_DIR "/gopro/karma.mp4";
const std::string max_360 = TAKT_DATA_DIR "/gopro/max-heromode.mp4";
const std::string hero8 = TAKT_DATA_DIR "/hero8_racebox/5f2167b0-gopro-hero8-black.mp4";

class GoPro : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(karma)) GTEST_SKIP() << "no recordings at " TAKT_DATA_DIR "/gopro";
  }
};

bool has_note(const Recording& r, const std::string& words) {
  return std::any_of(r.notes.begin(), r.notes.end(),
                     [&](const std::string& n) { return n.find(words) != std::string::npos; });
}

double rate_hz(const std::vector<Stamp>& stamps) {
  return static_cast<double>(stamps.size() - 1) / seconds_since(stamps.front(), stamps.back());
}

/// How well rates turn into an attitude when the attitude's stamps are moved, t_gyro = t_attitude + offset: the share
/// of the attitude's increments that the integrated rates explain, without any fitted rotation, scale or bias.
class RateAgainstAttitude {
 public:
  RateAgainstAttitude(const ImuStream& imu, const AttitudeStream& attitude) : imu_(imu), attitude_(attitude) {
    turned_.push_back(Quat::Identity());
    for (std::size_t i = 0; i + 1 < imu.size(); ++i) {
      const double dt = seconds_since(imu.stamps[i], imu.stamps[i + 1]);
      turned_.push_back((turned_[i] * exp_so3(0.5 * (imu.gyro_rad_s[i] + imu.gyro_rad_s[i + 1]) * dt)).normalized());
    }
  }

  [[nodiscard]] double r2(double offset_s) const {
    double left = 0, all = 0;
    for (std::size_t i = 3; i + 4 < attitude_.size(); ++i) {
      const Quat from = turned_at(attitude_.stamps[i] + from_seconds(offset_s));
      const Quat to = turned_at(attitude_.stamps[i + 1] + from_seconds(offset_s));
      const Vec3 by_gyro = log_so3(from.conjugate() * to);
      const Vec3 by_attitude = log_so3(attitude_.world_from_body[i].conjugate() * attitude_.world_from_body[i + 1]);
      left += (by_attitude - by_gyro).squaredNorm();
      all += by_attitude.squaredNorm();
    }
    return 1 - left / all;
  }

  /// The offset that explains most, to the vertex of a parabola.
  [[nodiscard]] double best_offset_s() const {
    constexpr double step = 1e-3;
    double best = 0;
    for (int k = -60; k <= 60; ++k)
      if (r2(k * step) > r2(best)) best = k * step;
    const double before = r2(best - step), at = r2(best), after = r2(best + step);
    return best + 0.5 * step * (before - after) / (before - 2 * at + after);
  }

 private:
  [[nodiscard]] Quat turned_at(Stamp t) const {
    const auto after = std::upper_bound(imu_.stamps.begin(), imu_.stamps.end(), t);
    const auto last = static_cast<std::ptrdiff_t>(imu_.size()) - 2;
    const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - imu_.stamps.begin() - 1, 0, last));
    const double along = seconds_since(imu_.stamps[i], t) / seconds_since(imu_.stamps[i], imu_.stamps[i + 1]);
    return turned_[i].slerp(along, turned_[i + 1]);
  }

  const ImuStream& imu_;
  const AttitudeStream& attitude_;
  std::vector<Quat> turned_;
};

TEST_F(GoPro, Hero5KarmaHasGyroAccelAndExposures) {
  const Recording r = read_gopro(karma, {});
  ASSERT_EQ(r.imus.size(), 1u);
  const ImuStream& imu = r.imus[0];
  EXPECT_EQ(imu.name, "GYRO");
  EXPECT_EQ(imu.clock, "media time");
  EXPECT_EQ(imu.size(), 4795u);
  EXPECT_EQ(imu.accel_m_s2.size(), imu.size());
  EXPECT_NEAR(rate_hz(imu.stamps), 397.5, 0.3);
  EXPECT_TRUE(has_note(r, "TICK"));
  EXPECT_TRUE(r.attitudes.empty());
  // In the hand of a person the specific force is, on average, gravity.
  double mean = 0;
  for (const Vec3& a : imu.accel_m_s2) mean += a.norm() / static_cast<double>(imu.size());
  EXPECT_NEAR(mean, 9.81, 0.8);

  ASSERT_EQ(r.cameras.size(), 1u);
  const CameraStream& cam = r.cameras[0];
  EXPECT_EQ(cam.clock, imu.clock);
  EXPECT_EQ(cam.size(), 362u);
  EXPECT_EQ(cam.exposures_s.size(), cam.size());
  EXPECT_EQ(cam.exposures_s[0], 0) << "the camera gives exposures from the second frame on";
  EXPECT_NEAR(cam.exposures_s[1], 0.00487, 1e-5);
}

TEST_F(GoPro, MaxRatesIntegrateToItsAttitude) {
  const Recording r = read_gopro(max_360, {});
  ASSERT_EQ(r.imus.size(), 1u);
  ASSERT_EQ(r.attitudes.size(), 2u);
  const AttitudeStream& cori = r.attitudes[0];
  EXPECT_EQ(cori.name, "CORI");
  EXPECT_EQ(r.attitudes[1].name, "IORI");
  EXPECT_EQ(cori.size(), 316u);
  EXPECT_NEAR(rate_hz(r.imus[0].stamps), 197.455, 0.001);
  // CORI is stamped frame by frame.
  for (std::size_t i = 0; i < r.cameras[0].size(); ++i)
    EXPECT_LT(std::abs((cori.stamps[i] - r.cameras[0].stamps[i]).count()), 20'000) << i;

  // Both on the camera's own clock, t_gyro = t_CORI + 13.0 ms (shared data, README), and on the same axes: no rotation
  // between them is fitted.
  const RateAgainstAttitude fit(r.imus[0], cori);
  EXPECT_NEAR(fit.best_offset_s(), 0.0130, 0.0005);
  EXPECT_GT(fit.r2(fit.best_offset_s()), 0.999);
  EXPECT_TRUE(has_note(r, "stabilised in the camera"));
  EXPECT_NEAR(r.cameras[0].timing.readout_s, 0.0206, 1e-4);
}

TEST_F(GoPro, Hero8CutByAnotherProgramKeepsItsTimes) {
  if (!std::filesystem::exists(hero8)) GTEST_SKIP() << "no recording at " << hero8;
  const Recording r = read_gopro(hero8, {});
  ASSERT_EQ(r.imus.size(), 1u);
  EXPECT_NEAR(rate_hz(r.imus[0].stamps), 198.574, 0.002);
  EXPECT_NEAR(to_seconds(r.imus[0].stamps.front().time_since_epoch()), 0, 0.01) << "its clock stands at 546 s there";
  EXPECT_NEAR(to_seconds(r.imus[0].stamps.back().time_since_epoch()), 144.14, 0.01);
  EXPECT_EQ(r.cameras[0].size(), 4332u);
  const RateAgainstAttitude fit(r.imus[0], r.attitudes.at(0));
  EXPECT_GT(fit.r2(fit.best_offset_s()), 0.99);
}

TEST_F(GoPro, OnlyVideosWithTelemetryAreGoPros) {
  EXPECT_TRUE(is_gopro(karma));
  EXPECT_FALSE(is_gopro(TAKT_DATA_DIR "/gopro/karma.raw"));
  EXPECT_FALSE(is_gopro(TAKT_DATA_DIR "/README.md"));
  EXPECT_FALSE(is_gopro(TAKT_DATA_DIR));
  EXPECT_FALSE(is_gopro("/nowhere.mp4"));
}

}  // namespace
}  // namespace takt
