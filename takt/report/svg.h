// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/report/figure.h"

namespace takt::report {

/// What identifies and describes a figure for those who do not see it.
struct Caption {
  std::string id;  ///< unique in the page
  std::string title;
  std::string description;
};

/// An <svg> as wide as its place. The data are scaled to it, while text keeps its size at any width: the plot is a
/// nested <svg> that stretches, the axes are placed in per cent.
[[nodiscard]] std::string to_svg(const Figure& figure, const Caption& caption);

/// The drawn points and the axes as JSON, for the script's readout and zoom.
[[nodiscard]] std::string to_script_data(const Figure& figure);

}  // namespace takt::report
