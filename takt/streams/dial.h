// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/streams/camera_model.h"

namespace takt {

/// What is printed on the dial.
///   plain  graduations alone, as [Fu2021] fig. 4: a view of them repeats every 5°
///   coded  a short row of graduations above a row of black and white cells, in an order that no stretch of
///          eleven cells has twice: any view of 3° says where on the dial it is
enum class DialKind { plain, coded };

/// A strip bent into an arc about the pivot. Everything on it is measured as an angle about the pivot, so that its
/// radius matters to the printer alone.
struct Dial {
  DialKind kind = DialKind::coded;
  double radius_m = 0.75;
  double from_deg = 0, to_deg = 90;
  double height_m = 0.06;       ///< of the pattern
  double graduation_deg = 0.5;  ///< between two lines of the plain dial
  double line_deg = 0.08;       ///< width of a line
  double cell_deg = 0.25;       ///< width of a cell of the coded dial
};

/// Throws std::invalid_argument naming what no dial can have.
void check(const Dial& dial);

/// Whether the dial is black at an angle (rad, from the dial's zero) and a height (m, up from the strip's middle).
[[nodiscard]] bool ink(const Dial& dial, double angle_rad, double height_m);
/// How much of a stretch [from, to] (rad) is black at a height.
[[nodiscard]] double ink_share(const Dial& dial, double from_rad, double to_rad, double height_m);
/// Heights (m) between which the strip looks the same, from the top down: the first is the upper edge.
[[nodiscard]] std::vector<double> dial_levels(const Dial& dial);
/// Colour of the n-th cell from the dial's zero, n may be negative: a shift register of eleven cells, period 2047.
[[nodiscard]] bool dial_cell(long n);

/// Where on the dial a pixel looks, against the radius through the camera.
struct DialPoint {
  double angle_rad;  ///< about the pivot, positive towards greater dial angles
  double height_m;   ///< up from the strip's middle
};

/// A camera on the bob that looks outward at the dial's inside [Fu2021 §3.4]. The radius through the camera's centre
/// meets the dial at the reading. Without rotations the optical axis lies along it, and a point at the angle α is seen
/// at u = f·R·sin α / (R·cos α − l).
struct DialView {
  CameraModel camera;
  double radius_m = 0.75;          ///< R
  double pivot_distance_m = 0.45;  ///< l: from the pivot to the camera's centre
  double roll_rad = 0;             ///< about the optical axis: turns the dial's direction in the picture clockwise
  double yaw_rad = 0;              ///< about the pivot's direction, positive towards greater dial angles
  double pitch_rad = 0;            ///< upward
  double height_m = 0;             ///< of the camera's centre above the strip's middle

  /// Nothing where the pixel does not see the dial's cylinder or the lens cannot be undone.
  [[nodiscard]] std::optional<DialPoint> at(const Vec2& pixel) const;
  /// The pixel that sees a point, or nothing.
  [[nodiscard]] std::optional<Vec2> project(const DialPoint& point) const;
  /// Dial angle that one pixel sees in the middle of the picture (rad).
  [[nodiscard]] double pixel_rad() const;

 private:
  /// From the camera's frame to that of the radius: x along the dial, y down, z outward.
  [[nodiscard]] Mat3 rotation() const;
};

}  // namespace takt
