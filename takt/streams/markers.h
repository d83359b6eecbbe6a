// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt {

/// A dictionary of square markers, by OpenCV's name: "DICT_APRILTAG_36h11", "DICT_6X6_250" …
struct MarkerDictionary {
  int bits = 0;   ///< along a side, without the border
  int count = 0;  ///< of markers
  /// The white bits of a marker, row by row from the top left of the marker as OpenCV draws it.
  std::vector<std::vector<bool>> white;
};

/// Throws std::invalid_argument for a name that OpenCV does not have.
[[nodiscard]] const MarkerDictionary& marker_dictionary(const std::string& name);
/// OpenCV's number of a dictionary.
[[nodiscard]] int dictionary_number(const std::string& name);

}  // namespace takt
