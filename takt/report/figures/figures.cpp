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

Figure figure_of(const Panel& panel, const std::vector<std::size_t>& members) {
  Figure f;
  Range x = nothing, y = nothing;
  bool edge_to_edge = true;
  for (const std::size_t i : members) {
    const Series& s = panel.y[i];
    for (Layer& layer : drawing_of(s.kind.empty() ? panel.kind : s.kind)(panel.x, s)) {
      layer.colour = static_cast<int>(i);
      edge_to_edge = edge_to_edge && (layer.shape == Layer::Shape::line || layer.shape == Layer::Shape::band);
      include(x, layer.x);
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
  include_marks(x, panel.marks);
  const Series& first = panel.y[members.front()];
  f.x = make_axis(panel.x.name, panel.x.unit, edge_to_edge ? x : with_margin(x, 0.03));
  f.y = make_axis(members.size() == 1 ? first.name : "", first.unit, with_margin(make_axis("", "", y).range, 0.06));
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
