// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/target.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "takt/streams/markers.h"

namespace takt {

namespace {

constexpr const char* april_family = "DICT_APRILTAG_36h11";

void need(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}
void need_count(int columns, int rows, int least, const char* of) {
  need(columns >= least && rows >= least && columns <= 200 && rows <= 200,
       fmt::format("a board of {} x {} {}: {} to 200 of them each way", columns, rows, of, least));
}
void need_length(double metres, const char* of) {
  need(metres > 1e-4 && metres < 100, fmt::format("a {} of {} m: lengths are in metres", of, metres));
}

struct Check {
  void operator()(const AprilGrid& g) const {
    need_count(g.columns, g.rows, 1, "tags");
    const int known = marker_dictionary(april_family).count;
    need(g.first_id >= 0 && g.first_id + g.columns * g.rows <= known,
         fmt::format("{} x {} tags from id {} on: the family 36h11 has {}", g.columns, g.rows, g.first_id, known));
    need_length(g.tag_m, "tag size");
    need(g.spacing > 0.01 && g.spacing < 10,
         fmt::format("a tag spacing of {}: it is gap / tag size, such as 0.3", g.spacing));
    need(g.border_cells == 1 || g.border_cells == 2, fmt::format("a border of {} cells: 1 or 2", g.border_cells));
  }
  void operator()(const Checkerboard& b) const {
    need_count(b.columns, b.rows, 2, "inner corners");
    need_length(b.row_m, "row spacing");
    need_length(b.column_m, "column spacing");
  }
  void operator()(const CircleGrid& c) const {
    need_count(c.columns, c.rows, 2, "circles");
    need_length(c.spacing_m, "spacing");
    need(c.diameter_m >= 0 && c.diameter_m < (c.asymmetric ? std::sqrt(2.0) : 1) * c.spacing_m,
         fmt::format("circles of {} m, {} m apart, overlap", c.diameter_m, c.spacing_m));
  }
  void operator()(const Charuco& c) const {
    need_count(c.columns, c.rows, 2, "squares");
    need_length(c.square_m, "square size");
    need_length(c.marker_m, "marker size");
    need(c.marker_m < c.square_m, fmt::format("markers of {} m in squares of {} m", c.marker_m, c.square_m));
    const int known = marker_dictionary(c.dictionary).count;
    need(c.columns * c.rows / 2 <= known, fmt::format("{} x {} squares need {} markers: {} has {}", c.columns, c.rows,
                                                      c.columns * c.rows / 2, c.dictionary, known));
  }
};

Vec3 flat(double x, double y) {
  return {x, y, 0};
}

struct Points {
  std::vector<Vec3> operator()(const AprilGrid& g) const {
    std::vector<Vec3> out;
    const double pitch = g.tag_m * (1 + g.spacing);
    for (int r = 0; r < 2 * g.rows; ++r)
      for (int c = 0; c < 2 * g.columns; ++c)
        out.push_back(flat(c / 2 * pitch + c % 2 * g.tag_m, r / 2 * pitch + r % 2 * g.tag_m));
    return out;
  }
  std::vector<Vec3> operator()(const Checkerboard& b) const {
    std::vector<Vec3> out;
    for (int r = 0; r < b.rows; ++r)
      for (int c = 0; c < b.columns; ++c) out.push_back(flat(b.row_m * r, b.column_m * c));
    return out;
  }
  std::vector<Vec3> operator()(const CircleGrid& g) const {
    std::vector<Vec3> out;
    for (int r = 0; r < g.rows; ++r)
      for (int c = 0; c < g.columns; ++c)
        out.push_back(g.asymmetric ? flat((2 * c + r % 2) * g.spacing_m, r * g.spacing_m)
                                   : flat(g.spacing_m * r, g.spacing_m * c));
    return out;
  }
  std::vector<Vec3> operator()(const Charuco& b) const {
    std::vector<Vec3> out;
    for (int r = 1; r < b.rows; ++r)
      for (int c = 1; c < b.columns; ++c) out.push_back(flat(b.square_m * c, b.square_m * r));
    return out;
  }
};

/// Black cells of a marker as OpenCV draws it, with its border, turned by half a turn if asked.
BoardMarker marker(const MarkerDictionary& dictionary, int id, int border, bool upside_down, const Vec2& low,
                   double side) {
  BoardMarker out;
  out.id = id;
  out.corners = {low, low + Vec2(side, 0), low + Vec2(side, side), low + Vec2(0, side)};
  out.border = border;
  out.cells = dictionary.bits + 2 * border;
  out.black.assign(static_cast<std::size_t>(out.cells * out.cells), true);
  for (int r = 0; r < dictionary.bits; ++r)
    for (int c = 0; c < dictionary.bits; ++c) {
      const std::size_t bit = static_cast<std::size_t>(r * dictionary.bits + c);
      int row = r + border, column = c + border;
      if (upside_down) row = out.cells - 1 - row, column = out.cells - 1 - column;
      out.black[static_cast<std::size_t>(row * out.cells + column)] =
          !dictionary.white[static_cast<std::size_t>(id)][bit];
    }
  return out;
}

bool is_black_square(const Charuco& b, int column, int row_from_below) {
  const int from_above = b.rows - 1 - row_from_below;
  return b.legacy ? (column + row_from_below) % 2 == 0 : (column + from_above) % 2 == 0;
}

struct Markers {
  std::vector<BoardMarker> operator()(const AprilGrid& g) const {
    std::vector<BoardMarker> out;
    const double pitch = g.tag_m * (1 + g.spacing);
    const MarkerDictionary& dictionary = marker_dictionary(april_family);
    for (int r = 0; r < g.rows; ++r)
      for (int c = 0; c < g.columns; ++c)
        out.push_back(marker(dictionary, g.first_id + g.columns * r + c, g.border_cells, true,
                             Vec2(c * pitch, r * pitch), g.tag_m));
    return out;
  }
  std::vector<BoardMarker> operator()(const Charuco& b) const {
    std::vector<BoardMarker> out;
    const MarkerDictionary& dictionary = marker_dictionary(b.dictionary);
    const double inset = 0.5 * (b.square_m - b.marker_m);
    for (int r = b.rows - 1; r >= 0; --r)  // ids count from the upper left
      for (int c = 0; c < b.columns; ++c)
        if (!is_black_square(b, c, r))
          out.push_back(marker(dictionary, static_cast<int>(out.size()), 1, false,
                               Vec2(c * b.square_m + inset, r * b.square_m + inset), b.marker_m));
    return out;
  }
  template <class Other>
  std::vector<BoardMarker> operator()(const Other&) const {
    return {};
  }
};

InkShape box(bool black, const Vec2& a, const Vec2& b) {
  return {InkShape::Kind::rectangle, black, a.cwiseMin(b), a.cwiseMax(b)};
}

/// A black square, then its white cells, those side by side as one.
void add_marker(std::vector<InkShape>& ink, const BoardMarker& m) {
  const Vec2 top_left = m.corners[3];
  const double cell = (m.corners[1].x() - m.corners[0].x()) / m.cells;
  ink.push_back(box(true, m.corners[0], m.corners[2]));
  for (int r = 0; r < m.cells; ++r)
    for (int c = 0; c < m.cells; ++c) {
      const auto black = [&](int column) { return m.black[static_cast<std::size_t>(r * m.cells + column)]; };
      if (black(c)) continue;
      int end = c + 1;
      while (end < m.cells && !black(end)) ++end;
      ink.push_back(box(false, top_left + cell * Vec2(c, -r), top_left + cell * Vec2(end, -r - 1)));
      c = end;
    }
}

struct Ink {
  std::vector<InkShape> operator()(const AprilGrid& g) const {
    std::vector<InkShape> ink;
    for (const BoardMarker& m : Markers{}(g)) add_marker(ink, m);
    const double pitch = g.tag_m * (1 + g.spacing), gap = g.tag_m * g.spacing;
    for (int r = 0; r <= g.rows; ++r)
      for (int c = 0; c <= g.columns; ++c)
        ink.push_back(box(true, Vec2(c * pitch - gap, r * pitch - gap), Vec2(c * pitch, r * pitch)));
    return ink;
  }
  std::vector<InkShape> operator()(const Checkerboard& b) const {
    std::vector<InkShape> ink;
    for (int r = -1; r < b.rows; ++r)
      for (int c = -1; c < b.columns; ++c)
        if ((r + c) % 2 == 0)
          ink.push_back(box(true, Vec2(b.row_m * r, b.column_m * c), Vec2(b.row_m * (r + 1), b.column_m * (c + 1))));
    return ink;
  }
  std::vector<InkShape> operator()(const CircleGrid& g) const {
    std::vector<InkShape> ink;
    const double diameter = g.diameter_m > 0 ? g.diameter_m : (g.asymmetric ? 1 : 0.5) * g.spacing_m;
    const Vec2 half = Vec2::Constant(0.5 * diameter);
    for (const Vec3& p : Points{}(g))
      ink.push_back({InkShape::Kind::disc, true, p.head<2>() - half, p.head<2>() + half});
    return ink;
  }
  std::vector<InkShape> operator()(const Charuco& b) const {
    std::vector<InkShape> ink;
    for (int r = 0; r < b.rows; ++r)
      for (int c = 0; c < b.columns; ++c)
        if (is_black_square(b, c, r))
          ink.push_back(box(true, b.square_m * Vec2(c, r), b.square_m * Vec2(c + 1, r + 1)));
    for (const BoardMarker& m : Markers{}(b)) add_marker(ink, m);
    return ink;
  }
};

}  // namespace

const char* target_type(const Target& target) {
  constexpr std::array<const char*, 4> names{"aprilgrid", "checkerboard", "circlegrid", "charuco"};
  return names[target.index()];
}

void check(const Target& target) {
  std::visit(Check{}, target);
}

std::vector<Vec3> board_points(const Target& target) {
  return std::visit(Points{}, target);
}

std::vector<BoardMarker> board_markers(const Target& target) {
  return std::visit(Markers{}, target);
}

std::vector<InkShape> board_ink(const Target& target) {
  return std::visit(Ink{}, target);
}

BoardExtent board_extent(const Target& target) {
  constexpr double far = std::numeric_limits<double>::infinity();
  BoardExtent e{Vec2::Constant(far), Vec2::Constant(-far)};
  for (const InkShape& shape : board_ink(target)) {
    e.low = e.low.cwiseMin(shape.low);
    e.high = e.high.cwiseMax(shape.high);
  }
  return e;
}

Eigen::Matrix2d seen_from_front(const Target& target) {
  Eigen::Matrix2d out = Eigen::Matrix2d::Identity();
  const auto* circles = std::get_if<CircleGrid>(&target);
  if (circles != nullptr && circles->asymmetric)
    out << 1, 0, 0, -1;
  else if (circles != nullptr || std::holds_alternative<Checkerboard>(target))
    out << 0, 1, -1, 0;
  return out;
}

}  // namespace takt
