// SPDX-License-Identifier: Apache-2.0
// The real command: its exit statuses, and what is left of it when it is killed.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>
#include <tuple>

#include "cli/command_for_tests.h"
#include "cli/output.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt::cli {
namespace {

namespace fs = std::filesystem;
using namespace bag_writing;
using testing_tools::TemporaryFolder;

Estimate answer() {
  Estimate e;
  e.method = "ml";
  e.sensor = "/cam/image_raw";
  e.reference = "/imu";
  e.verdict = Verdict::trusted;
  e.offset = Duration(12'340'000);
  e.sigma_s = 8e-5;
  return e;
}

/// Enough of a bag that there is time to kill its copying.
std::string big_bag(std::size_t chunks) {
  std::string records;
  const std::string pixels(300'000, 'x');
  for (std::size_t i = 0; i < chunks; ++i)
    records += chunk((i == 0 ? connection(1, "/cam/image_raw", "sensor_msgs/Image") : "") +
                     message(1, image(static_cast<std::uint32_t>(100 + i), 600, 500, "mono8", 600, pixels)));
  return bag(records);
}

TEST(Apply, KilledAtAnyMomentItLeavesNothingUnderTheFinalName) {
  const TemporaryFolder folder;
  const std::string in = folder.file("in.bag", big_bag(80)), out = folder.path() + "/out.bag",
                    result = folder.path() + "/r.json", log = folder.path() + "/log";
  write_result(answer(), result);
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(finish(start({"apply", result, in, "-o", out}, log)), 0) << content(log);
  const auto took = std::chrono::steady_clock::now() - began;
  const std::string whole = content(out);
  ASSERT_GT(whole.size(), 20'000'000u);
  fs::remove(out);

  constexpr int kills = 24;
  int while_working = 0;
  for (int i = 0; i < kills; ++i) {
    const bool at_once = i % 3 != 2;  // SIGKILL leaves no time to tidy up, SIGTERM does
    const std::string before = i % 2 == 0 ? "" : "what was there before";
    if (!before.empty()) std::ofstream(out) << before;
    const pid_t child = start({"apply", result, in, "-o", out}, log);
    std::this_thread::sleep_for(took * (i + 1) / kills);
    kill(child, at_once ? SIGKILL : SIGTERM);
    finish(child);
    const std::string left = fs::exists(out) ? content(out) : "";
    EXPECT_TRUE(left == before || left == whole) << "after kill " << i << ": " << left.size() << " bytes";
    while_working += left == before;
    fs::remove(out);
    for (const std::string& name : names_in(folder.path())) {
      if (name.find(".part") == std::string::npos) continue;
      EXPECT_TRUE(at_once) << name << " was left";
      EXPECT_TRUE(name.starts_with("."));
      fs::remove(folder.path() + "/" + name);
    }
  }
  EXPECT_GT(while_working, kills / 4) << "the kills came too late to tell anything";
}

TEST(Apply, StatusesAndWords) {
  const TemporaryFolder folder;
  const std::string in = folder.file("in.bag", big_bag(1)), out = folder.path() + "/out.bag",
                    result = folder.path() + "/r.json", log = folder.path() + "/log";
  const auto takt = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "apply");
    return finish(start(arguments, log));
  };
  write_result(answer(), result);
  EXPECT_EQ(takt({result, in, "--dry-run"}), 0) << content(log);
  EXPECT_NE(content(log).find("/cam/image_raw: 1 stamps would move by +12.34"), std::string::npos) << content(log);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(takt({result, in, "-o", out, "--json"}), 0) << content(log);
  EXPECT_NE(content(log).find("\"earliest_after_ns\": 100012340005"), std::string::npos) << content(log);
  EXPECT_EQ(takt({result, in, "-o", out, "--move", "reference", "--sensor", "/cam/image_raw"}), 0) << content(log);
  EXPECT_NE(content(log).find("moved by -12.34"), std::string::npos) << content(log);
  EXPECT_EQ(takt({result, in}), 2);
  EXPECT_EQ(takt({result, in, "-o", in}), 1);
  EXPECT_EQ(takt({result, in, "-o", folder.path() + "/out.mcap"}), 1);
  EXPECT_EQ(takt({result, in, "-o", out, "--sensor", "/nobody"}), 1);
  fs::remove(out);
  Estimate doubtful = answer();
  doubtful.doubt(Verdict::weak, "the halves disagree");
  write_result(doubtful, result);
  EXPECT_EQ(takt({result, in, "-o", out}), 3);
  EXPECT_TRUE(fs::exists(out));
  fs::remove(out);
  write_result(Estimate::refusal("ml", "no motion"), result);
  EXPECT_EQ(takt({result, in, "-o", out}), 3);
  EXPECT_NE(content(log).find("nothing to apply"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
}

TEST(Apply, AFrameMayBeLetMeanAnotherInstantAndRow) {
  const TemporaryFolder folder;
  std::ignore = folder.file("in/cam0/data.csv", "#timestamp [ns],filename\n1000000000,1.png\n1100000000,2.png\n");
  std::ignore = folder.file("in/cam0/exposure.csv", "#t,e\n1000000000,4000000\n1100000000,8000000\n");
  std::ignore = folder.file("in/cam0/sensor.yaml",
                            "stamp: start\nreadout_s: 0.02\nshutter: rolling\nresolution: [640, 400]\n"
                            "intrinsics: [400, 400, 320, 200]\n");
  Estimate e = answer();
  e.sensor = "cam0";
  e.offset = Duration(1'000'000);
  const std::string result = folder.path() + "/r.json", out = folder.path() + "/out", log = folder.path() + "/log";
  write_result(e, result);
  ASSERT_EQ(
      finish(start({"apply", result, folder.path() + "/in", "-o", out, "--instant", "middle", "--row", "middle"}, log)),
      0)
      << content(log);
  EXPECT_EQ(content(out + "/cam0/data.csv"), "#timestamp [ns],filename\n1013000000,1.png\n1115000000,2.png\n");
  EXPECT_NE(content(out + "/cam0/sensor.yaml").find("stamp: middle\n"), std::string::npos);
  EXPECT_NE(content(log).find("now they mean the middle of the exposure of the middle row"), std::string::npos)
      << content(log);
}

}  // namespace
}  // namespace takt::cli
