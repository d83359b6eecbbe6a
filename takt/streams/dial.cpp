// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/dial.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr long code_period = 2047;

/// x¹¹ + x⁹ + 1 is primitive: every pattern of eleven cells but the all-white one comes once a period.
const std::array<bool, code_period>& code() {
  static const std::array<bool, code_period> cells = [] {
    std::array<bool, code_period> out{};
    unsigned state = 1;
    for (bool& cell : out) {
      cell = (state & 1) != 0;
      const unsigned next = (state ^ (state >> 2)) & 1;
      state = (state >> 1) | (next << 10);
    }
    return out;
  }();
  return cells;
}

/// Share of [from, to] covered by stripes of a width centred on the multiples of a step.
double stripes(double from, double to, double step, double width) {
  // Covered length from 0 to x, for stripes [k·step − width/2, k·step + width/2].
  const auto covered = [&](double x) {
    const double cells = std::floor(x / step + 0.5), rest = x - cells * step;
    return cells * width + std::clamp(rest, -0.5 * width, 0.5 * width);
  };
  return (covered(to) - covered(from)) / (to - from);
}

double cells(double from, double to, double width) {
  double black = 0;
  for (auto n = static_cast<long>(std::floor(from / width)); static_cast<double>(n) * width < to; ++n)
    if (dial_cell(n))
      black += std::min(to, static_cast<double>(n + 1) * width) - std::max(from, static_cast<double>(n) * width);
  return black / (to - from);
}

}  // namespace

void check(const Dial& d) {
  const auto fail = [](const std::string& what) { throw std::invalid_argument("Dial: " + what); };
  if (!(d.radius_m > 0.01 && d.radius_m < 100))
    fail(fmt::format("a radius of {} m; between 0.01 and 100 expected", d.radius_m));
  if (!(d.to_deg > d.from_deg) || d.to_deg - d.from_deg > 360)
    fail(fmt::format("runs from {}° to {}°", d.from_deg, d.to_deg));
  if (!(d.height_m > 0)) fail(fmt::format("a height of {} m", d.height_m));
  if (!(d.graduation_deg > 0) || !(d.line_deg > 0 && d.line_deg < d.graduation_deg))
    fail(fmt::format("lines of {}° every {}°", d.line_deg, d.graduation_deg));
  if (!(d.cell_deg > 0)) fail(fmt::format("cells of {}°", d.cell_deg));
  if (d.kind == DialKind::coded && (d.to_deg - d.from_deg) / d.cell_deg > code_period)
    fail(fmt::format("{} cells of {}°, but only {} can be told apart",
                     static_cast<long>((d.to_deg - d.from_deg) / d.cell_deg), d.cell_deg, code_period));
}

bool dial_cell(long n) {
  const long wrapped = ((n % code_period) + code_period) % code_period;
  return code()[static_cast<std::size_t>(wrapped)];
}

std::vector<double> dial_levels(const Dial& d) {
  const double top = 0.5 * d.height_m, h = d.height_m;
  if (d.kind == DialKind::coded) return {top, top - 0.3 * h, -top};
  return {top, top - 0.45 * h, top - 0.65 * h, top - 0.9 * h, -top};
}

double ink_share(const Dial& d, double from_rad, double to_rad, double height_m) {
  if (std::abs(height_m) > 0.5 * d.height_m) return 0;
  const double a = std::max(from_rad / deg, d.from_deg), b = std::min(to_rad / deg, d.to_deg);
  if (a >= b) return 0;
  const double inside = (b - a) * deg / (to_rad - from_rad);
  const std::vector<double> level = dial_levels(d);
  if (d.kind == DialKind::coded) {
    if (height_m > level[1]) return inside * stripes(a, b, 1, d.line_deg);
    return inside * cells(a, b, d.cell_deg);
  }
  // Lines hang from the upper edge: short ones, longer ones every degree, the longest every five.
  if (height_m > level[1]) return inside * stripes(a, b, d.graduation_deg, d.line_deg);
  if (height_m > level[2]) return inside * stripes(a, b, 1, d.line_deg);
  if (height_m > level[3]) return inside * stripes(a, b, 5, d.line_deg);
  return 0;
}

bool ink(const Dial& d, double angle_rad, double height_m) {
  const double little = 1e-9;
  return ink_share(d, angle_rad - little, angle_rad + little, height_m) > 0.5;
}

Mat3 DialView::rotation() const {
  const Eigen::AngleAxisd yaw(yaw_rad, Vec3::UnitY()), pitch(pitch_rad, Vec3::UnitX()), roll(-roll_rad, Vec3::UnitZ());
  return (yaw * pitch * roll).toRotationMatrix();
}

std::optional<DialPoint> DialView::at(const Vec2& pixel) const {
  const auto bearing = camera.bearing(pixel);
  if (!bearing) return std::nullopt;
  const Vec3 ray = rotation() * *bearing;
  // The camera is at (0, 0, l) in the pivot's frame: |(x·t, l + z·t)| = R, the farther of the two crossings.
  const double a = ray.x() * ray.x() + ray.z() * ray.z(), b = ray.z() * pivot_distance_m,
               c = pivot_distance_m * pivot_distance_m - radius_m * radius_m, root = b * b - a * c;
  if (a < 1e-12 || root < 0) return std::nullopt;
  const double t = (-b + std::sqrt(root)) / a;
  if (!(t > 0)) return std::nullopt;
  return DialPoint{std::atan2(ray.x() * t, pivot_distance_m + ray.z() * t), height_m - ray.y() * t};
}

std::optional<Vec2> DialView::project(const DialPoint& p) const {
  const Vec3 from_camera(radius_m * std::sin(p.angle_rad), height_m - p.height_m,
                         radius_m * std::cos(p.angle_rad) - pivot_distance_m);
  return camera.project(rotation().transpose() * from_camera);
}

double DialView::pixel_rad() const {
  return std::abs(radius_m - pivot_distance_m) / (radius_m * camera.fx);
}

}  // namespace takt
