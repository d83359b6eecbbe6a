// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "cli/interrupt.h"
#include "takt/error.h"

namespace takt::cli {
namespace {

namespace fs = std::filesystem;

Estimate answer() {
  Estimate e;
  e.method = "ml";
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = Duration(12'340'000);
  e.sigma_s = 8e-5;
  return e;
}

class OutputTest : public testing::Test {
 protected:
  OutputTest() { fs::create_directories(folder_); }
  ~OutputTest() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  /// Exit status of the real command.
  [[nodiscard]] int takt(const std::string& arguments) const {
    const int status = std::system(
        (std::string(TAKT_COMMAND) + " " + arguments + " >" + in_folder("out") + " 2>" + in_folder("err")).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    std::ifstream in(in_folder(name));
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_ = fs::path(testing::TempDir()) / ("takt_output_" + std::to_string(getpid()));
};

TEST_F(OutputTest, VerdictIsTheExitStatus) {
  Estimate e = answer();
  EXPECT_EQ(exit_status(e), 0);
  e.doubt(Verdict::weak, "short");
  EXPECT_EQ(exit_status(e), 3);
  e.doubt(Verdict::refused, "still");
  EXPECT_EQ(exit_status(e), 3);
}

TEST_F(OutputTest, WordsHaveTheSentenceTheReasonsAndAllMethods) {
  Estimate e = answer();
  Estimate coarse = answer();
  coarse.method = "correlation";
  coarse.sigma_s = 6e-4;
  e.estimates = {coarse, Estimate::refusal("phase", "too short"), answer()};
  e.doubt(Verdict::weak, "the halves disagree");
  e.doubt(Verdict::weak, "a gap of 2 s");
  EXPECT_EQ(in_words(e, false, false),
            "cam0 is 12.34 ± 0.08 ms early against imu0 (weak: the halves disagree)\n"
            "  - a gap of 2 s\n\n"
            "  correlation  12.3 ± 0.6 ms    trusted\n"
            "  phase        no answer        refused  too short\n"
            "  ml           12.34 ± 0.08 ms  trusted\n");
  EXPECT_EQ(in_words(e, true, false), "cam0 is 12.34 ± 0.08 ms early against imu0 (weak: the halves disagree)\n");
}

TEST_F(OutputTest, ResultsAreWrittenAndReadByTheirEnding) {
  for (const char* name : {"r.json", "r.yaml", "r.yml"}) {
    write_result(answer(), in_folder(name));
    EXPECT_EQ(read_result(in_folder(name)).offset, answer().offset) << name;
  }
  EXPECT_EQ(files(), 3u) << "temporary files were left";
  EXPECT_THROW(static_cast<void>(read_result(in_folder("none.json"))), Error);
  EXPECT_THROW(static_cast<void>(read_result(folder_.string())), Error);
  EXPECT_THROW(write_result(answer(), in_folder("no/such/folder.json")), Error);
}

TEST_F(OutputTest, AFailedWriteLeavesTheOldFile) {
  write_file(in_folder("a.json"), "old");
  fs::create_directory(in_folder("a.json.part" + std::to_string(getpid())));  // the temporary cannot be opened
  EXPECT_THROW(write_file(in_folder("a.json"), "new"), Error);
  EXPECT_EQ(text("a.json"), "old");
}

TEST_F(OutputTest, AnInterruptRemovesWhatIsHalfWritten) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const pid_t child = fork();
    if (child == 0) {
      guard_against_interrupts();
      const RemovedOnInterrupt folder(in_folder("half"));
      fs::create_directories(folder.path() / "deep");
      std::ofstream(folder.path() / "deep/file") << "half";
      std::ofstream(in_folder("ready")) << "now";
      for (;;) pause();
    }
    for (int i = 0; i < 500 && !fs::exists(in_folder("ready")); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), signal);
    EXPECT_FALSE(fs::exists(in_folder("half")));
    fs::remove(in_folder("ready"));
  }
}

TEST_F(OutputTest, WhatIsKeptStays) {
  write_file(in_folder("done"), "x");
  {
    RemovedOnInterrupt file(in_folder("done"));
    file.keep();
  }
  EXPECT_TRUE(fs::exists(in_folder("done")));
}

TEST_F(OutputTest, ManyResultsAreATableAndTheirAgreement) {
  std::string files;
  for (int i = 0; i < 6; ++i) {
    Estimate e = answer();
    e.offset = Duration(i == 4 ? 99'000'000 : 12'000'000 + 10'000 * i);
    const std::string name = in_folder("r" + std::to_string(i) + ".json");
    write_result(e, name);
    files += " " + name;
  }
  EXPECT_EQ(takt("report" + files + " --json -o " + in_folder("all.html")), 0) << text("err");
  const std::string told = text("out");
  EXPECT_NE(told.find("r4.json"), std::string::npos) << told;
  EXPECT_NE(told.find("\"offset_s\": 0.099"), std::string::npos) << told;
  EXPECT_LT(told.find("r4.json"), told.find("\"outlier\": true")) << told;
  EXPECT_LT(told.find("\"outlier\": true"), told.find("r5.json")) << told;
}

TEST_F(OutputTest, TheCommandKeepsItsExitStatuses) {
  write_result(answer(), in_folder("a.json"));
  std::ofstream(in_folder("broken.json")) << "{";
  EXPECT_EQ(takt("report " + in_folder("a.json") + " -o " + in_folder("a.html")), 0) << text("err");
  EXPECT_NE(text("a.html").find("12.34 ± 0.08 ms"), std::string::npos);
  EXPECT_EQ(text("out"), "cam0 is 12.34 ± 0.08 ms early against imu0 (trusted)\n");
  EXPECT_EQ(takt("report " + in_folder("broken.json") + " -o " + in_folder("b.html")), 1);
  EXPECT_EQ(text("err").find("takt: " + in_folder("broken.json") + ":1:2: this is not JSON"), 0u) << text("err");
  EXPECT_EQ(takt("report " + in_folder("none.json") + " -o " + in_folder("b.html")), 1);
  EXPECT_EQ(takt("report " + in_folder("a.json") + " -o " + in_folder("no/b.html")), 1);
  EXPECT_EQ(takt("report " + in_folder("a.json") + " -o " + in_folder("b.pdf")), 2);
  EXPECT_EQ(takt("reprot"), 2);
  EXPECT_EQ(takt("--version"), 0);
  EXPECT_FALSE(fs::exists(in_folder("b.html")));
}

}  // namespace
}  // namespace takt::cli
