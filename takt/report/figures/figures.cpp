// SPDX-License-Identifier: Apache-2.0
#include "takt/report/figures/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace takt::report {

namespace {

using Draw = std::vector<Layer> (*)(const Series& x, const Series& y);
struct Row {
  const char* kind;
  Draw draw;
};
constexpr std::array<Row, 4> kinds{{{"lines", lines}, {"points", points}, {"stems", stems}, {"histogram", histogram}}};

/// A kind that is not in the table is drawn as lines.
Draw drawing_of(const std::string& kind) {
  const auto row = std::find_if(kinds.begin(), kinds.end(), [&](const Row& r) { return kind == r.kind; });
  return row == kinds.end() ? lines : row->draw;
}

constexpr Range nothing{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

void include(Range& range, const std::vector<double>& values) {
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    range.low = std::min(range.low, v);
    range.high = std::max(range.high, v);
  }
}

Range with_margin(Range r, double share) {
  return {r.low - share * r.width(), r.high + share * r.width()};
}

/// Marks widen the x axis, but never so far that the data shrink to less than half.
void include_marks(Range& range, const std::vector<Mark>& marks) {
  const Range limit = with_margin(range, 0.5);
  for (const Mark& m : marks)
    if (m.x > limit.low && m.x < limit.high) include(range, {m.x});
}

bool reaches_the_edges(const std::string& kind) {
  return drawing_of(kind) == lines;
}

/// Lines run from edge to edge; dots and columns keep a little distance.
Axis x_axis(const Panel& panel) {
  Range range = nothing;
  include(range, panel.x.values);
  include_marks(range, panel.marks);
  const bool tight = std::all_of(panel.y.begin(), panel.y.end(), [&](const Series& s) {
    return reaches_the_edges(s.kind.empty() ? panel.kind : s.kind);
  });
  return make_axis(panel.x.name, panel.x.unit, tight ? range : with_margin(range, 0.03));
}

Figure figure_of(const Panel& panel, const std::vector<std::size_t>& members) {
  Figure f;
  Range y = nothing;
  for (const std::size_t i : members) {
    const Series& s = panel.y[i];
    for (Layer& layer : drawing_of(s.kind.empty() ? panel.kind : s.kind)(panel.x, s)) {
      layer.colour = static_cast<int>(i);
      for (const auto* values : {&layer.y, &layer.low, &layer.high}) include(y, *values);
      f.layers.push_back(std::move(layer));
    }
  }
  // Bands behind everything, dots in front.
  const auto depth = [](const Layer& l) {
    return l.shape == Layer::Shape::band ? 0 : l.shape == Layer::Shape::dots ? 2 : 1;
  };
  std::stable_sort(f.layers.begin(), f.layers.end(),
                   [&](const Layer& a, const Layer& b) { return depth(a) < depth(b); });
  const Series& first = panel.y[members.front()];
  f.x = x_axis(panel);
  f.y = make_axis("", first.unit, with_margin(make_axis("", "", y).range, 0.06));
  f.marks = panel.marks;
  return f;
}

}  // namespace

std::vector<Figure> figures_of(const Panel& panel) {
  std::vector<Figure> figures;
  std::vector<std::string> done;
  for (const Series& s : panel.y) {
    if (std::find(done.begin(), done.end(), s.unit) != done.end()) continue;
    done.push_back(s.unit);
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < panel.y.size(); ++i)
      if (panel.y[i].unit == s.unit) members.push_back(i);
    figures.push_back(figure_of(panel, members));
  }
  return figures;
}

}  // namespace takt::report
