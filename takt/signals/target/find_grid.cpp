// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/find_grid.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace takt {

namespace {

cv::Mat1b view_of(const GrayImage& image) {
  return {image.height, image.width, const_cast<std::uint8_t*>(image.pixels), static_cast<std::size_t>(image.stride)};
}

std::vector<Vec2> places(const std::vector<cv::Point2f>& points) {
  std::vector<Vec2> out;
  for (const cv::Point2f& p : points) out.emplace_back(p.x, p.y);
  return out;
}

float grey(const GrayImage& image, const Vec2& p) {
  const int x = std::clamp(static_cast<int>(std::lround(p.x())), 0, image.width - 1);
  const int y = std::clamp(static_cast<int>(std::lround(p.y())), 0, image.height - 1);
  return static_cast<float>(image.row(y)[x]);
}

/// Mirrors the order of the columns in each row.
void mirror(std::vector<Vec2>& points, int columns) {
  for (auto row = points.begin(); row != points.end(); row += columns) std::reverse(row, row + columns);
}

/// Rows are listed from the first down and each to the right, as seen from the front: the turn from the first row's
/// direction to the first column's is clockwise in the picture (whose y points down).
bool is_mirrored(const std::vector<Vec2>& p, int columns) {
  const Vec2 along = p[static_cast<std::size_t>(columns - 1)] - p.front(),
             down = p[p.size() - static_cast<std::size_t>(columns)] - p.front();
  return along.x() * down.y() - along.y() * down.x() < 0;
}

std::vector<Vec2> find_checkerboard(const GrayImage& image, const Checkerboard& board) {
  std::vector<cv::Point2f> corners;
  const cv::Mat1b view = view_of(image);
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (!cv::findChessboardCorners(view, {board.columns, board.rows}, corners, flags)) return {};
  std::vector<Vec2> p = places(corners);
  if (is_mirrored(p, board.columns)) mirror(p, board.columns);
  // The square before the first corner is black, the one beside that white; where half a turn changes this, it decides.
  const auto at = [&](int row, int column) { return p[static_cast<std::size_t>(row * board.columns + column)]; };
  const Vec2 inner = 0.5 * (at(0, 0) + at(1, 1)), beside = 0.5 * (at(0, 1) + at(1, 0)) + (at(0, 1) - at(0, 0));
  const bool first_is_black = grey(image, inner) < grey(image, beside);
  const bool unique = (board.rows + board.columns) % 2 == 1;
  if (unique ? !first_is_black : p.front().y() > p.back().y()) std::reverse(p.begin(), p.end());
  return p;
}

std::vector<Vec2> find_circles(const GrayImage& image, const CircleGrid& grid) {
  std::vector<cv::Point2f> centres;
  const int kind = grid.asymmetric ? cv::CALIB_CB_ASYMMETRIC_GRID : cv::CALIB_CB_SYMMETRIC_GRID;
  if (!cv::findCirclesGrid(view_of(image), {grid.columns, grid.rows}, centres, kind)) return {};
  std::vector<Vec2> p = places(centres);
  if (is_mirrored(p, grid.columns)) {
    if (grid.asymmetric) return {};
    mirror(p, grid.columns);
  }
  if (!grid.asymmetric && p.front().y() > p.back().y()) std::reverse(p.begin(), p.end());
  return p;
}

}  // namespace

std::vector<Vec2> find_grid(const GrayImage& image, const Target& target) {
  if (const auto* board = std::get_if<Checkerboard>(&target)) return find_checkerboard(image, *board);
  if (const auto* circles = std::get_if<CircleGrid>(&target)) return find_circles(image, *circles);
  return {};
}

}  // namespace takt
