// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt {

/// Black (and white) drawings and words on pages, as PDF 1.4. Lengths in mm from the page's lower left corner.
class Pdf {
 public:
  Pdf(double page_width_mm, double page_height_mm) : width_mm_(page_width_mm), height_mm_(page_height_mm) {}

  void new_page() { pages_.emplace_back(); }
  void rectangle(double x, double y, double width, double height);
  struct Box {
    double x, y, width, height;
  };
  /// All as one shape, black or white: boxes side by side show no seam.
  void boxes(const std::vector<Box>& all, bool black);
  void disc(double x, double y, double radius);
  void line(double x1, double y1, double x2, double y2, double thickness);
  /// Helvetica; ASCII and the degree sign (\xb0) only.
  void text(double x, double y, double size_mm, const std::string& words);

  [[nodiscard]] std::size_t pages() const { return pages_.size(); }
  /// The whole file.
  [[nodiscard]] std::string bytes() const;

 private:
  double width_mm_, height_mm_;
  std::vector<std::string> pages_;  ///< content streams
};

}  // namespace takt
