// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/find_markers.h"

#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>

#include "takt/streams/markers.h"

namespace takt {

// The only place that knows the interface of OpenCV before 4.7 to its marker detector.
std::vector<FoundMarker> find_markers(const GrayImage& image, const Target& target) {
  const auto* grid = std::get_if<AprilGrid>(&target);
  const auto* charuco = std::get_if<Charuco>(&target);
  if (grid == nullptr && charuco == nullptr) return {};
  const auto dictionary = cv::aruco::getPredefinedDictionary(
      dictionary_number(grid != nullptr ? "DICT_APRILTAG_36h11" : charuco->dictionary));
  const auto settings = cv::aruco::DetectorParameters::create();
  settings->markerBorderBits = grid != nullptr ? grid->border_cells : 1;
  settings->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  settings->adaptiveThreshWinSizeMin = 5;
  settings->adaptiveThreshWinSizeStep = 12;
  settings->adaptiveThreshWinSizeMax = 29;
  settings->minMarkerPerimeterRate = 0.02;
  const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels),
                       static_cast<std::size_t>(image.stride));
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(view, dictionary, corners, ids, settings);

  // ArUco counts from the upper left, clockwise; AprilGrids carry their tags upside down.
  const std::array<std::size_t, 4> order =
      grid != nullptr ? std::array<std::size_t, 4>{1, 0, 3, 2} : std::array<std::size_t, 4>{3, 2, 1, 0};
  std::vector<FoundMarker> found;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    FoundMarker marker;
    marker.id = ids[i];
    for (std::size_t k = 0; k < 4; ++k) {
      const cv::Point2f& p = corners[i][order[k]];
      marker.corners[k] = Vec2(p.x, p.y);
    }
    found.push_back(marker);
  }
  return found;
}

}  // namespace takt
