// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>
#include <variant>
#include <vector>

#include "takt/motion/rotation.h"

/// Calibration boards, described as Kalibr's target files do.
/// A board lies in z = 0 of its own frame. Its z axis points out of the print, except where said.
namespace takt {

/// AprilTags of the family 36h11 with a black square at every tag's corner. The origin is the lower left corner of the
/// lowest left tag, x to the right, y up. Tag id = first_id + columns·row + column.
struct AprilGrid {
  int columns = 6, rows = 6;  ///< tags
  double tag_m = 0.088;       ///< side of a tag, from outer black edge to outer black edge
  double spacing = 0.3;       ///< gap between tags / side of a tag
  int first_id = 0;           ///< of the lowest left tag; Kalibr's codeOffset
  int border_cells = 2;       ///< width of the black border; 2 as Kalibr prints it, 1 as AprilTag itself
};

/// Black and white squares, counted by their inner corners. The origin is the upper left corner, x down, y right.
/// The square before the origin (above it and to its left) is black.
struct Checkerboard {
  int columns = 9, rows = 6;             ///< inner corners
  double row_m = 0.03, column_m = 0.03;  ///< from a row to the next, from a column to the next
};

/// Black discs. The origin is the upper left disc's centre. Symmetric: as the checkerboard, x down, y right.
/// Asymmetric: x right, y down, so z points into the print; neighbours in a row are two spacings apart, rows one, and
/// each odd row stands one to the right.
struct CircleGrid {
  int columns = 4, rows = 11;
  double spacing_m = 0.02;
  bool asymmetric = true;
  double diameter_m = 0;  ///< 0: not known; printed as half a spacing, or as one where asymmetric
};

/// A checkerboard with ArUco markers in its white squares, counted by its squares. The origin is the lower left corner
/// of the board, x right, y up; corners are counted row by row from the lower left. Kalibr has no such target.
struct Charuco {
  int columns = 8, rows = 6;  ///< squares
  double square_m = 0.03, marker_m = 0.022;
  std::string dictionary = "DICT_6X6_250";  ///< by OpenCV's name
  bool legacy = false;  ///< the pattern of OpenCV before 4.6: with even rows, white at the upper left
};

using Target = std::variant<AprilGrid, Checkerboard, CircleGrid, Charuco>;

/// "aprilgrid", "checkerboard", "circlegrid", "charuco".
[[nodiscard]] const char* target_type(const Target& target);
/// Throws std::invalid_argument naming what no board can have.
void check(const Target& target);

/// The corners or centres that a detector looks for (m, z = 0): the numbering of CornerObservation::corner. Row by row,
/// as Kalibr counts; an AprilGrid has 2·columns corners in each of 2·rows rows, from the lower left.
[[nodiscard]] std::vector<Vec3> board_points(const Target& target);

/// A marker: its corners' places on the board (lower left, lower right, upper right, upper left as seen on the board),
/// and its black cells.
struct BoardMarker {
  int id = 0;
  std::array<Vec2, 4> corners;
  int border = 0;           ///< width of the border in cells
  int cells = 0;            ///< along a side, border included
  std::vector<bool> black;  ///< row by row from the top left as seen on the board, cells² of them
};
[[nodiscard]] std::vector<BoardMarker> board_markers(const Target& target);

/// One thing printed on the board; later ones cover earlier ones.
struct InkShape {
  enum class Kind { rectangle, disc } kind = Kind::rectangle;
  bool black = true;
  Vec2 low = Vec2::Zero(), high = Vec2::Zero();  ///< corners of the rectangle, or of the square around the disc (m)
};
[[nodiscard]] std::vector<InkShape> board_ink(const Target& target);

/// The rectangle that holds all ink: low and high corner (m).
struct BoardExtent {
  Vec2 low, high;
};
[[nodiscard]] BoardExtent board_extent(const Target& target);

/// Takes the board's x and y to right and up as seen by who looks at the print. Its determinant is −1 where the
/// board's z axis points into the print.
[[nodiscard]] Eigen::Matrix2d seen_from_front(const Target& target);

}  // namespace takt
