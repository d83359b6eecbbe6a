// SPDX-License-Identifier: Apache-2.0
// takt clock from bytes to answer, on what takt simulate clock writes.
#include "takt/workflows/clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "takt/simulation/clock_rig.h"
#include "takt/workflows/inspect.h"
#include "takt/workflows/listen.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

struct Board {
  ClockParameters parameters;
  ClockRecording made;
  TemporaryFolder folder;
  std::string capture, frames;

  explicit Board(std::uint64_t seed, double duration_s = 300) {
    parameters.duration_s = duration_s;
    made = simulate_clock(parameters, seed);
    capture = folder.file("capture.takt", as_gateware_capture(made, parameters));
    frames = folder.file("cam1_frames.csv", frames_csv(made.cameras[1]));
  }
  static std::string frames_csv(const TriggeredCamera& camera) {
    std::string text = "t_ns,exposure_s\n";
    for (const auto& f : camera.frames) text += std::to_string(f.stamp_ns) + "," + std::to_string(f.exposure_s) + "\n";
    return text;
  }
  static std::string arrivals_csv(const TriggeredCamera& camera) {
    std::string text = "device_ns,arrival_ns\n";
    for (const auto& f : camera.frames) text += std::to_string(f.stamp_ns) + "," + std::to_string(f.arrival_ns) + "\n";
    return text;
  }
};

double extra(const Estimate& e, const std::string& name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  return std::nan("");
}

/// Error over σ at the answer's own epoch.
double relative_error(const Estimate& e, const Estimate& truth) {
  const auto t = as<SensorClock>(from_ns(to_ns(e.epoch)));
  return 1e-9 * static_cast<double>((*e.offset - truth.clock_map().offset_at(t)).count()) / *e.sigma_s;
}

TEST(ClockJob, ACaptureOfTheGatewareIsPutOnUtc) {
  double squares = 0;
  for (std::uint64_t seed = 301; seed <= 304; ++seed) {
    const Board board(seed);
    ClockJob job;
    job.input = board.capture;
    const Estimate e = relate_clocks(job).estimate;
    ASSERT_EQ(e.verdict, Verdict::trusted);
    EXPECT_EQ(e.sensor, "board");
    EXPECT_EQ(e.reference, "utc");
    squares += std::pow(relative_error(e, board.made.truth), 2);
    // Both cameras are triggered at once: their middles are half the difference of their exposures apart, and 15 µs.
    EXPECT_NEAR(extra(e, "cam1_middle_s"), 1.5e-3 + 15e-6, 1e-4);
    EXPECT_NEAR(extra(e, "cam1_advance_s"), 1.5e-3 + 15e-6, 1e-4);
  }
  EXPECT_LT(squares / 4, 3);
}

TEST(ClockJob, FramesFindTheirStrobesAndUtc) {
  double squares = 0;
  for (std::uint64_t seed = 301; seed <= 304; ++seed) {
    const Board board(seed);
    ClockJob job;
    job.input = board.capture;
    job.frames = board.frames;
    job.camera = "cam1";
    const ClockOutcome found = relate_clocks(job);
    ASSERT_EQ(found.estimate.verdict, Verdict::trusted);
    EXPECT_EQ(found.estimate.sensor, "cam1");
    EXPECT_EQ(found.estimate.reference, "utc");
    squares += std::pow(relative_error(found.estimate, board.made.cameras[1].truth), 2);
    ASSERT_EQ(found.stamps.size(), board.made.cameras[1].frames.size());
    std::size_t paired = 0;
    for (const PulseStamp& s : found.stamps) {
      if (!s.used) continue;
      ++paired;
      const auto t = as<SensorClock>(from_ns(s.device_ns));
      const std::int64_t utc_ns = s.device_ns + board.made.cameras[1].truth.clock_map().offset_at(t).count();
      EXPECT_LT(std::abs(s.stamp.reference_ns - utc_ns), 200'000) << "another frame's strobe";
    }
    EXPECT_GT(paired * 100, found.stamps.size() * 98);
  }
  EXPECT_LT(squares / 4, 3);
}

TEST(ClockJob, FramesOfAnotherCameraAreRefused) {
  const Board board(301, 60);
  ClockJob job;
  job.input = board.capture;
  job.frames = board.frames;
  EXPECT_NE(complaint([&] { (void)relate_clocks(job); }).find("--camera"), std::string::npos);
  job.camera = "cam0";
  const ClockOutcome found = relate_clocks(job);
  EXPECT_EQ(found.estimate.verdict, Verdict::refused);
  for (const PulseStamp& s : found.stamps) EXPECT_EQ(s.stamp.state, ClockState::ambiguous);
}

TEST(ClockJob, SensorsThatShareATriggerAreRelated) {
  double squares = 0;
  for (std::uint64_t seed = 301; seed <= 304; ++seed) {
    const Board board(seed);
    ClockJob job;
    job.shared_trigger = {board.folder.file("cam0.csv", Board::arrivals_csv(board.made.cameras[0])),
                          board.folder.file("cam1.csv", Board::arrivals_csv(board.made.cameras[1]))};
    const Estimate e = relate_clocks(job).estimate;
    ASSERT_NE(e.verdict, Verdict::refused) << e.reasons.front();
    EXPECT_EQ(e.sensor, "cam0");
    EXPECT_EQ(e.reference, "cam1");
    EXPECT_GT(extra(e, "triggers_lost_cam0"), 0);
    // Stamps are the middles of exposures, which are not the same instant here: 1.5 ms, and their exposures' changes.
    const ClockMap<> a = board.made.cameras[0].truth.clock_map(), b = board.made.cameras[1].truth.clock_map();
    const auto t = as<SensorClock>(from_ns(to_ns(e.epoch)));
    const std::int64_t utc_ns = to_ns(e.epoch) + a.offset_at(t).count();
    const auto other = as<SensorClock>(from_ns(to_ns(e.epoch) + e.offset->count()));
    const double apart_s = 1e-9 * static_cast<double>(to_ns(other) + b.offset_at(other).count() - utc_ns);
    EXPECT_NEAR(apart_s, 1.5e-3 + 15e-6, 1.5e-3);
    squares += std::pow(extra(e, "outliers"), 2);
  }
  EXPECT_LT(squares, 4 * 100);
}

TEST(ClockJob, InspectListsThePulsesOfACapture) {
  const Board board(301, 60);
  std::string names;
  for (const StreamAudit& s : inspect(board.capture).streams) names += s.kind + ":" + s.name + " ";
  EXPECT_EQ(names, "camera:cam0 camera:cam1 pulses:pps pulses:trigger0 pulses:trigger1 pulses:gnss ");
}

TEST(ListenJob, EveryEventOfACaptureLiesWithinItsBounds) {
  const Board board(302);
  ListenJob job;
  job.source = board.capture;
  job.pulse_error_s = board.parameters.pulse_error_s;
  job.mcap = board.folder.path() + "/events.mcap";
  std::size_t bounded = 0, wrong = 0, events = 0;
  const ClockMap<> truth = board.made.truth.clock_map();
  const auto number = [](const std::string& json, const std::string& name) -> std::optional<std::int64_t> {
    const auto at = json.find("\"" + name + "\":");
    if (at == std::string::npos || json.compare(at + name.size() + 3, 4, "null") == 0) return std::nullopt;
    return std::stoll(json.substr(at + name.size() + 3));
  };
  job.on_line = [&](const std::string& json) {
    const auto t = number(json, "t_ns"), value = number(json, "reference_ns"), low = number(json, "lower_ns"),
               high = number(json, "upper_ns");
    if (!t || !value || json.find("\"pps\"") != std::string::npos) return;
    ++events;
    const auto device = as<SensorClock>(from_ns(*t));
    // t_ns is where the tick begins; the edge is somewhere within it.
    const std::int64_t begin = *t + truth.offset_at(device).count(), end = begin + 21;
    wrong += std::abs(*value - begin) > 1'000'000;
    if (!low || !high) return;
    ++bounded;
    EXPECT_LE(*low, begin);
    EXPECT_GE(*high, end);
  };
  const ListenStatus last = listen(job);
  EXPECT_EQ(last.state, ClockState::locked);
  EXPECT_GT(events, 20'000U);
  EXPECT_EQ(bounded, events);
  EXPECT_EQ(wrong, 0U);
  EXPECT_TRUE(std::filesystem::exists(job.mcap));
}

}  // namespace
}  // namespace takt
