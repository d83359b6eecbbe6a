// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/print_dial.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "takt/workflows/pdf.h"

namespace takt {
namespace {

constexpr double margin_mm = 12, ruler_mm = 100, room_below_mm = 45;

/// A black stretch of the strip: degrees, and mm below its upper edge.
struct Mark {
  double from_deg, to_deg, top_mm, bottom_mm;
};

void add_lines(std::vector<Mark>& marks, const Dial& d, double step_deg, double top_mm, double bottom_mm) {
  for (auto k = static_cast<long>(std::ceil(d.from_deg / step_deg - 1e-9));
       static_cast<double>(k) * step_deg <= d.to_deg + 1e-9; ++k) {
    const double at = static_cast<double>(k) * step_deg;
    marks.push_back(
        {std::max(d.from_deg, at - 0.5 * d.line_deg), std::min(d.to_deg, at + 0.5 * d.line_deg), top_mm, bottom_mm});
  }
}

/// The same print that `ink` describes.
std::vector<Mark> marks_of(const Dial& d) {
  std::vector<double> depth;  // of the levels, from the upper edge
  for (const double level : dial_levels(d)) depth.push_back(1e3 * (0.5 * d.height_m - level));
  std::vector<Mark> marks;
  if (d.kind == DialKind::plain) {
    add_lines(marks, d, d.graduation_deg, depth[0], depth[1]);
    add_lines(marks, d, 1, depth[1], depth[2]);
    add_lines(marks, d, 5, depth[2], depth[3]);
    return marks;
  }
  add_lines(marks, d, 1, depth[0], depth[1]);
  const auto last = static_cast<long>(std::ceil(d.to_deg / d.cell_deg));
  for (auto n = static_cast<long>(std::floor(d.from_deg / d.cell_deg)); n < last; ++n) {
    if (!dial_cell(n)) continue;
    long end = n + 1;  // black cells side by side are one: no hairline between them
    while (end < last && dial_cell(end)) ++end;
    marks.push_back({std::max(d.from_deg, static_cast<double>(n) * d.cell_deg),
                     std::min(d.to_deg, static_cast<double>(end) * d.cell_deg), depth[1], depth[2]});
    n = end;
  }
  return marks;
}

void draw_ruler(Pdf& pdf, double x, double y) {
  pdf.line(x, y, x + ruler_mm, y, 0.2);
  for (int mm = 0; mm <= static_cast<int>(ruler_mm); ++mm)
    pdf.line(x + mm, y, x + mm, y + (mm % 10 == 0 ? 4 : mm % 5 == 0 ? 3 : 2), 0.1);
  pdf.text(x, y - 5, 3.5, fmt::format("This ruler is {:.0f} mm long: measure it before you trust the dial.", ruler_mm));
}

}  // namespace

PrintedDial print_dial(const Dial& dial, const PaperSize& paper) {
  check(dial);
  const double mm_a_deg = 1e3 * dial.radius_m * std::numbers::pi / 180, height_mm = 1e3 * dial.height_m;
  const double tile_mm = paper.width_mm - 2 * margin_mm, top_mm = paper.height_mm - margin_mm;
  if (height_mm + room_below_mm > paper.height_mm - 2 * margin_mm)
    throw std::invalid_argument(fmt::format("a dial {:.0f} mm high does not fit on a page of {:.0f} mm with its ruler",
                                            height_mm, paper.height_mm));
  PrintedDial out;
  out.length_mm = (dial.to_deg - dial.from_deg) * mm_a_deg;
  const std::vector<Mark> marks = marks_of(dial);
  const int pages = std::max(1, static_cast<int>(std::ceil(out.length_mm / tile_mm - 1e-9)));
  Pdf pdf(paper.width_mm, paper.height_mm);
  for (int page = 0; page < pages; ++page) {
    pdf.new_page();
    const double start = page * tile_mm, end = std::min(out.length_mm, start + tile_mm);  // mm of the strip
    const auto x_of = [&](double deg) { return margin_mm + (deg - dial.from_deg) * mm_a_deg - start; };
    const double left = margin_mm, right = margin_mm + end - start, bottom = top_mm - height_mm;
    for (const Mark& m : marks) {
      const double a = std::max(left, x_of(m.from_deg)), b = std::min(right, x_of(m.to_deg));
      if (a < b) pdf.rectangle(a, top_mm - m.bottom_mm, b - a, m.bottom_mm - m.top_mm);
    }
    for (const double x : {left, right}) {  // where to cut and to join
      pdf.line(x, top_mm + 1, x, top_mm + 6, 0.1);
      pdf.line(x, bottom - 1, x, bottom - 6, 0.1);
    }
    for (auto deg = static_cast<long>(std::ceil(dial.from_deg / 5)) * 5; static_cast<double>(deg) <= dial.to_deg;
         deg += 5)
      if (const double x = x_of(static_cast<double>(deg)); x >= left && x < right)
        pdf.text(x + 0.8, bottom - 5, 4, fmt::format("{}\xb0", deg));
    draw_ruler(pdf, left, bottom - 20);
    pdf.text(left, bottom - 32, 3.5,
             fmt::format("takt dial: {}, radius {:.1f} mm, {:g}\xb0 to {:g}\xb0. Page {} of {}: cut at the marks, join "
                         "edge to edge. Print at 100 %.",
                         dial.kind == DialKind::coded ? "coded" : "plain", 1e3 * dial.radius_m, dial.from_deg,
                         dial.to_deg, page + 1, pages));
  }
  out.pages = pdf.pages();
  out.pdf = pdf.bytes();
  return out;
}

}  // namespace takt
