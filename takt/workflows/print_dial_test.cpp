// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/print_dial.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>

namespace takt {
namespace {

namespace fs = std::filesystem;
constexpr double deg = std::numbers::pi / 180;

TEST(PrintDial, IsAsLongAsTheArcAndTiledOverPages) {
  const Dial dial{.radius_m = 0.6};
  const PrintedDial printed = print_dial(dial);
  EXPECT_NEAR(printed.length_mm, 600 * std::numbers::pi / 2, 1e-9);
  EXPECT_EQ(printed.pages, 4u);  // 942 mm over 273 mm a page
  EXPECT_TRUE(printed.pdf.starts_with("%PDF-1.4"));
  EXPECT_TRUE(printed.pdf.ends_with("%%EOF\n"));
  EXPECT_THROW(static_cast<void>(print_dial({.height_m = 0.2})), std::invalid_argument);
}

TEST(PrintDial, CrossReferencesPointAtTheirObjects) {
  const std::string pdf = print_dial({.kind = DialKind::plain, .to_deg = 20}).pdf;
  const auto table = static_cast<std::size_t>(std::stoul(pdf.substr(pdf.rfind("startxref") + 10)));
  ASSERT_EQ(pdf.substr(table, 5), "xref\n");
  std::size_t line = pdf.find('\n', table + 5) + 1 + 20;  // past "0 n" and the free entry
  for (int number = 1; pdf.substr(line + 11, 5) == "00000"; ++number, line += 20) {
    const std::string object = std::to_string(number) + " 0 obj\n";
    EXPECT_EQ(pdf.substr(std::stoul(pdf.substr(line, 10)), object.size()), object);
  }
}

/// A grey picture as pdftoppm writes it.
struct Page {
  int width = 0, height = 0;
  std::string grey;
  [[nodiscard]] bool black(double x_mm, double from_top_mm, double dpmm) const {
    const auto x = static_cast<std::size_t>(x_mm * dpmm), y = static_cast<std::size_t>(from_top_mm * dpmm);
    return static_cast<unsigned char>(grey.at(y * static_cast<std::size_t>(width) + x)) < 128;
  }
};

TEST(PrintDial, RasterisedItIsTheInkTrueToScale) {
  if (std::system("pdftoppm -v >/dev/null 2>&1") != 0) GTEST_SKIP() << "no pdftoppm here";
  const fs::path folder = fs::temp_directory_path() / ("takt_dial_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  for (const DialKind kind : {DialKind::coded, DialKind::plain}) {
    Dial dial{.kind = kind, .to_deg = 15};
    std::ofstream(folder / "dial.pdf", std::ios::binary) << print_dial(dial).pdf;
    const std::string command =
        "pdftoppm -r 254 -gray -aa no " + (folder / "dial.pdf").string() + " " + (folder / "p").string();
    ASSERT_EQ(std::system(command.c_str()), 0);
    Page page;
    int most = 0;
    std::string magic;
    std::ifstream in(folder / "p-1.pgm", std::ios::binary);
    in >> magic >> page.width >> page.height >> most;
    in.get();
    page.grey.assign(std::istreambuf_iterator<char>(in), {});
    ASSERT_EQ(page.width, 2970);
    int checked = 0;
    for (double angle = 0.3; angle < 14; angle += 0.0317)
      for (const double height : {0.025, 0.008, -0.005, -0.015, -0.025}) {
        // Only well inside a mark or a gap: the rasteriser rounds to 0.1 mm.
        const double share = ink_share(dial, (angle - 0.012) * deg, (angle + 0.012) * deg, height);
        if (share > 0 && share < 1) continue;
        const double x_mm = 12 + angle * deg * 750, from_top_mm = 12 + 30 - 1e3 * height;
        EXPECT_EQ(page.black(x_mm, from_top_mm, 10), share > 0.5) << angle << " " << height;
        ++checked;
      }
    EXPECT_GT(checked, 1500);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace takt
