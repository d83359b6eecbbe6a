// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/markers.h"

#include <array>
#include <map>
#include <mutex>
#include <opencv2/aruco/dictionary.hpp>
#include <stdexcept>
#include <utility>

namespace takt {

namespace {

constexpr std::array<std::pair<const char*, int>, 21> names{{
    {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
    {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
    {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
    {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
    {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
    {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
    {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
    {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
    {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
    {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
    {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
    {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
    {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
    {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
    {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
    {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
    {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

MarkerDictionary read(int number) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(number);
  MarkerDictionary out;
  out.bits = dictionary->markerSize;
  out.count = dictionary->bytesList.rows;
  for (int id = 0; id < out.count; ++id) {
    const cv::Mat bits =
        cv::aruco::Dictionary::getBitsFromByteList(dictionary->bytesList.rowRange(id, id + 1), out.bits);
    std::vector<bool>& white = out.white.emplace_back();
    for (int r = 0; r < out.bits; ++r)
      for (int c = 0; c < out.bits; ++c) white.push_back(bits.at<unsigned char>(r, c) != 0);
  }
  return out;
}

}  // namespace

int dictionary_number(const std::string& name) {
  std::string known;
  for (const auto& [known_name, number] : names) {
    if (name == known_name) return number;
    known += (known.empty() ? "" : ", ") + std::string(known_name);
  }
  throw std::invalid_argument("no dictionary '" + name + "'; there are " + known);
}

const MarkerDictionary& marker_dictionary(const std::string& name) {
  static std::mutex guard;
  static std::map<int, MarkerDictionary> read_already;
  const int number = dictionary_number(name);
  const std::lock_guard lock(guard);
  const auto place = read_already.find(number);
  return place != read_already.end() ? place->second : read_already.emplace(number, read(number)).first->second;
}

}  // namespace takt
