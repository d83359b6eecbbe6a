// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pdf.h"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

namespace takt {
namespace {

constexpr double point_mm = 25.4 / 72;

double pt(double mm) {
  return mm / point_mm;
}

std::string& last(std::vector<std::string>& pages) {
  if (pages.empty()) throw std::logic_error("Pdf: new_page comes before drawing");
  return pages.back();
}

}  // namespace

void Pdf::rectangle(double x, double y, double width, double height) {
  last(pages_) += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re f\n", pt(x), pt(y), pt(width), pt(height));
}

void Pdf::boxes(const std::vector<Box>& all, bool black) {
  std::string path = black ? "0 g\n" : "1 g\n";
  for (const Box& b : all)
    path += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re\n", pt(b.x), pt(b.y), pt(b.width), pt(b.height));
  last(pages_) += path + "f\n0 g\n";
}

void Pdf::disc(double x, double y, double radius) {
  // Four Bezier curves: within 3 parts in 10000 of a circle.
  const double k = 0.5522847498 * radius;
  const auto p = [](double px, double py) { return fmt::format("{:.4f} {:.4f} ", pt(px), pt(py)); };
  last(pages_) += p(x + radius, y) + "m\n" + p(x + radius, y + k) + p(x + k, y + radius) + p(x, y + radius) + "c\n" +
                  p(x - k, y + radius) + p(x - radius, y + k) + p(x - radius, y) + "c\n" + p(x - radius, y - k) +
                  p(x - k, y - radius) + p(x, y - radius) + "c\n" + p(x + k, y - radius) + p(x + radius, y - k) +
                  p(x + radius, y) + "c f\n";
}

void Pdf::line(double x1, double y1, double x2, double y2, double thickness) {
  last(pages_) +=
      fmt::format("{:.4f} w {:.4f} {:.4f} m {:.4f} {:.4f} l S\n", pt(thickness), pt(x1), pt(y1), pt(x2), pt(y2));
}

void Pdf::text(double x, double y, double size_mm, const std::string& words) {
  std::string escaped;
  for (const char c : words) {
    if (c == '(' || c == ')' || c == '\\') escaped += '\\';
    escaped += c;
  }
  last(pages_) += fmt::format("BT /F1 {:.3f} Tf {:.4f} {:.4f} Td ({}) Tj ET\n", pt(size_mm), pt(x), pt(y), escaped);
}

std::string Pdf::bytes() const {
  std::string out = "%PDF-1.4\n";
  std::vector<std::size_t> offsets;
  const auto object = [&](const std::string& body) {
    offsets.push_back(out.size());
    out += fmt::format("{} 0 obj\n{}\nendobj\n", offsets.size(), body);
  };
  // Objects: 1 catalogue, 2 list of pages, 3 font, then a page and its content in turn.
  std::string kids;
  for (std::size_t i = 0; i < pages_.size(); ++i) kids += fmt::format("{} 0 R ", 4 + 2 * i);
  object("<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>");
  object(fmt::format("<< /Type /Pages /Kids [{}] /Count {} >>", kids, pages_.size()));
  object("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>");
  // Rounded down: a page that is a hair too wide is rasterised with one more column.
  const auto page = [](double mm) { return std::floor(1e4 * pt(mm)) / 1e4; };
  for (std::size_t i = 0; i < pages_.size(); ++i) {
    object(
        fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents {} 0 R "
                    "/Resources << /Font << /F1 3 0 R >> >> >>",
                    page(width_mm_), page(height_mm_), 5 + 2 * i));
    object(fmt::format("<< /Length {} >>\nstream\n{}endstream", pages_[i].size(), pages_[i]));
  }
  const std::size_t table = out.size();
  out += fmt::format("xref\n0 {}\n0000000000 65535 f \n", offsets.size() + 1);
  for (const std::size_t offset : offsets) out += fmt::format("{:010} 00000 n \n", offset);
  out += fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", offsets.size() + 1, table);
  return out;
}

}  // namespace takt
