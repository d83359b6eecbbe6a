// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/target_corners.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "takt/signals/target/find_grid.h"
#include "takt/signals/target/plane_map.h"
#include "takt/signals/target/saddle.h"
#include "takt/simulation/target_film.h"
#include "takt/simulation/tracks.h"

namespace takt {
namespace {

/// Errors of what was found in a rendered film.
struct Errors {
  double found = 0, in_view = 0, frames = 0, squares = 0, worst = 0;
  Vec2 mean = Vec2::Zero();
  [[nodiscard]] double rms() const { return std::sqrt(squares / (2 * found)); }
};

/// `group`: corners that can only be found together, because a tag has to be read for them.
Errors errors_of(const TargetFilm& film, const CornerStream& corners, std::size_t group = 1) {
  Errors e;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const FrameView view(*film.trajectory, film.cameras[0], *corners.model, film.exposures[0][i].middle_s);
    for (std::size_t first = 0; first + group <= film.board.size(); first += group) {
      bool whole = true;
      for (std::size_t k = first; k < first + group; ++k)
        whole = whole && view.pixel_of(film.world_from_board * film.board[k]).has_value();
      e.in_view += whole ? static_cast<double>(group) : 0;
    }
    e.frames += corners.corners[i].empty() ? 0 : 1;
    for (const CornerObservation& c : corners.corners[i]) {
      const auto truth = view.pixel_of(film.world_from_board * film.board[static_cast<std::size_t>(c.corner)]);
      if (!truth) continue;
      const Vec2 off = c.pixel - *truth;
      e.found += 1, e.squares += off.squaredNorm(), e.mean += off;
      e.worst = std::max(e.worst, off.norm());
    }
  }
  e.mean /= e.found;
  return e;
}

TargetFilmOptions short_film(const Target& target) {
  TargetFilmOptions o;
  o.duration_s = 0.6;
  o.seed = 3;
  o.scene.target = target;
  return o;
}

TEST(TargetCorners, AreFoundToHundredthsOfAPixel) {
  // A one-cell border, which is not Kalibr's, is lost in six of this film's twelve frames (docs/formats/kalibr.md): a
  // known loss of the detector's, and what is found of it must be as good all the same. Discs of the
  // asymmetric grid, with 4 px between them, come out five times as coarse as those of the other: not understood.
  for (const auto& [target, least, rms] : {std::tuple{Target(AprilGrid{}), 0.9, 0.02},
                                           {Target(AprilGrid{.border_cells = 1}), 0.45, 0.02},
                                           {Target(Checkerboard{9, 6, 0.05, 0.05}), 0.9, 0.02},
                                           {Target(Charuco{8, 6, 0.09, 0.066}), 0.9, 0.02},
                                           {Target(CircleGrid{4, 11, 0.03, true}), 0.9, 0.045},
                                           {Target(CircleGrid{7, 6, 0.05, false}), 0.9, 0.02}}) {
    TargetFilmOptions o = short_film(target);
    // Boards without ids have to be seen whole.
    if (board_markers(target).empty()) o.motion.turn_calm_rad_s = o.motion.turn_lively_rad_s = 0.5;
    const TargetFilm film = simulate_target(o);
    const CornerStream corners = find_target_corners(film.recording.cameras[0], target, {});
    const std::string name = target_type(target);
    const Errors e = errors_of(film, corners, name == "aprilgrid" ? 4 : 1);
    EXPECT_GT(e.found, least * e.in_view) << name;
    EXPECT_LT(e.rms(), rms) << name;
    EXPECT_LT(e.mean.norm(), 0.01) << name << " " << e.mean.transpose();
    EXPECT_LT(e.worst, 0.3) << name;
    RecordProperty(name + "_rms_px", std::to_string(e.rms()));
  }
}

TEST(TargetCorners, SurviveBlurRollingShutterAndPartialViews) {
  TargetFilmOptions o = short_film(AprilGrid{});
  o.duration_s = 1;
  o.camera.exposure_s = 0.005;
  o.camera.readout_s = 480 * 30e-6;
  o.distance_m = 0.55;  // most frames see a part
  o.scene.appears_s = 0.3;
  const TargetFilm film = simulate_target(o);
  const CornerStream corners = find_target_corners(film.recording.cameras[0], o.scene.target, {});
  for (std::size_t i = 0; i < corners.size(); ++i)
    EXPECT_TRUE(film.exposures[0][i].middle_s >= o.scene.appears_s || corners.corners[i].empty()) << i;
  const Errors e = errors_of(film, corners);
  EXPECT_GT(e.found, 0.55 * e.in_view);
  EXPECT_LT(e.rms(), 0.03);
  EXPECT_LT(e.worst, 0.3);
}

TEST(TargetCorners, AreTheSameForAnyNumberOfThreads) {
  TargetFilmOptions o = short_film(AprilGrid{3, 3, 0.1, 0.3});
  o.duration_s = 2;
  o.camera.exposure_s = 0;
  const TargetFilm film = simulate_target(o);
  const CornerStream one = find_target_corners(film.recording.cameras[0], o.scene.target, {.threads = 1});
  const CornerStream three = find_target_corners(film.recording.cameras[0], o.scene.target, {.threads = 3});
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one.corners[i].size(), three.corners[i].size());
    for (std::size_t k = 0; k < one.corners[i].size(); ++k) {
      EXPECT_EQ(one.corners[i][k].corner, three.corners[i][k].corner);
      EXPECT_EQ(one.corners[i][k].pixel, three.corners[i][k].pixel);
    }
  }
}

TEST(TargetCorners, AnotherBoardIsNotFound) {
  const TargetFilm film = simulate_target(short_film(AprilGrid{.first_id = 100}));
  const CornerStream corners = find_target_corners(film.recording.cameras[0], AprilGrid{}, {});
  for (const auto& frame : corners.corners) EXPECT_TRUE(frame.empty());
}

TEST(PlaneMap, CircleShiftIsThatOfTheOutline) {
  const Mat3 H = (Mat3() << 500, 20, 300, -30, 480, 200, 0.4, -0.3, 1).finished();
  std::vector<PlacedPixel> pairs;
  for (const Vec2& p : {Vec2(0, 0), Vec2(0.3, 0), Vec2(0, 0.3), Vec2(0.3, 0.3), Vec2(0.1, 0.2)})
    pairs.push_back({p, Vec3(H * p.homogeneous()).hnormalized()});
  const auto map = PlaneMap::fit(pairs);
  ASSERT_TRUE(map);
  const Vec2 centre(0.1, 0.12);
  // The centroid of the ellipse's area by Green's theorem over its outline.
  double area = 0;
  Vec2 moment = Vec2::Zero();
  constexpr int n = 20000;
  const auto at = [&](int k) {
    const double a = 2 * std::numbers::pi * k / n;
    return *(*map)(centre + 0.05 * Vec2(std::cos(a), std::sin(a)));
  };
  for (int k = 0; k < n; ++k) {
    const Vec2 a = at(k), b = at(k + 1);
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += cross / 2;
    moment += cross / 6 * (a + b);
  }
  const Vec2 shift = moment / area - *(*map)(centre);
  EXPECT_LT((map->circle_shift(centre, 0.05) - shift).norm(), 1e-5);
  EXPECT_GT(shift.norm(), 0.05);
}

/// The chessboards that come with OpenCV's documentation: real prints, real lenses.
TEST(TargetCorners, AgreeWithOpenCvsOnItsChessboards) {
  const std::filesystem::path folder = "/usr/share/doc/opencv-doc/examples/data";
  if (!std::filesystem::exists(folder / "left01.jpg")) GTEST_SKIP() << "no opencv-doc here";
  const Checkerboard board{9, 6, 0.025, 0.025};
  double n = 0, squares = 0;
  int found = 0, theirs_found = 0;
  for (const char* side : {"left", "right"})
    for (int k = 1; k <= 14; ++k) {
      char name[32];
      std::snprintf(name, sizeof name, "%s%02d.jpg", side, k);
      if (!std::filesystem::exists(folder / name)) continue;
      const auto picture = std::make_shared<cv::Mat>(cv::imread((folder / name).string(), cv::IMREAD_GRAYSCALE));
      if (picture->empty()) continue;
      CameraStream camera;
      camera.stamps = {from_ns(0)};
      const GrayImage image{picture->cols, picture->rows, static_cast<std::ptrdiff_t>(picture->step), picture->data,
                            picture};
      class One : public FrameReader {
       public:
        explicit One(GrayImage i) : image_(std::move(i)) {}
        std::optional<Frame> next() override {
          if (given_) return std::nullopt;
          given_ = true;
          return Frame{0, from_ns(0), 0, image_};
        }

       private:
        GrayImage image_;
        bool given_ = false;
      };
      camera.open = [image] { return std::make_unique<One>(image); };
      std::vector<cv::Point2f> theirs;
      if (!cv::findChessboardCorners(*picture, {9, 6}, theirs)) continue;
      ++theirs_found;
      cv::cornerSubPix(*picture, theirs, {5, 5}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-4});
      const auto ours = find_target_corners(camera, board, {.threads = 1}).corners[0];
      found += ours.empty() ? 0 : 1;
      for (const CornerObservation& c : ours) {
        double nearest = 1e9;  // whichever end they count from
        for (const cv::Point2f& p : theirs) nearest = std::min(nearest, (c.pixel - Vec2(p.x, p.y)).norm());
        ++n, squares += nearest * nearest;
      }
    }
  EXPECT_GE(found, theirs_found - 1);
  EXPECT_GT(n, 0.95 * 54 * theirs_found);
  // Each detector's own noise on these JPEGs is 0.11 and 0.14 px (docs/methods/intrinsics.md): two that were right
  // would differ by as much, and 0.10 px could not be met.
  EXPECT_LT(std::sqrt(squares / (2 * n)), 0.13);
  RecordProperty("rms_px_against_cornerSubPix", std::to_string(std::sqrt(squares / (2 * n))));
  std::printf("opencv-doc chessboards: %d of %d boards, rms difference %.3f px to cornerSubPix\n", found, theirs_found,
              std::sqrt(squares / (2 * n)));
}

}  // namespace
}  // namespace takt
