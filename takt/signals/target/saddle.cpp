// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/saddle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace takt {

namespace {

constexpr std::size_t most_saddles = 3000;
constexpr int weakest_response = 200;  // of Ixy² − Ixx·Iyy in grey levels² at a distance of two pixels
constexpr int taps = 8;
constexpr int largest_radius = 9;
constexpr double smoothing_px = 0.8;

/// Weights of the pixels −3 … 4 around a whole one for the smoothed picture at fraction f, and for its slope.
struct Kernel {
  std::array<float, taps> value, slope;
};
Kernel kernel(double f) {
  Kernel k;
  double total = 0;
  std::array<double, taps> w;
  for (int j = 0; j < taps; ++j) {
    const double at = j - 3 - f;
    w[static_cast<std::size_t>(j)] = std::exp(-0.5 * at * at / (smoothing_px * smoothing_px));
    total += w[static_cast<std::size_t>(j)];
  }
  for (int j = 0; j < taps; ++j) {
    const auto i = static_cast<std::size_t>(j);
    k.value[i] = static_cast<float>(w[i] / total);
    k.slope[i] = static_cast<float>(w[i] / total * (j - 3 - f) / (smoothing_px * smoothing_px));
  }
  return k;
}

/// The smoothed picture and its slopes on a square grid about a point.
class Patch {
 public:
  Patch(const GrayImage& image, const Vec2& centre, int radius) : side_(2 * radius + 1) {
    const int x = static_cast<int>(std::floor(centre.x())), y = static_cast<int>(std::floor(centre.y()));
    const Kernel kx = kernel(centre.x() - x), ky = kernel(centre.y() - y);
    const int rows = side_ + taps - 1;
    std::array<float, most_side + taps> line{};
    for (int r = 0; r < rows; ++r) {
      const std::uint8_t* pixels = image.row(y - radius - 3 + r) + (x - radius - 3);
      for (int i = 0; i < rows; ++i) line[static_cast<std::size_t>(i)] = static_cast<float>(pixels[i]);
      float* smooth = along_.data() + r * most_side;
      float* slope = along_slope_.data() + r * most_side;
      for (int i = 0; i < side_; ++i) {
        float v = 0, s = 0;
        for (std::size_t j = 0; j < taps; ++j) {
          v += kx.value[j] * line[static_cast<std::size_t>(i) + j];
          s += kx.slope[j] * line[static_cast<std::size_t>(i) + j];
        }
        smooth[i] = v, slope[i] = s;
      }
    }
    for (int r = 0; r < side_; ++r) {
      float *v = value_.data() + r * most_side, *gx = gx_.data() + r * most_side, *gy = gy_.data() + r * most_side;
      for (int i = 0; i < side_; ++i) v[i] = gx[i] = gy[i] = 0;
      for (int j = 0; j < taps; ++j) {
        const float* smooth = along_.data() + (r + j) * most_side;
        const float* slope = along_slope_.data() + (r + j) * most_side;
        const float wv = ky.value[static_cast<std::size_t>(j)], ws = ky.slope[static_cast<std::size_t>(j)];
        for (int i = 0; i < side_; ++i) {
          v[i] += wv * smooth[i];
          gx[i] += wv * slope[i];
          gy[i] += ws * smooth[i];
        }
      }
    }
  }
  [[nodiscard]] const float* value(int row) const { return value_.data() + row * most_side; }
  [[nodiscard]] const float* gx(int row) const { return gx_.data() + row * most_side; }
  [[nodiscard]] const float* gy(int row) const { return gy_.data() + row * most_side; }

 private:
  static constexpr int most_side = 2 * largest_radius + 1;
  int side_;
  std::array<float, most_side*(most_side + taps)> along_, along_slope_;
  std::array<float, most_side * most_side> value_, gx_, gy_;
};

/// The normal equations of the half-turn's residuals.
struct Symmetry {
  double xx = 0, xy = 0, yy = 0, bx = 0, by = 0, square = 0;
  int pairs = 0;
};
Symmetry symmetry(const Patch& p, int radius) {
  Symmetry s;
  const int side = 2 * radius + 1, last = side - 1;
  float xx = 0, xy = 0, yy = 0, bx = 0, by = 0, square = 0;
  for (int r = 0; r <= radius; ++r) {
    const float *v = p.value(r), *gx = p.gx(r), *gy = p.gy(r);
    const float *w = p.value(last - r), *hx = p.gx(last - r), *hy = p.gy(last - r);
    const int end = r == radius ? radius : side;  // half the plane: each pair once
    for (int i = 0; i < end; ++i) {
      const float e = v[i] - w[last - i], jx = gx[i] - hx[last - i], jy = gy[i] - hy[last - i];
      xx += jx * jx, xy += jx * jy, yy += jy * jy;
      bx += jx * e, by += jy * e, square += e * e;
    }
    s.pairs += end;
  }
  s.xx = xx, s.xy = xy, s.yy = yy, s.bx = bx, s.by = by, s.square = square;
  return s;
}

}  // namespace

std::optional<Saddle> refine_saddle(const GrayImage& image, const Vec2& start, int radius, double furthest_px) {
  radius = std::clamp(radius, 2, largest_radius);
  const int margin = radius + 5;
  Vec2 c = start;
  for (int round = 0; round < 12; ++round) {
    if (!(c.x() >= margin && c.y() >= margin && c.x() < image.width - margin && c.y() < image.height - margin))
      return std::nullopt;
    const Symmetry s = symmetry(Patch(image, c, radius), radius);
    const double det = s.xx * s.yy - s.xy * s.xy, trace = s.xx + s.yy;
    if (!(det > 1e-3 * trace * trace) || !(trace > 1)) return std::nullopt;
    const Vec2 step(-(s.yy * s.bx - s.xy * s.by) / det, -(s.xx * s.by - s.xy * s.bx) / det);
    const double length = step.norm();
    c += length > 1 ? Vec2(step / length) : step;
    if ((c - start).norm() > furthest_px) return std::nullopt;
    if (length > 0.004) continue;
    // Neighbouring residuals share the smoothing's noise: about 8 pixels each.
    const double variance = 8 * s.square / s.pairs;
    const double smallest = 0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4 * det)));
    return Saddle{c, std::sqrt(variance / smallest)};
  }
  return std::nullopt;
}

std::vector<Crossing> find_crossings(const GrayImage& image) {
  const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels),
                       static_cast<std::size_t>(image.stride));
  cv::Mat1b smooth;
  cv::GaussianBlur(view, smooth, {5, 5}, 1.1);
  const int width = image.width, height = image.height;
  constexpr int edge = 4;
  if (width < 3 * edge || height < 3 * edge) return {};
  cv::Mat1i response(height, width, 0);
  for (int y = edge; y < height - edge; ++y) {
    const std::uint8_t *above = smooth[y - 2], *here = smooth[y], *below = smooth[y + 2];
    int* out = response[y];
    for (int x = edge; x < width - edge; ++x) {
      const int xx = here[x + 2] - 2 * here[x] + here[x - 2];
      const int yy = below[x] - 2 * here[x] + above[x];
      const int xy = (below[x + 2] - below[x - 2] - above[x + 2] + above[x - 2]) / 4;
      out[x] = xy * xy - xx * yy;
    }
  }
  struct Peak {
    int response, x, y;
  };
  std::vector<Peak> peaks;
  for (int y = edge + 2; y < height - edge - 2; ++y)
    for (int x = edge + 2; x < width - edge - 2; ++x) {
      const int r = response[y][x];
      if (r < weakest_response) continue;
      bool highest = true;
      for (int dy = -2; dy <= 2 && highest; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const int other = response[y + dy][x + dx];
          if (other > r || (other == r && (dy < 0 || (dy == 0 && dx < 0)))) {
            highest = false;
            break;
          }
        }
      if (highest) peaks.push_back({r, x, y});
    }
  std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) {
    return std::tuple(-a.response, a.y, a.x) < std::tuple(-b.response, b.y, b.x);
  });
  if (peaks.size() > most_saddles) peaks.resize(most_saddles);
  std::vector<Crossing> out;
  for (const Peak& p : peaks) {
    const std::uint8_t *above = smooth[p.y - 2] + p.x, *here = smooth[p.y] + p.x, *below = smooth[p.y + 2] + p.x;
    const double xx = here[2] - 2 * here[0] + here[-2], yy = below[0] - 2 * here[0] + above[0];
    const double xy = (below[2] - below[-2] - above[2] + above[-2]) / 4.0;
    out.push_back({Vec2(p.x, p.y), 0.5 * std::atan2(2 * xy, xx - yy)});  // where the brightness curves up
  }
  return out;
}

}  // namespace takt
