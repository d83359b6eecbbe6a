// SPDX-License-Identifier: Apache-2.0
// takt simulate and takt convert, killed and interrupted at any moment: under the final name there is all or nothing.
// takt apply's own such test is in apply_test.cpp; bench/kills.py does it a hundred times on large files.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include "cli/command_for_tests.h"
#include "tests/tools.h"

namespace takt::cli {
namespace {

namespace fs = std::filesystem;
using testing_tools::TemporaryFolder;

/// Every file with its size; a file's own under the empty name.
std::map<std::string, std::uintmax_t> sizes_in(const std::string& path) {
  std::map<std::string, std::uintmax_t> out;
  if (fs::is_regular_file(path)) out[""] = fs::file_size(path);
  if (!fs::is_directory(path)) return out;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) out[fs::relative(entry.path(), path).string()] = entry.file_size();
  return out;
}

/// Runs the command to its end once, then ends it at moments all over that time.
void end_at_many_moments(const TemporaryFolder& folder, std::vector<std::string> command, const std::string& name) {
  const std::string out = folder.path() + "/out/" + name, log = folder.path() + "/log";
  fs::create_directories(folder.path() + "/out");
  command.insert(command.end(), {"-o", out, "-q"});
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(finish(start(command, log)), 0) << content(log);
  const auto took = std::chrono::steady_clock::now() - began;
  const auto whole = sizes_in(out);
  ASSERT_FALSE(whole.empty());
  fs::remove_all(out);

  constexpr int ends = 9;
  int while_working = 0;
  for (int i = 0; i < ends; ++i) {
    const int signal = std::array{SIGINT, SIGKILL, SIGTERM}[i % 3];
    const pid_t child = start(command, log);
    std::this_thread::sleep_for(took * (i + 1) / (ends + 1));
    kill(child, signal);
    finish(child);
    const auto left = sizes_in(out);
    EXPECT_TRUE(left.empty() || left == whole) << name << " after signal " << signal << " at moment " << i << ": "
                                               << left.size() << " of " << whole.size() << " files";
    while_working += left.empty();
    fs::remove_all(out);
    const auto beside = names_in(folder.path() + "/out");
    if (signal != SIGKILL) {  // which leaves no time to tidy up
      EXPECT_TRUE(beside.empty()) << name << ": signal " << signal << " left " << beside.front();
    }
    for (const std::string& rest : beside) fs::remove_all(folder.path() + "/out/" + rest);
  }
  EXPECT_GT(while_working, ends / 4) << "the signals came too late to tell anything";
}

TEST(Killed, SimulateLeavesAWholeFolderOrNone) {
  const TemporaryFolder folder;
  end_at_many_moments(folder, {"simulate", "handheld", "--duration", "0.5"}, "run");
}

TEST(Killed, ConvertLeavesAWholeFileOrFolderOrNone) {
  const TemporaryFolder folder;
  const std::string in = folder.path() + "/in", log = folder.path() + "/log";
  ASSERT_EQ(finish(start({"simulate", "handheld", "--duration", "0.5", "-o", in, "-q"}, log)), 0) << content(log);
  for (const char* name : {"run.mcap", "run"}) end_at_many_moments(folder, {"convert", in}, name);
}

}  // namespace
}  // namespace takt::cli
