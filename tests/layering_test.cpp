// SPDX-License-Identifier: Apache-2.0
// Dependencies run one way: an include that runs upward or sideways fails here, with file and line.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "takt/test_paths.h"

namespace fs = std::filesystem;

namespace {

/// What each room may include, itself aside. Headers right under takt/ (error.h, version.h) are free to all.
const std::map<std::string, std::set<std::string>> may_include{
    {"takt/time", {}},
    {"takt/math", {}},
    {"takt/motion", {"takt/time", "takt/math"}},
    {"takt/streams", {"takt/time", "takt/math", "takt/motion"}},
    {"takt/calibration", {"takt/time", "takt/math", "takt/motion"}},
    {"takt/recording", {"takt/time", "takt/math", "takt/motion", "takt/streams"}},
    {"takt/signals", {"takt/time", "takt/math", "takt/motion", "takt/streams"}},
    {"takt/estimators", {"takt/time", "takt/math", "takt/motion", "takt/streams", "takt/calibration"}},
    {"takt/simulation", {"takt/time", "takt/math", "takt/motion", "takt/streams", "takt/calibration"}},
    {"takt/apply", {"takt/time", "takt/math", "takt/motion", "takt/streams", "takt/calibration"}},
    {"takt/report", {"takt/time", "takt/math", "takt/calibration"}},
    {"takt/workflows",
     {"takt/time", "takt/math", "takt/motion", "takt/streams", "takt/calibration", "takt/recording", "takt/signals",
      "takt/estimators", "takt/simulation", "takt/apply", "takt/report"}},
    {"cli", {"takt/time", "takt/calibration", "takt/workflows", "takt/streams"}},
};

/// takt/motion/spline.h -> takt/motion; cli/align.cpp -> cli; takt/error.h -> "".
std::string room_of(const std::string& path) {
  const auto first = path.find('/');
  if (first == std::string::npos) return "";
  if (path.substr(0, first) != "takt") return path.substr(0, first);
  const auto second = path.find('/', first + 1);
  return second == std::string::npos ? "" : path.substr(0, second);
}

std::vector<std::string> violations(const fs::path& root) {
  std::vector<std::string> found;
  const std::regex include("^\\s*#include \"([^\"]+)\"");
  for (const char* top : {"takt", "cli"})
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string ext = entry.path().extension();
      if (ext != ".h" && ext != ".cpp") continue;
      const std::string file = fs::relative(entry.path(), root).generic_string();
      if (file.ends_with("_test.cpp") || file.ends_with("_fuzz.cpp"))
        continue;  // tests may look further: a simulator's truth, say
      const std::string room = room_of(file);
      if (room.empty()) continue;
      if (!may_include.contains(room)) {
        found.push_back(file + ": the room " + room + " has no row in may_include");
        continue;
      }
      std::ifstream in(entry.path());
      std::string line;
      for (int n = 1; std::getline(in, line); ++n) {
        std::smatch m;
        if (!std::regex_search(line, m, include)) continue;
        const std::string target = room_of(m[1]);
        if (target.empty() || target == room || may_include.at(room).contains(target)) continue;
        found.push_back(file + ":" + std::to_string(n) + ": " + room + " must not include " + target);
      }
    }
  return found;
}

TEST(Layering, DependenciesRunOneWay) {
  for (const std::string& v : violations(TAKT_SOURCE_DIR)) ADD_FAILURE() << v;
}

TEST(Layering, AnUpwardIncludeIsFound) {
  const fs::path root = fs::path(testing::TempDir()) / "layering";
  fs::create_directories(root / "takt/time");
  fs::create_directories(root / "cli");
  std::ofstream(root / "takt/time/a.h") << "#include \"takt/motion/rotation.h\"\n";
  EXPECT_EQ(violations(root).size(), 1u);
  fs::remove_all(root);
}

TEST(Layering, EveryFileSaysItsLicence) {
  for (const char* top : {"takt", "cli", "tests", "bench"}) {
    const fs::path room = fs::path(TAKT_SOURCE_DIR) / top;
    if (!fs::exists(room)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(room)) {
      const std::string ext = entry.path().extension();
      if (ext != ".h" && ext != ".cpp") continue;
      std::ifstream in(entry.path());
      std::string line;
      std::getline(in, line);
      EXPECT_EQ(line, "// SPDX-License-Identifier: Apache-2.0") << entry.path();
    }
  }
}

}  // namespace
