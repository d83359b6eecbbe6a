// SPDX-License-Identifier: Apache-2.0
#include "takt/report/svg.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/report/decimate.h"
#include "takt/report/html.h"

namespace takt::report {

namespace {

using Shape = Layer::Shape;

/// The plot's own units, whatever its size on the screen; fine enough to zoom in a hundredfold.
constexpr double extent = 100'000;
/// Runs of points a line keeps: one a pixel of a wide page.
constexpr std::size_t buckets = 1000;

constexpr int plot_height = 210, below_plot = 40;

struct Scale {
  const Figure& f;
  [[nodiscard]] long x(double v) const { return std::lround(extent * f.x.position(v)); }
  [[nodiscard]] long y(double v) const { return std::lround(extent * (1 - f.y.position(v))); }
};

std::vector<std::size_t> drawn(const Layer& l) {
  return l.low.empty() ? decimate(l.y, l.y, buckets) : decimate(l.low, l.high, buckets);
}

std::string line_path(const Layer& l, const Scale& to) {
  std::string d;
  bool pen_down = false;
  long last_x = 0, last_y = 0;
  for (const std::size_t i : drawn(l)) {
    if (!std::isfinite(l.x[i]) || !std::isfinite(l.y[i])) {
      pen_down = false;
      continue;
    }
    const long x = to.x(l.x[i]), y = to.y(l.y[i]);
    d += pen_down ? fmt::format("l{} {}", x - last_x, y - last_y) : fmt::format("M{} {}", x, y);
    pen_down = true;
    last_x = x;
    last_y = y;
  }
  return d;
}

/// A dot is a stroke of no length with round ends, so it stays round however the plot is stretched.
std::string dots_path(const Layer& l, const Scale& to) {
  std::string d;
  for (const std::size_t i : drawn(l))
    if (std::isfinite(l.x[i]) && std::isfinite(l.y[i])) d += fmt::format("M{} {}h0", to.x(l.x[i]), to.y(l.y[i]));
  return d;
}

bool has_extent(const Layer& l, std::size_t i) {
  return std::isfinite(l.x[i]) && std::isfinite(l.low[i]) && std::isfinite(l.high[i]);
}

std::string segments_path(const Layer& l, const Scale& to) {
  std::string d;
  for (const std::size_t i : drawn(l))
    if (has_extent(l, i)) d += fmt::format("M{} {}V{}", to.x(l.x[i]), to.y(l.low[i]), to.y(l.high[i]));
  return d;
}

std::string band_path(const Layer& l, const Scale& to) {
  std::string d, back;
  const auto close = [&] {
    if (!d.empty() && !d.ends_with('Z')) d += back + "Z";
    back.clear();
  };
  for (const std::size_t i : drawn(l)) {
    if (!has_extent(l, i)) {
      close();
      continue;
    }
    d += fmt::format("{}{} {}", back.empty() ? 'M' : 'L', to.x(l.x[i]), to.y(l.high[i]));
    back = fmt::format("L{} {}", to.x(l.x[i]), to.y(l.low[i])) + back;
  }
  close();
  return d;
}

double column_half_width(const Layer& l) {
  double narrowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < l.x.size(); ++i)
    if (const double gap = std::abs(l.x[i] - l.x[i - 1]); gap > 0) narrowest = std::min(narrowest, gap);
  return std::isfinite(narrowest) ? 0.45 * narrowest : 0.5;
}

std::string columns_path(const Layer& l, const Scale& to) {
  std::string d;
  const double half = column_half_width(l);
  for (std::size_t i = 0; i < l.x.size(); ++i)
    if (has_extent(l, i))
      d += fmt::format("M{} {}V{}H{}V{}Z", to.x(l.x[i] - half), to.y(l.low[i]), to.y(l.high[i]), to.x(l.x[i] + half),
                       to.y(l.low[i]));
  return d;
}

std::string path_of(const Layer& l, const Scale& to) {
  switch (l.shape) {
    case Shape::line:
      return line_path(l, to);
    case Shape::dots:
      return dots_path(l, to);
    case Shape::segments:
      return segments_path(l, to);
    case Shape::band:
      return band_path(l, to);
    case Shape::columns:
      break;
  }
  return columns_path(l, to);
}

/// Bold dots hide one another when they are many.
const char* class_of(const Layer& l) {
  switch (l.shape) {
    case Shape::line:
      return "line";
    case Shape::dots:
      return l.x.size() > 400 ? "dots fine" : l.x.size() > 100 ? "dots small" : "dots";
    case Shape::segments:
      return l.x.size() > 400 ? "segments fine" : "segments";
    case Shape::band:
      return "band";
    case Shape::columns:
      break;
  }
  return "columns";
}

std::size_t characters(const std::string& s) {
  return static_cast<std::size_t>(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string percent(double share) {
  return fmt::format("{:.3f}%", 100 * share);
}

std::string grid(const Figure& f, const std::vector<Tick>& x_ticks, const std::vector<Tick>& y_ticks) {
  std::string out = "<g class=\"grid\">";
  for (const Tick& t : y_ticks) {
    const std::string y = percent(1 - f.y.position(t.at));
    out += fmt::format(R"(<line x1="0" x2="100%" y1="{0}" y2="{0}"/><text class="y" x="-8" y="{0}">{1}</text>)", y,
                       t.label);
  }
  for (std::size_t i = 0; i < x_ticks.size(); ++i) {
    const std::string x = percent(f.x.position(x_ticks[i].at));
    // Narrow pages leave out every other label.
    out += fmt::format(
        R"(<line class="upright" x1="{0}" x2="{0}" y1="0" y2="100%"/><text class="x{1}" x="{0}" y="100%">{2}</text>)",
        x, i % 2 == 1 ? " other" : "", x_ticks[i].label);
  }
  return out + "</g>";
}

std::string marks(const Figure& f) {
  std::string out = "<g class=\"marks\">";
  const bool labelled = f.marks.size() <= 6;
  int row = 0;
  for (const Mark& m : f.marks) {
    const double at = f.x.position(m.x);
    if (!(at >= 0 && at <= 1)) continue;
    out += fmt::format(R"(<line data-at="{1:.6f}" x1="{0}" x2="{0}" y1="0" y2="100%"/>)", percent(at), at);
    if (labelled)
      out += fmt::format(R"(<text data-at="{:.6f}" class="{}" x="{}" y="{}">{}</text>)", at,
                         at > 0.6 ? "left" : "right", percent(at), 13 + 15 * (row++ % 4), escape(m.label));
  }
  return out + "</g>";
}

}  // namespace

std::string to_svg(const Figure& f, const Caption& caption) {
  const Scale to{f};
  const auto x_ticks = f.x.ticks(9), y_ticks = f.y.ticks(5);
  std::size_t widest = 1;
  for (const Tick& t : y_ticks) widest = std::max(widest, characters(t.label));
  const int plot_top = f.y.unit.empty() ? 8 : 24;  // the unit stands above the axis
  const std::size_t left = 14 + 7 * widest;
  const std::string place = fmt::format(R"(y="{}" width="100%" height="{}")", plot_top, plot_height);

  std::string out = fmt::format(
      R"(<svg class="chart" role="img" aria-labelledby="{0}-t {0}-d" height="{1}" style="--left:{2}px">)"
      R"(<title id="{0}-t">{3}</title><desc id="{0}-d">{4}</desc><text class="y-name" x="-{2}" y="12">{5}</text>)",
      caption.id, plot_top + plot_height + below_plot, left, escape(caption.title), escape(caption.description),
      escape(f.y.label()));
  out += fmt::format(R"(<svg class="frame" {}>{}</svg>)", place, grid(f, x_ticks, y_ticks));
  out += fmt::format(R"(<svg class="plot" {0} viewBox="0 0 {1} {1}" preserveAspectRatio="none">)", place, extent);
  for (const Layer& l : f.layers)
    out += fmt::format(R"(<path class="{} c{}" data-series="{}" d="{}"/>)", class_of(l), l.colour % 6, escape(l.series),
                       path_of(l, to));
  out += fmt::format(R"(</svg><svg class="frame over" {}>{}</svg>)", place, marks(f));
  return out + fmt::format(R"(<text class="x-name" x="100%" y="{}">{}</text></svg>)",
                           plot_top + plot_height + below_plot - 5, escape(f.x.label()));
}

namespace {

/// In the units that the axis shows.
std::string script_numbers(const Axis& axis, const std::vector<double>& values, const std::vector<std::size_t>& which) {
  std::string out = "[";
  for (const std::size_t i : which) out += (out.size() > 1 ? "," : "") + script_number(axis.shown(values[i]), 7);
  return out + "]";
}

std::string script_axis(const Axis& a) {
  return fmt::format(R"({{"low":{},"high":{},"name":{},"unit":{}}})", script_number(a.shown(a.range.low), 17),
                     script_number(a.shown(a.range.high), 17), script_string(a.name), script_string(a.unit));
}

std::string script_series(const Figure& f, const Layer& l) {
  const auto which = drawn(l);
  std::string sigma;
  for (const std::size_t i : which)
    if (!l.sigma.empty()) sigma += (sigma.empty() ? "" : ",") + script_number(l.sigma[i] * f.y.factor, 3);
  return fmt::format(R"({{"name":{},"colour":{},"x":{},"y":{},"sigma":[{}]}})", script_string(l.series), l.colour % 6,
                     script_numbers(f.x, l.x, which),
                     script_numbers(f.y, l.shape == Shape::columns ? l.high : l.y, which), sigma);
}

}  // namespace

std::string to_script_data(const Figure& f) {
  std::string series;
  for (const Layer& l : f.layers) {
    // Bands and bars belong to a line or to dots, which have the values.
    if (l.shape == Shape::band || l.shape == Shape::segments) continue;
    series += (series.empty() ? "" : ",") + script_series(f, l);
  }
  return fmt::format(R"({{"x":{},"y":{},"extent":{},"series":[{}]}})", script_axis(f.x), script_axis(f.y), extent,
                     series);
}

}  // namespace takt::report
