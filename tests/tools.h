// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "takt/error.h"
#include "takt/test_paths.h"

/// What the tests of all rooms share.
namespace takt::testing_tools {

/// A folder that lives as long as the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::path(::testing::TempDir()) /
            (std::string("takt_") + test->test_suite_name() + "_" + test->name());
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::string file(const std::string& name, const std::string& content) const {
    const auto path = path_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
    return path.string();
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// What `action` says when it fails with takt::Error, on one line; "" when it does not fail.
template <class Action>
std::string complaint(Action action) {
  try {
    action();
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_FALSE(e.try_this.empty()) << text;
    return text;
  }
  return "";
}

inline bool real_data_is_there(const std::string& folder) {
  return std::filesystem::exists(std::filesystem::path(TAKT_DATA_DIR) / folder);
}
inline std::string real_data(const std::string& path) {
  return (std::filesystem::path(TAKT_DATA_DIR) / path).string();
}

}  // namespace takt::testing_tools

/// Skips with a sentence where the real recordings are not on this machine.
#define TAKT_NEEDS_REAL_DATA(folder)                    \
  if (!takt::testing_tools::real_data_is_there(folder)) \
  GTEST_SKIP() << "the real recording " << folder << " is not in TAKT_DATA_DIR"
