// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/print_target.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "takt/recording/kalibr_files.h"
#include "takt/workflows/pdf.h"

namespace takt {
namespace {

constexpr double margin_mm = 6, below_mm = 20;  // what no printer reaches, and room for ruler and words
constexpr double a_narrow_mm = 841, a_long_mm = 1189;

/// The smallest sheet that holds the width and the height, from A4 on.
PaperSize smallest_paper(double width_mm, double height_mm) {
  std::array<PaperSize, 5> sheets;  // A0 … A4, upright
  sheets[0] = {a_narrow_mm, a_long_mm};
  for (std::size_t i = 1; i < sheets.size(); ++i)
    sheets[i] = {std::floor(sheets[i - 1].height_mm / 2), sheets[i - 1].width_mm};
  for (auto sheet = sheets.rbegin(); sheet != sheets.rend(); ++sheet)
    for (const PaperSize& s : {*sheet, PaperSize{sheet->height_mm, sheet->width_mm}})
      if (width_mm <= s.width_mm && height_mm <= s.height_mm) return s;
  return {std::ceil(width_mm), std::ceil(height_mm)};
}

struct Describe {
  std::string operator()(const AprilGrid& g) const {
    return fmt::format("aprilgrid {} x {}, tagSize {:g} m, tagSpacing {:g}", g.columns, g.rows, g.tag_m, g.spacing) +
           (g.border_cells == 2 ? "" : fmt::format(", border {} cell", g.border_cells));
  }
  std::string operator()(const Checkerboard& b) const {
    return fmt::format("checkerboard {} x {} inner corners, rows {:g} m, columns {:g} m", b.columns, b.rows, b.row_m,
                       b.column_m);
  }
  std::string operator()(const CircleGrid& g) const {
    return fmt::format("circlegrid {} x {}, spacing {:g} m, {}", g.columns, g.rows, g.spacing_m,
                       g.asymmetric ? "asymmetric" : "symmetric");
  }
  std::string operator()(const Charuco& c) const {
    return fmt::format("charuco {} x {} squares of {:g} m, markers {:g} m, {}", c.columns, c.rows, c.square_m,
                       c.marker_m, c.dictionary);
  }
};

void draw_ruler(Pdf& pdf, double x, double y, double length_mm) {
  pdf.line(x, y, x + length_mm, y, 0.2);
  for (int mm = 0; mm <= static_cast<int>(length_mm); ++mm)
    pdf.line(x + mm, y, x + mm, y + (mm % 10 == 0 ? 4 : mm % 5 == 0 ? 3 : 2), 0.1);
}

}  // namespace

PrintedTarget print_target(const Target& target, const std::optional<PaperSize>& paper) {
  check(target);
  // The board's axes to the page's, in mm.
  const Eigen::Matrix2d to_page = 1e3 * seen_from_front(target);
  const BoardExtent extent = board_extent(target);
  const Vec2 a = to_page * extent.low, b = to_page * extent.high;
  const Vec2 low = a.cwiseMin(b), size = a.cwiseMax(b) - low;
  const double width = size.x() + 2 * margin_mm, height = size.y() + 2 * margin_mm + below_mm;
  const PaperSize page = paper.value_or(smallest_paper(width, height));
  if (width > page.width_mm || height > page.height_mm)
    throw std::invalid_argument(
        fmt::format("a board of {:.0f} x {:.0f} mm does not fit on {:.0f} x {:.0f} mm with its ruler", size.x(),
                    size.y(), page.width_mm, page.height_mm));

  Pdf pdf(page.width_mm, page.height_mm);
  pdf.new_page();
  const Vec2 corner(0.5 * (page.width_mm - size.x()), page.height_mm - margin_mm - size.y());
  // Ink of one colour side by side is painted as one, so that no seam shows.
  std::vector<Pdf::Box> boxes;
  bool black = true;
  const auto flush = [&] {
    if (!boxes.empty()) pdf.boxes(boxes, black);
    boxes.clear();
  };
  for (const InkShape& s : board_ink(target)) {
    const Vec2 from = to_page * s.low - low + corner, to = to_page * s.high - low + corner;
    const Vec2 least = from.cwiseMin(to), most = from.cwiseMax(to);
    if (s.kind == InkShape::Kind::disc) {
      pdf.disc(0.5 * (least.x() + most.x()), 0.5 * (least.y() + most.y()), 0.5 * (most.x() - least.x()));
      continue;
    }
    if (s.black != black) flush();
    black = s.black;
    boxes.push_back({least.x(), least.y(), most.x() - least.x(), most.y() - least.y()});
  }
  flush();

  const double ruler_mm = std::min(100.0, 10 * std::floor((page.width_mm - 2 * margin_mm) / 10));
  const double left = margin_mm, bottom = corner.y() - 8;
  draw_ruler(pdf, left, bottom, ruler_mm);
  pdf.text(
      left, bottom - 5, 3.2,
      fmt::format("This ruler is {:.0f} mm long: measure it before you trust the board. Print at 100 %.", ruler_mm));
  pdf.text(left, bottom - 10, 3.2, "takt target: " + std::visit(Describe{}, target));
  return {pdf.bytes(), write_kalibr_target(target), size.x(), size.y(), page.width_mm, page.height_mm};
}

}  // namespace takt
