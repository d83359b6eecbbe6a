// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt::report {

struct Range {
  double low = 0;
  double high = 1;
  [[nodiscard]] double width() const { return high - low; }
};

struct Tick {
  double at;  ///< in the data's unit
  std::string label;
};

/// How data become positions and labels: shown = (value − base) · factor, in `unit`.
struct Axis {
  std::string name;
  std::string unit;  ///< as shown: "ms" for seconds in a narrow range
  double base = 0;   ///< taken off where all values share their leading digits, in the data's unit
  std::string base_unit;
  double factor = 1;
  Range range;  ///< in the data's unit

  [[nodiscard]] double shown(double value) const { return (value - base) * factor; }
  /// 0 … 1 along the axis.
  [[nodiscard]] double position(double value) const { return (value - range.low) / range.width(); }
  [[nodiscard]] std::vector<Tick> ticks(int about) const;
  /// "offset − 947848.6 s, ms"
  [[nodiscard]] std::string label() const;
};

/// Chooses the shown unit and base for the range. An empty or infinite range becomes one that can be drawn.
[[nodiscard]] Axis make_axis(const std::string& name, const std::string& unit, Range range);

/// 1, 2 or 5 times a power of ten, so that `range` has about `about` steps.
[[nodiscard]] double nice_step(double width, int about);

}  // namespace takt::report
