// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/visual_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>

#include "takt/motion/gyro_curve.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

GrayImage as_image(const cv::Mat& mat) {
  auto owner = std::make_shared<cv::Mat>(mat);
  return {owner->cols, owner->rows, static_cast<std::ptrdiff_t>(owner->step), owner->data, owner};
}

/// Frames that are made when asked for.
class MadeFrames : public FrameReader {
 public:
  MadeFrames(std::vector<Stamp> stamps, std::function<cv::Mat(std::size_t)> make)
      : stamps_(std::move(stamps)), make_(std::move(make)) {}
  std::optional<Frame> next() override {
    if (next_ == stamps_.size()) return std::nullopt;
    const std::size_t i = next_++;
    return Frame{i, stamps_[i], 0, as_image(make_(i))};
  }

 private:
  std::vector<Stamp> stamps_;
  std::function<cv::Mat(std::size_t)> make_;
  std::size_t next_ = 0;
};

CameraStream made_stream(std::size_t frames, double step_s, std::function<cv::Mat(std::size_t)> make) {
  CameraStream stream;
  stream.name = "cam0";
  for (std::size_t i = 0; i < frames; ++i)
    stream.stamps.push_back(from_ns(1'000'000'000) + from_seconds(static_cast<double>(i) * step_s));
  stream.open = [stamps = stream.stamps, make] { return std::make_unique<MadeFrames>(stamps, make); };
  return stream;
}

/// Bearings of all pixels, worked out once a model.
const std::vector<Vec3>& rays(const CameraModel& model) {
  static std::map<std::pair<double, double>, std::vector<Vec3>> known;
  std::vector<Vec3>& all = known[{model.fx, model.coeffs[0]}];
  if (all.empty())
    for (int v = 0; v < model.height; ++v)
      for (int u = 0; u < model.width; ++u)
        all.push_back(model.bearing({static_cast<double>(u), static_cast<double>(v)}).value_or(Vec3::UnitZ()));
  return all;
}

/// A far wall with structure of all sizes, painted on the plane z = 1 over ±tan(50°).
class Wall {
 public:
  Wall() {
    cv::RNG random(17);
    cv::Mat sum(side, side, CV_32F, cv::Scalar(0));
    for (int cell = 2; cell <= 128; cell *= 2) {
      cv::Mat coarse(side / cell, side / cell, CV_32F), fine;
      random.fill(coarse, cv::RNG::NORMAL, 0, 1);
      cv::resize(coarse, fine, sum.size(), 0, 0, cv::INTER_CUBIC);
      sum += fine;
    }
    texture_ = 128 + 16 * sum;
  }

  /// What a camera turned by R_wall_cam sees, with normal noise of `noise` grey levels.
  [[nodiscard]] cv::Mat seen(const CameraModel& model, const Mat3& R, double noise, std::uint64_t seed) const {
    cv::Mat map(model.height, model.width, CV_32FC2);
    const double scale = 0.5 * side / std::tan(50 * std::numbers::pi / 180);
    auto ray = rays(model).begin();
    for (int v = 0; v < model.height; ++v)
      for (int u = 0; u < model.width; ++u) {
        const Vec3 p = R * *ray++;
        map.at<cv::Vec2f>(v, u) = {static_cast<float>(0.5 * side + scale * p.x() / p.z()),
                                   static_cast<float>(0.5 * side + scale * p.y() / p.z())};
      }
    cv::Mat image, grain(model.height, model.width, CV_32F), out;
    cv::remap(texture_, image, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
    cv::RNG random(seed + 1);
    random.fill(grain, cv::RNG::NORMAL, 0, noise);
    image += grain;
    image.convertTo(out, CV_8U);
    return out;
  }

 private:
  static constexpr int side = 2048;
  cv::Mat texture_;
};

const Wall& wall() {
  static const Wall w;
  return w;
}

CameraModel small_camera() {
  CameraModel m = CameraModel::from_horizontal_fov(640, 400, 1.2);
  m.distortion = Distortion::radtan;
  m.coeffs = {-0.2, 0.04, 3e-4, -2e-4};
  return m;
}

/// Attitude of a camera that swings about all axes by some degrees.
Quat swing(double t) {
  return exp_so3(Vec3(0.10 * std::sin(3.1 * t), 0.14 * std::sin(2.3 * t + 1), 0.08 * std::sin(4.3 * t + 2)));
}

TEST(VisualRotation, FindsTheTurnsOfADistortedCameraWithHonestSigma) {
  const CameraModel model = small_camera();
  const double step_s = 0.04;
  const auto attitude = [&](std::size_t i) { return swing(static_cast<double>(i) * step_s); };
  const std::size_t frames = 60;
  CameraStream stream = made_stream(
      frames, step_s, [&](std::size_t i) { return wall().seen(model, attitude(i).toRotationMatrix(), 2, i); });
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), frames - 1);
  // Pairs of 0.4 s at 25 Hz: ten frames apart, so the first ten frames are nobody's end.
  ASSERT_EQ(signal.pairs.size(), frames - 10);
  EXPECT_TRUE(signal.notes.empty()) << signal.notes.front();
  EXPECT_EQ(signal.unexplained_fraction, 0);
  double nees = 0, squares = 0;
  for (std::size_t i = 0; i + 1 < frames; ++i) {
    const RotationIncrement& r = signal.increments[i];
    const Vec3 error = log_so3(exp_so3(r.rotation).conjugate() * attitude(i).conjugate() * attitude(i + 1));
    nees += error.dot(r.information * error) / 3 / static_cast<double>(frames - 1);
    squares += error.squaredNorm() / 3 / static_cast<double>(frames - 1);
  }
  for (const BearingPair& pair : signal.pairs) {
    EXPECT_LE(pair.matches.size(), 80u);
    EXPECT_GE(pair.matches.size(), 40u);
    EXPECT_EQ(pair.to - pair.from, from_seconds(10 * step_s));
  }
  RecordProperty("error_over_sigma_squared", std::to_string(nees));
  RecordProperty("rms_error_urad", std::to_string(std::sqrt(squares) * 1e6));
  // χ² per degree of freedom. Patches overlap and the interpolation of LK has its own small errors, so this is no exact
  // law; an error of the model (distortion, pixel centres, order of multiplication) would be tens of sigmas.
  EXPECT_LT(nees, 2.0);
  EXPECT_GT(nees, 0.4);
  EXPECT_LT(std::sqrt(squares), 1e-4);  // 0.05 px of a focal length of 460 px
}

TEST(VisualRotation, LongPairsFormChainsThatUseEveryFrameOnce) {
  const CameraModel model = small_camera();
  const std::size_t frames = 30, stride = 10;  // 0.4 s at 0.04 s a frame
  CameraStream stream = made_stream(frames, 0.04, [&](std::size_t i) {
    return wall().seen(model, swing(0.04 * static_cast<double>(i)).toRotationMatrix(), 2, i);
  });
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.pairs.size(), frames - stride);
  std::set<Stamp> from, to;
  for (const BearingPair& pair : signal.pairs) {
    EXPECT_EQ(pair.to - pair.from, from_seconds(0.04 * static_cast<double>(stride)));
    EXPECT_TRUE(from.insert(pair.from).second);
    EXPECT_TRUE(to.insert(pair.to).second);
    const double t0 = seconds_since(stream.stamps[0], pair.from), t1 = seconds_since(stream.stamps[0], pair.to);
    const Mat3 R = (swing(t0).conjugate() * swing(t1)).toRotationMatrix();
    std::vector<double> miss;
    for (const BearingMatch& m : pair.matches) miss.push_back((m.from.cast<double>() - R * m.to.cast<double>()).norm());
    std::sort(miss.begin(), miss.end());
    EXPECT_LT(miss[miss.size() / 2], 1.5e-3);  // 0.7 px after following for half a second
  }
}

TEST(VisualRotation, FollowsFastTurnsByPrediction) {
  // Up to 4 rad/s at 25 frames a second: 75 px from frame to frame, more than patch and pyramid reach by themselves.
  const CameraModel model = CameraModel::from_horizontal_fov(640, 400, 1.2);
  const auto attitude = [&](std::size_t i) {
    const double t = 0.04 * static_cast<double>(i);
    return exp_so3(Vec3(0, 0.4 * std::cos(10 * t), 0));
  };
  CameraStream stream =
      made_stream(25, 0.04, [&](std::size_t i) { return wall().seen(model, attitude(i).toRotationMatrix(), 1, i); });
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), 24u);
  for (std::size_t i = 0; i < 24; ++i) {
    const Vec3 error =
        log_so3(exp_so3(signal.increments[i].rotation).conjugate() * attitude(i).conjugate() * attitude(i + 1));
    EXPECT_LT(error.norm(), 1e-3) << i;
  }
}

TEST(VisualRotation, DoesNotDependOnThreads) {
  const CameraModel model = small_camera();
  CameraStream stream = made_stream(8, 0.04, [&](std::size_t i) {
    return wall().seen(model, swing(0.04 * static_cast<double>(i)).toRotationMatrix(), 2, i);
  });
  VisualRotationOptions alone;
  alone.decode_ahead = 0;
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const RotationSignal a = visual_rotation(stream, model, alone);
  cv::setNumThreads(threads);
  const RotationSignal b = visual_rotation(stream, model);
  ASSERT_EQ(a.increments.size(), b.increments.size());
  for (std::size_t i = 0; i < a.increments.size(); ++i) EXPECT_EQ(a.increments[i].rotation, b.increments[i].rotation);
}

TEST(VisualRotation, StillnessIsZeroWithinItsSigma) {
  const CameraModel model = small_camera();
  CameraStream stream =
      made_stream(40, 0.04, [&](std::size_t i) { return wall().seen(model, Mat3::Identity(), 3, i); });
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), 39u);
  double nees = 0;
  for (const RotationIncrement& r : signal.increments) nees += r.rotation.dot(r.information * r.rotation) / 3 / 39;
  RecordProperty("error_over_sigma_squared", std::to_string(nees));
  EXPECT_LT(nees, 2.0);
  EXPECT_GT(nees, 0.4);
}

TEST(VisualRotation, BlankFramesLeaveAGapAndANote) {
  const CameraModel model = small_camera();
  CameraStream stream = made_stream(12, 0.04, [&](std::size_t i) {
    if (i < 4 || i > 7) return wall().seen(model, swing(0.04 * static_cast<double>(i)).toRotationMatrix(), 2, i);
    cv::Mat dark(model.height, model.width, CV_8U);
    cv::RNG random(i);
    random.fill(dark, cv::RNG::NORMAL, 20, 2);
    return dark;
  });
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), 6u);  // 3 before, 3 after
  EXPECT_EQ(signal.increments[2].to, stream.stamps[3]);
  EXPECT_EQ(signal.increments[3].from, stream.stamps[8]);
  ASSERT_EQ(signal.notes.size(), 1u);
  EXPECT_EQ(signal.notes[0],
            "5 of 12 frames had too few features in common with the frame before them (blank, blurred, or a cut)");
}

TEST(VisualRotation, RepeatedPicturesAndLateFramesAreNoted) {
  const CameraModel model = small_camera();
  CameraStream stream = made_stream(9, 0.04, [&](std::size_t i) {
    const std::size_t shown = i == 3 ? 2 : i;
    return wall().seen(model, swing(0.04 * static_cast<double>(shown)).toRotationMatrix(), 2, shown);
  });
  for (std::size_t i = 6; i < 9; ++i) stream.stamps[i] += from_seconds(2);
  stream.open = [stamps = stream.stamps, make = stream.open]() -> std::unique_ptr<FrameReader> {
    class Restamped : public FrameReader {
     public:
      Restamped(std::unique_ptr<FrameReader> inner, std::vector<Stamp> stamps)
          : inner_(std::move(inner)), stamps_(std::move(stamps)) {}
      std::optional<Frame> next() override {
        auto frame = inner_->next();
        if (frame) frame->stamp = stamps_[frame->index];
        return frame;
      }

     private:
      std::unique_ptr<FrameReader> inner_;
      std::vector<Stamp> stamps_;
    };
    return std::make_unique<Restamped>(make(), stamps);
  };
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), 6u);  // 01 12 24 45 | 67 78
  EXPECT_EQ(signal.increments[2].from, stream.stamps[2]);
  EXPECT_EQ(signal.increments[2].to, stream.stamps[4]);
  ASSERT_EQ(signal.notes.size(), 2u);
  EXPECT_EQ(signal.notes[0], "1 of 9 frames repeat the picture before them and were left out");
}

TEST(VisualRotation, StampsMoveToTheExposureMiddleAndRowsCountFromTheReference) {
  const CameraModel model = small_camera();
  CameraStream stream = made_stream(3, 0.4, [&](std::size_t i) {
    return wall().seen(model, swing(0.04 * static_cast<double>(i)).toRotationMatrix(), 2, i);
  });
  stream.timing.instant = ExposureInstant::start;
  stream.timing.row = RowReference::middle;
  stream.timing.exposure_s = 0.008;
  const RotationSignal signal = visual_rotation(stream, model);
  ASSERT_EQ(signal.increments.size(), 2u);
  EXPECT_EQ(signal.increments[0].from, stream.stamps[0] + from_seconds(0.004));
  EXPECT_EQ(signal.timing.instant, ExposureInstant::middle);
  for (const BearingMatch& m : signal.pairs.at(0).matches) {
    const auto px = model.project(m.from.cast<double>());
    ASSERT_TRUE(px);
    EXPECT_NEAR(m.row_from, (px->y() - 199.5) / 400, 1e-4);
  }
}

TEST(VisualRotation, AnotherImageSizeThanTheModelsIsRefused) {
  const CameraModel model = CameraModel::from_horizontal_fov(320, 200, 1.2);
  CameraStream stream =
      made_stream(2, 0.04, [&](std::size_t i) { return wall().seen(small_camera(), Mat3::Identity(), 2, i); });
  EXPECT_THROW((void)visual_rotation(stream, model), std::invalid_argument);
}

TEST(VisualRotation, WithoutIntrinsicsTheFieldOfViewIsAssumedAndSaid) {
  CameraStream stream =
      made_stream(3, 0.04, [&](std::size_t i) { return wall().seen(small_camera(), Mat3::Identity(), 2, i); });
  const RotationSignal signal = visual_rotation(stream, 70 * std::numbers::pi / 180);
  EXPECT_TRUE(signal.focal_assumed);
  ASSERT_FALSE(signal.notes.empty());
  EXPECT_NE(signal.notes.back().find("70°"), std::string::npos);
}

// --- a real recording ---

struct Euroc {
  CameraStream cam;
  std::vector<double> imu_times_s;
  std::vector<Vec3> rates;
};

Euroc euroc_cam0(const fs::path& root) {
  Euroc out;
  CameraModel m;
  m.width = 752, m.height = 480;
  m.fx = 458.654, m.fy = 457.296, m.cx = 367.215, m.cy = 248.375;
  m.distortion = Distortion::radtan;
  m.coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  out.cam.model = m;
  out.cam.name = "cam0";
  Mat4 T;
  T << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949, 0, 0, 0, 1;
  out.cam.T_body_cam = T;
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(root / "cam0/data")) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  for (const std::string& f : files) out.cam.stamps.push_back(from_ns(std::stoll(fs::path(f).stem().string())));
  out.cam.open = [files, stamps = out.cam.stamps] {
    return std::make_unique<MadeFrames>(stamps,
                                        [files](std::size_t i) { return cv::imread(files[i], cv::IMREAD_GRAYSCALE); });
  };
  std::ifstream csv(root / "imu0/data.csv");
  for (std::string line; std::getline(csv, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::int64_t t = 0;
    char comma = 0;
    Vec3 w;
    fields >> t >> comma >> w.x() >> comma >> w.y() >> comma >> w.z();
    out.imu_times_s.push_back(seconds_since(out.cam.stamps.front(), from_ns(t)));
    out.rates.push_back(w);
  }
  return out;
}

struct Agreement {
  Vec3 bias;
  double r2, rms;
};
/// How well b follows a, a constant difference aside.
Agreement compare(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  const double n = static_cast<double>(a.size());
  Agreement out{Vec3::Zero(), 0, 0};
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) out.bias += (b[i] - a[i]) / n, mean += b[i] / n;
  double residual = 0, total = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    residual += (b[i] - a[i] - out.bias).squaredNorm();
    total += (b[i] - mean).squaredNorm();
  }
  out.r2 = 1 - residual / total;
  out.rms = std::sqrt(residual / 3 / n);
  return out;
}

TEST(VisualRotation, EurocTurnsAsItsGyroSays) {
  const fs::path root = fs::path(TAKT_DATA_DIR) / "euroc_micro/mav0";
  if (!fs::exists(root)) GTEST_SKIP() << "the real recording euroc_micro is not here";
  const Euroc euroc = euroc_cam0(root);
  const RotationSignal signal = visual_rotation(euroc.cam, *euroc.cam.model);
  EXPECT_GE(signal.increments.size(), 90u);
  const GyroCurve gyro(euroc.imu_times_s, euroc.rates);

  const Stamp epoch = euroc.cam.stamps.front();
  std::vector<Vec3> seen, apparent, felt;
  std::vector<Mat3> information;
  for (const RotationIncrement& r : signal.increments) {
    const double t0 = seconds_since(epoch, r.from), t1 = seconds_since(epoch, r.to);
    if (!gyro.covers(t0, t1)) continue;
    seen.push_back(*signal.R_body_sensor * r.rotation);
    apparent.push_back(*signal.R_body_sensor * r.apparent);
    felt.push_back(log_so3(gyro.between(t0, t1)));
    const Mat3 seen_covariance = *signal.R_body_sensor * r.information.inverse() * signal.R_body_sensor->transpose();
    const double gyro_variance = std::pow(gyro.noise_density(), 2) * (t1 - t0);
    information.push_back((seen_covariance + gyro_variance * Mat3::Identity()).inverse());
  }
  ASSERT_GE(seen.size(), 85u);
  const Agreement whole = compare(seen, felt), turned = compare(apparent, felt);
  double nees = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Vec3 e = felt[i] - seen[i] - whole.bias;
    nees += e.dot(information[i] * e) / 3 / static_cast<double>(seen.size());
  }
  std::cout << "    R² " << whole.r2 << ", rms residual " << whole.rms * 1e6 << " µrad, (error/σ)² " << nees
            << "; apparent: R² " << turned.r2 << ", " << turned.rms * 1e6 << " µrad\n";
  // The motion is gentle, 0.3 mrad a frame. About the optical axis, where pictures are best, 0.05 mrad remain: that
  // much is the gyro's own noise, which keeps R² below 0.975, and the translation of the shaking vehicle costs more. A
  // wrong axis, sign or lens gives less than a half.
  EXPECT_GT(whole.r2, 0.8);
  EXPECT_GT(turned.r2, 0.9);
  EXPECT_LT(nees, 2);
  EXPECT_EQ(signal.unexplained_fraction, 0);
}

}  // namespace
}  // namespace takt
