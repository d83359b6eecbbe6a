// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/print_target.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "takt/signals/target/target_corners.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

TEST(PrintTarget, TakesThePaperThatHoldsIt) {
  EXPECT_EQ(print_target(AprilGrid{6, 6, 0.02, 0.3}).page_width_mm, 210);
  EXPECT_EQ(print_target(AprilGrid{}).page_width_mm, 841);  // 0.71 m: A0
  EXPECT_NEAR(print_target(AprilGrid{}).width_mm, 1e3 * 0.088 * (6 * 1.3 + 0.3), 1e-6);
  EXPECT_THROW(static_cast<void>(print_target(AprilGrid{}, PaperSize{})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(print_target(AprilGrid{0, 1})), std::invalid_argument);
}

/// The page as a camera that looks straight at it would see it, with a little of what it lies on.
CameraStream page_of(const std::string& pgm) {
  std::ifstream in(pgm, std::ios::binary);
  std::string magic;
  int width = 0, height = 0, most = 0;
  in >> magic >> width >> height >> most;
  in.get();
  const std::string fine{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  // Means of 5 × 5 of the rasteriser's pixels, which it fills wholly or not at all.
  constexpr int share = 5, beyond = 8;
  const int columns = width / share + 2 * beyond, rows = height / share + 2 * beyond;
  const auto grey = std::make_shared<std::string>();
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int x = column - beyond, y = row - beyond;
      if (x < 0 || y < 0 || x >= width / share || y >= height / share) {
        grey->push_back(static_cast<char>(255));
        continue;
      }
      int sum = 0;
      for (int i = 0; i < share * share; ++i)
        sum += static_cast<std::uint8_t>(
            fine[static_cast<std::size_t>((share * y + i / share) * width + share * x + i % share)]);
      grey->push_back(static_cast<char>(sum / (share * share)));
    }
  const GrayImage image{columns, rows, columns, reinterpret_cast<const std::uint8_t*>(grey->data()), grey};
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
  CameraStream camera;
  camera.stamps = {from_ns(0)};
  camera.open = [image] { return std::make_unique<One>(image); };
  return camera;
}

TEST(PrintTarget, RasterisedItIsFoundTrueToScale) {
  if (std::system("pdftoppm -v >/dev/null 2>&1") != 0) GTEST_SKIP() << "no pdftoppm here";
  const fs::path folder = fs::temp_directory_path() / ("takt_target_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  for (const Target& target : {Target(AprilGrid{4, 5, 0.03, 0.3}), Target(AprilGrid{3, 3, 0.04, 0.25, 50, 1}),
                               Target(Checkerboard{7, 6, 0.024, 0.02}), Target(Charuco{6, 8, 0.03, 0.022}),
                               Target(CircleGrid{4, 11, 0.016, true}), Target(CircleGrid{6, 5, 0.025, false})}) {
    std::ofstream(folder / "target.pdf", std::ios::binary) << print_target(target).pdf;
    const std::string command =
        "pdftoppm -r 317.5 -gray " + (folder / "target.pdf").string() + " " + (folder / "p").string();
    ASSERT_EQ(std::system(command.c_str()), 0);
    const CornerStream found = find_target_corners(page_of((folder / "p-1.pgm").string()), target);
    const std::string name = target_type(target);
    ASSERT_EQ(found.corners[0].size(), found.board.size()) << name;
    // 2.5 px a mm; page y is up, picture y down.
    const Eigen::Matrix2d to_picture = Vec2(1, -1).asDiagonal() * (2500 * seen_from_front(target));
    const CornerObservation& one = found.corners[0].front();
    const Vec2 shift = one.pixel - to_picture * found.board[static_cast<std::size_t>(one.corner)].head<2>();
    for (const CornerObservation& c : found.corners[0]) {
      const Vec2 expected = to_picture * found.board[static_cast<std::size_t>(c.corner)].head<2>() + shift;
      // The rasteriser fills its own pixels, a fifth of ours, wholly or not at all: edges of squares are off by up to
      // half of one either way along both axes, at the reference corner and here; discs average theirs out.
      EXPECT_LT((c.pixel - expected).norm(), name == "circlegrid" ? 0.05 : 0.2) << name << " " << c.corner;
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace takt
