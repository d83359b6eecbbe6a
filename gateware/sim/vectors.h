// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "takt/test_paths.h"

/// Reads gateware/wire_vectors.txt.
namespace takt::sim {

struct Vector {
  std::string type, name;
  std::vector<std::uint64_t> fields;
  std::vector<std::uint8_t> bytes;
};

inline std::vector<Vector> wire_vectors() {
  std::ifstream in(std::string(TAKT_SOURCE_DIR) + "/gateware/wire_vectors.txt");
  std::vector<Vector> out;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Vector v;
    words >> v.type >> v.name;
    for (std::string w; words >> w && w != ":";) v.fields.push_back(std::stoull(w));
    for (std::string w; words >> w;) v.bytes.push_back(static_cast<std::uint8_t>(std::stoul(w, nullptr, 16)));
    out.push_back(v);
  }
  if (out.empty()) throw std::runtime_error("gateware/wire_vectors.txt is missing or empty");
  return out;
}

inline Vector wire_vector(const std::string& type, const std::string& name) {
  for (const Vector& v : wire_vectors())
    if (v.type == type && v.name == name) return v;
  throw std::runtime_error("no vector " + type + " " + name);
}

}  // namespace takt::sim
