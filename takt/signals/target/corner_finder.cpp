// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/corner_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "takt/math/median.h"
#include "takt/signals/target/disc.h"
#include "takt/signals/target/find_grid.h"
#include "takt/signals/target/find_markers.h"
#include "takt/signals/target/follow.h"
#include "takt/signals/target/local_map.h"
#include "takt/signals/target/saddle.h"

namespace takt {

namespace {

constexpr std::size_t fewest_corners = 8;    // less says nothing about which of them are wrong
constexpr double lowest_contrast = 12;       // grey levels between ink and paper
constexpr double largest_sigma_px = 0.3;     // a corner that is less certain is dropped
constexpr double longest_following_s = 0.3;  // after a longer gap the board may be anywhere
constexpr double marker_agreement = 0.35;    // correlation of a marker's bits with the picture, in the mean
constexpr double misfit_px = 0.6;            // from where its neighbours say a corner is

double grey(const GrayImage& image, const Vec2& p) {
  const double x = std::clamp(p.x(), 0.0, image.width - 1.001), y = std::clamp(p.y(), 0.0, image.height - 1.001);
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const double fx = x - ix, fy = y - iy;
  const std::uint8_t *a = image.row(iy) + ix, *b = image.row(iy + 1) + ix;
  return (1 - fy) * (a[0] + fx * (a[1] - a[0])) + fy * (b[0] + fx * (b[1] - b[0]));
}

bool inside(const GrayImage& image, const Vec2& p, double margin) {
  return p.x() >= margin && p.y() >= margin && p.x() <= image.width - 1 - margin && p.y() <= image.height - 1 - margin;
}

/// The half-width in pixels of the square around a corner that holds nothing else.
double reach_px(const LayoutCorner& corner, const Eigen::Matrix2d& slope) {
  const double a = slope.col(0).norm(), b = slope.col(1).norm();
  const double narrow = std::abs(slope.determinant()) / std::max(a, b);  // the height of the squeezed square
  return corner.reach_m * narrow;
}

std::size_t count(const std::vector<std::optional<Vec2>>& pixels) {
  return static_cast<std::size_t>(
      std::count_if(pixels.begin(), pixels.end(), [](const auto& p) { return p.has_value(); }));
}

}  // namespace

std::vector<CornerObservation> CornerFinder::find(const GrayImage& image, double t_s) {
  std::vector<std::optional<Vec2>> pixels;
  const bool fresh = !last_.pixels.empty() && t_s - last_.t_s <= longest_following_s;
  if (fresh && !layout_.discs) pixels = settle(image, nearby(image, t_s));
  if (pixels.empty()) {
    std::vector<Guess> guesses = everywhere(image);
    choose_polarity(image, guesses);
    if (!layout_.discs && !guesses.empty()) snap(find_crossings(image), guesses);
    pixels = settle(image, guesses);
  }
  std::vector<CornerObservation> out;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (pixels[i]) out.push_back({static_cast<std::int32_t>(i), *pixels[i]});
  if (!pixels.empty()) {
    before_ = std::move(last_);
    last_ = {std::move(pixels), t_s};
  }
  return out;
}

std::vector<CornerFinder::Guess> CornerFinder::everywhere(const GrayImage& image) const {
  std::vector<Guess> guesses;
  const std::vector<Vec2> grid = find_grid(image, layout_.target);
  for (std::size_t i = 0; i < grid.size(); ++i) guesses.push_back({static_cast<int>(i), grid[i], 3});
  const std::vector<FoundMarker> found = find_markers(image, layout_.target);
  if (const auto* april = std::get_if<AprilGrid>(&layout_.target)) {
    for (const FoundMarker& m : found) {
      const int tag = m.id - april->first_id;
      if (tag < 0 || tag >= april->columns * april->rows) continue;
      const int row = 2 * (tag / april->columns), column = 2 * (tag % april->columns), stride = 2 * april->columns;
      const std::array<int, 4> corners{row * stride + column, row * stride + column + 1,
                                       (row + 1) * stride + column + 1, (row + 1) * stride + column};
      for (std::size_t k = 0; k < 4; ++k) guesses.push_back({corners[k], m.corners[k], 4});
    }
    return guesses;
  }
  // The markers of a ChArUco board say where its corners are to look for.
  std::vector<PlacedPixel> all;
  for (const FoundMarker& m : found)
    for (const BoardMarker& known : layout_.markers)
      if (known.id == m.id)
        for (std::size_t k = 0; k < 4; ++k) all.push_back({known.corners[k], m.corners[k]});
  for (std::size_t i = 0; i < layout_.corners.size(); ++i)
    if (const auto map = local_map(all, layout_.corners[i].place, 16, 2.5 * layout_.pitch_m))
      if (const auto pixel = (*map)(layout_.corners[i].place)) guesses.push_back({static_cast<int>(i), *pixel, 4});
  return guesses;
}

std::vector<CornerFinder::Guess> CornerFinder::predicted(double t_s) const {
  std::vector<Guess> out;
  const double step = last_.t_s - before_.t_s;
  const bool moving = !before_.pixels.empty() && step > 1e-4 && step < longest_following_s && t_s > last_.t_s;
  const double ahead = moving ? (t_s - last_.t_s) / step : 0;
  // Corners that were seen once move as their neighbours do: as the board's map does.
  std::vector<PlacedPixel> moved;
  for (std::size_t i = 0; i < last_.pixels.size(); ++i)
    if (last_.pixels[i] && ahead > 0 && before_.pixels[i])
      moved.push_back({*last_.pixels[i], *last_.pixels[i] + ahead * (*last_.pixels[i] - *before_.pixels[i])});
  const auto motion = PlaneMap::fit(moved);
  for (std::size_t i = 0; i < last_.pixels.size(); ++i) {
    if (!last_.pixels[i]) continue;
    const auto pixel = motion ? (*motion)(*last_.pixels[i]) : last_.pixels[i];
    if (pixel) out.push_back({static_cast<int>(i), *pixel, 0});
  }
  return out;
}

Crossing CornerFinder::appearance(int corner, const Vec2& pixel, const Eigen::Matrix2d& slope) const {
  // The unit squares' diagonals: black where dx·dy has the corner's sign.
  const double sign = polarity_ * layout_.corners[static_cast<std::size_t>(corner)].sign;
  const Vec2 along = slope.col(0).normalized(), across = slope.col(1).normalized();
  const Vec2 light = along - sign * across;
  return {pixel, std::atan2(light.y(), light.x())};
}

std::vector<CornerFinder::Guess> CornerFinder::nearby(const GrayImage& image, double t_s) const {
  std::vector<Guess> guesses;
  std::vector<Crossing> expected;
  for (const Guess& g : predicted(t_s)) {
    const auto map = map_around(layout_, last_.pixels, g.corner, false);
    if (!map) continue;
    guesses.push_back(g);
    expected.push_back(
        appearance(g.corner, g.pixel, map->slope(layout_.corners[static_cast<std::size_t>(g.corner)].place)));
  }
  const std::vector<std::optional<Vec2>> met = follow(expected, find_crossings(image), image.width, image.height);
  std::vector<Guess> found;
  for (std::size_t i = 0; i < met.size(); ++i)
    if (met[i]) found.push_back({guesses[i].corner, *met[i], 2.5});
  return found;
}

/// Moves guesses to the crossing nearby that looks as the corner should.
void CornerFinder::snap(const std::vector<Crossing>& crossings, std::vector<Guess>& guesses) const {
  std::vector<std::optional<Vec2>> at(layout_.corners.size());
  for (const Guess& g : guesses) at[static_cast<std::size_t>(g.corner)] = g.pixel;
  for (Guess& g : guesses) {
    const auto map = map_around(layout_, at, g.corner, false);
    if (!map) continue;
    const LayoutCorner& known = layout_.corners[static_cast<std::size_t>(g.corner)];
    const Eigen::Matrix2d slope = map->slope(known.place);
    const Crossing wanted = appearance(g.corner, g.pixel, slope);
    double best = std::min(6.0, 0.6 * reach_px(known, slope));
    for (const Crossing& c : crossings)
      if (const double distance = (c.pixel - wanted.pixel).norm(); distance < best && alike(c, wanted)) {
        best = distance;
        g.pixel = c.pixel;
        g.furthest_px = 2.5;
      }
  }
}

std::vector<std::optional<Vec2>> CornerFinder::settle(const GrayImage& image, const std::vector<Guess>& guesses) {
  if (guesses.size() < fewest_corners) return {};
  std::vector<std::optional<Vec2>> at(layout_.corners.size());
  for (std::size_t k = 0; k < guesses.size(); ++k) at[static_cast<std::size_t>(guesses[k].corner)] = guesses[k].pixel;
  std::vector<std::optional<Vec2>> pixels(layout_.corners.size());
  for (const Guess& g : guesses) {
    const auto map = map_around(layout_, at, g.corner, false);
    if (!map) continue;
    const LayoutCorner& known = layout_.corners[static_cast<std::size_t>(g.corner)];
    const Eigen::Matrix2d slope = map->slope(known.place);
    std::optional<Vec2>& pixel = pixels[static_cast<std::size_t>(g.corner)];
    if (!layout_.discs) {
      pixel = refine(image, known, g.pixel, g.furthest_px, slope);
    } else if (const auto disc = refine_disc(image, g.pixel, reach_px(known, slope))) {
      const double radius = std::sqrt(disc->area_px2 / std::numbers::pi / std::abs(slope.determinant()));
      pixel = disc->pixel - map->circle_shift(known.place, radius);
    }
  }
  drop_misfits(pixels);
  if (count(pixels) < fewest_corners || 2 * count(pixels) < guesses.size()) return {};
  if (!layout_.discs) {
    grow(image, pixels);
    drop_misfits(pixels);
  }
  if (!markers_agree(image, pixels) || !edges_agree(image, pixels) || count(pixels) < fewest_corners) return {};
  return pixels;
}

std::optional<Vec2> CornerFinder::refine(const GrayImage& image, const LayoutCorner& known, const Vec2& at,
                                         double furthest_px, const Eigen::Matrix2d& slope) const {
  const double reach = reach_px(known, slope);
  if (reach < 3) return std::nullopt;
  const auto found = refine_saddle(image, at, static_cast<int>(std::clamp(0.9 * reach - 1, 2.0, 7.0)), furthest_px);
  if (!found || found->sigma_px > largest_sigma_px) return std::nullopt;
  if (!is_rightly_coloured(image, known, found->pixel, slope)) return std::nullopt;
  return found->pixel;
}

/// The four quadrants around a corner, along the board's own axes: two black, two white, and the right ones.
bool CornerFinder::is_rightly_coloured(const GrayImage& image, const LayoutCorner& known, const Vec2& at,
                                       const Eigen::Matrix2d& slope) const {
  // Not further than a few pixels: the outermost squares of a print are often cut.
  const double step = known.reach_m * std::min(0.55, 6 / reach_px(known, slope));
  std::array<double, 4> q;
  for (std::size_t k = 0; k < 4; ++k)
    q[k] = grey(image, at + slope * Vec2(k == 0 || k == 3 ? step : -step, k < 2 ? step : -step));
  const double plus = 0.5 * (q[0] + q[2]), minus = 0.5 * (q[1] + q[3]);  // dx·dy > 0, < 0
  const double contrast = polarity_ * known.sign * (minus - plus);
  return contrast > lowest_contrast && std::abs(q[0] - q[2]) < 0.7 * contrast && std::abs(q[1] - q[3]) < 0.7 * contrast;
}

/// A checkerboard may be printed with its colours the other way round; whoever looks alike upside down cannot tell.
void CornerFinder::choose_polarity(const GrayImage& image, const std::vector<Guess>& guesses) {
  const auto* board = std::get_if<Checkerboard>(&layout_.target);
  if (board == nullptr || (board->rows + board->columns) % 2 == 1) return;
  std::vector<std::optional<Vec2>> at(layout_.corners.size());
  for (const Guess& g : guesses) at[static_cast<std::size_t>(g.corner)] = g.pixel;
  int votes = 0;
  for (const Guess& g : guesses)
    if (const auto map = map_around(layout_, at, g.corner, false)) {
      const LayoutCorner& known = layout_.corners[static_cast<std::size_t>(g.corner)];
      const Eigen::Matrix2d slope = map->slope(known.place);
      polarity_ = 1;
      votes += is_rightly_coloured(image, known, g.pixel, slope) ? 1 : 0;
      polarity_ = -1;
      votes -= is_rightly_coloured(image, known, g.pixel, slope) ? 1 : 0;
    }
  polarity_ = votes < 0 ? -1 : 1;
}

/// Corners that were not guessed are looked for where their neighbours say that they are, and become neighbours.
void CornerFinder::grow(const GrayImage& image, std::vector<std::optional<Vec2>>& pixels) const {
  for (int round = 0; round < 6; ++round) {
    std::vector<std::pair<std::size_t, Vec2>> added;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (pixels[i]) continue;
      const auto map = map_around(layout_, pixels, static_cast<int>(i), true);
      const auto expected = map ? (*map)(layout_.corners[i].place) : std::nullopt;
      if (!expected || !inside(image, *expected, 7)) continue;
      const auto found = refine(image, layout_.corners[i], *expected, 2, map->slope(layout_.corners[i].place));
      if (found) added.emplace_back(i, *found);
    }
    for (const auto& [i, pixel] : added) pixels[i] = pixel;
    if (added.empty()) return;
  }
}

/// Corners that are not where their neighbours say: the worst of each neighbourhood first.
void CornerFinder::drop_misfits(std::vector<std::optional<Vec2>>& pixels) const {
  for (int round = 0; round < 4; ++round) {
    std::vector<double> off(pixels.size(), 0);
    std::vector<double> sorted;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!pixels[i]) continue;
      const auto map = map_around(layout_, pixels, static_cast<int>(i), true);
      const auto expected = map ? (*map)(layout_.corners[i].place) : std::nullopt;
      off[i] = expected ? (*expected - *pixels[i]).norm() : 1e9;  // nobody near can vouch for it
      sorted.push_back(off[i]);
    }
    if (sorted.empty()) return;
    const double limit = std::max(misfit_px, 5 * median(std::move(sorted)));
    std::vector<std::size_t> dropped;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!pixels[i] || off[i] <= limit) continue;
      const auto& near = layout_.near[i];
      const bool worst =
          std::all_of(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(near.size(), 12)),
                      [&](int k) { return off[static_cast<std::size_t>(k)] <= off[i]; });
      if (worst) dropped.push_back(i);
    }
    for (const std::size_t i : dropped) pixels[i].reset();
    if (dropped.empty()) return;
  }
}

/// Compares the markers' bits with the picture. A board that was mistaken by a marker's width agrees nowhere.
/// A marker that does not agree is covered, or was never there: its corners go.
bool CornerFinder::markers_agree(const GrayImage& image, std::vector<std::optional<Vec2>>& pixels) const {
  if (layout_.markers.empty()) return true;
  double sum = 0;
  int judged = 0;
  for (const BoardMarker& m : layout_.markers) {
    std::vector<PlacedPixel> all;
    const Vec2 middle = 0.5 * (m.corners[0] + m.corners[2]);
    const double side = m.corners[1].x() - m.corners[0].x();
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (pixels[i] &&
          (layout_.corners[i].place - middle).cwiseAbs().maxCoeff() < 0.75 * std::max(side, layout_.pitch_m))
        all.push_back({layout_.corners[i].place, *pixels[i]});
    const auto map = PlaneMap::fit(all);
    if (!map) continue;
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    bool whole = true;
    // The border looks the same on all.
    for (int r = m.border; r < m.cells - m.border && whole; ++r)
      for (int c = m.border; c < m.cells - m.border; ++c) {
        const auto p = (*map)(m.corners[3] + side / m.cells * Vec2(c + 0.5, -r - 0.5));
        whole = p && inside(image, *p, 0);
        if (!whole) break;
        const double g = grey(image, *p), white = m.black[static_cast<std::size_t>(r * m.cells + c)] ? 0 : 1;
        n += 1, x += g, y += white, xx += g * g, xy += g * white, yy += white * white;
      }
    if (!whole) continue;
    const double spread = (xx - x * x / n) * (yy - y * y / n);
    const double agreement = spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : 0;
    sum += agreement;
    ++judged;
    if (agreement < 0.2 && std::holds_alternative<AprilGrid>(layout_.target))
      for (std::size_t i = 0; i < pixels.size(); ++i)
        if ((layout_.corners[i].place - middle).cwiseAbs().maxCoeff() < 0.51 * side) pixels[i].reset();
  }
  return judged > 0 && sum > marker_agreement * judged;
}

bool CornerFinder::edges_agree(const GrayImage& image, const std::vector<std::optional<Vec2>>& pixels) const {
  const auto* board = std::get_if<Checkerboard>(&layout_.target);
  if (board == nullptr) return true;
  // Each end of the rows and of the columns: how many places beyond it are in the picture, and how many hold a corner.
  const auto ends_there = [&](bool along_rows, bool last) {
    const int length = along_rows ? board->columns : board->rows;
    const int first = !last ? 0 : along_rows ? (board->rows - 1) * board->columns : board->columns - 1;
    const Vec2 outward = (last ? 1 : -1) * (along_rows ? Vec2(board->row_m, 0) : Vec2(0, board->column_m));
    int looked = 0, held = 0;
    for (int k = 0; k < length; ++k) {
      const int i = first + k * (along_rows ? 1 : board->columns);
      if (!pixels[static_cast<std::size_t>(i)]) continue;
      LayoutCorner beyond = layout_.corners[static_cast<std::size_t>(i)];
      beyond.place += outward, beyond.sign = -beyond.sign;
      const auto map = map_around(layout_, pixels, i, false);
      const auto at = map ? (*map)(beyond.place) : std::nullopt;
      if (!at || !inside(image, *at, 14)) continue;
      ++looked;
      held += refine(image, beyond, *at, 6, map->slope(beyond.place)) ? 1 : 0;
    }
    return looked < 2 ? 0 : 3 * held > looked ? -1 : 1;
  };
  const int top = ends_there(true, false), bottom = ends_there(true, true);
  const int left = ends_there(false, false), right = ends_there(false, true);
  return std::min({top, bottom, left, right}) >= 0 && std::max(top, bottom) > 0 && std::max(left, right) > 0;
}

}  // namespace takt
