// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/rectifier.h"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace takt::dial {
namespace {

constexpr int fewest_pixels = 4;
constexpr std::uint8_t saturated = 252;

/// The strip that holds a height; −1 for none.
int strip_of(const std::vector<Strip>& strips, double height) {
  for (std::size_t k = 0; k < strips.size(); ++k)
    if (height < strips[k].top_m && height > strips[k].bottom_m) return static_cast<int>(k);
  return -1;
}

struct Seen {
  int x, y, strip;
  DialPoint point;
};

std::vector<Seen> pixels_on_dial(const std::vector<Strip>& strips, const DialView& view) {
  std::vector<Seen> seen;
  for (int y = 0; y < view.camera.height; ++y)
    for (int x = 0; x < view.camera.width; ++x)
      if (const auto point = view.at(Vec2(x, y)))
        if (const int strip = strip_of(strips, point->height_m); strip >= 0) seen.push_back({x, y, strip, *point});
  return seen;
}

}  // namespace

Rectifier::Rectifier(const std::vector<Strip>& strips, const DialView& view, bool rows)
    : width_(view.camera.width), height_(view.camera.height), rows_(rows) {
  const std::vector<Seen> seen = pixels_on_dial(strips, view);
  if (seen.size() < 1000)
    throw std::invalid_argument(fmt::format(
        "dial: only {} pixels see the dial: check the dial's height, its distance and the camera's roll", seen.size()));
  const double c = std::cos(view.roll_rad), s = std::sin(view.roll_rad);
  std::map<std::pair<int, int>, int> slot_at;
  for (const Seen& p : seen) {
    const int along = static_cast<int>(std::lround((p.x - view.camera.cx) * c + (p.y - view.camera.cy) * s));
    const auto [found, is_new] = slot_at.try_emplace({p.strip, along}, static_cast<int>(slots_.size()));
    if (is_new) slots_.push_back({0, 0, 0, 0, p.strip});
    Slot& slot = slots_[static_cast<std::size_t>(found->second)];
    slot.angle_rad += p.point.angle_rad;
    slot.height_m += p.point.height_m;
    slot.row += p.y;
    ++slot.pixels;
    pixels_.push_back({p.x, p.y, found->second});
  }
  // Few pixels: out, and the rest move up.
  std::vector<int> place(slots_.size(), -1);
  std::vector<Slot> kept;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot slot = slots_[i];
    if (slot.pixels < fewest_pixels) continue;
    slot.angle_rad /= slot.pixels;
    slot.height_m /= slot.pixels;
    slot.row /= slot.pixels;
    place[i] = static_cast<int>(kept.size());
    kept.push_back(slot);
  }
  slots_ = std::move(kept);
  for (Pixel& p : pixels_) p.slot = place[static_cast<std::size_t>(p.slot)];
  std::erase_if(pixels_, [](const Pixel& p) { return p.slot < 0; });
}

Profile Rectifier::operator()(const GrayImage& image) const {
  if (image.width != width_ || image.height != height_)
    throw std::invalid_argument(fmt::format("dial: a picture of {}x{} pixels, but the view is for {}x{}", image.width,
                                            image.height, width_, height_));
  std::vector<std::uint32_t> sum(slots_.size(), 0);
  std::vector<std::uint64_t> by_row(rows_ ? slots_.size() : 0, 0);
  std::size_t bright = 0;
  for (const Pixel& p : pixels_) {
    const std::uint8_t grey = image.row(p.y)[p.x];
    sum[static_cast<std::size_t>(p.slot)] += grey;
    if (rows_)
      by_row[static_cast<std::size_t>(p.slot)] += static_cast<std::uint64_t>(grey) * static_cast<std::uint64_t>(p.y);
    bright += grey >= saturated;
  }
  Profile out;
  out.saturated_share = static_cast<float>(bright) / static_cast<float>(pixels_.size());
  out.grey.reserve(slots_.size());
  for (std::size_t i = 0; i < slots_.size(); ++i)
    out.grey.push_back(static_cast<float>(sum[i]) / static_cast<float>(slots_[i].pixels));
  out.tilt.reserve(by_row.size());
  for (std::size_t i = 0; i < by_row.size(); ++i)
    out.tilt.push_back(
        static_cast<float>((static_cast<double>(by_row[i]) - slots_[i].row * sum[i]) / slots_[i].pixels));
  return out;
}

}  // namespace takt::dial
