// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt {

/// A named series with its unit: plain numbers, no drawing.
struct Series {
  std::string name;
  std::string unit;
  std::vector<double> values;
  std::vector<double> sigma;  ///< empty, or one a value
  std::string kind{};         ///< drawn otherwise than its panel: the answer's band among points
};

/// A value on the x axis that matters, e.g. the chosen offset.
struct Mark {
  std::string label;
  double x = 0;
};

/// What one plot shows. `kind` picks its figure ("lines", "points", "stems"); a kind that the report does not know is
/// drawn as lines, so a new estimator has its plots without the report knowing it.
struct Panel {
  std::string name;  ///< stable key: "correlation"
  std::string kind;
  std::string title;
  std::string caption;  ///< a sentence that says what to look for
  Series x;
  std::vector<Series> y;
  std::vector<Mark> marks;
};

/// Why a result may be believed: panels for the eye.
struct Evidence {
  std::vector<Panel> panels;
};

}  // namespace takt
