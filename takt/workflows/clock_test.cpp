// SPDX-License-Identifier: Apache-2.0
// takt clock from bytes to answer, on what takt simulate clock writes.
#include "takt/workflows/clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "takt/simulation/clock_rig.h"
#include "takt/simulation/random.h"
#include "takt/time/time_scales.h"
#include "takt/workflows/inspect.h"
#include "takt/workflows/listen.h"
#include "tests/gnss_writing.h"
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

/// Two sensors that stamp the same triggers, each on its own clock; 2 % of the samples never arrive.
struct SharedTrigger {
  double stamp_noise_s = 20e-6;
  double ppm_a = 0, ppm_b = 0;
  std::int64_t zero_a_ns = 3'000'000'000, zero_b_ns = 900'000'000'000;
  std::string a = "device_ns,arrival_ns\n", b = a;

  explicit SharedTrigger(std::uint64_t seed) {
    Random random(seed, "shared trigger");
    ppm_a = random.uniform(-40, 40), ppm_b = random.uniform(-40, 40);
    for (int k = 0; k < 1200; ++k) {
      const double t = 0.05 * k;
      const auto sample = [&](double ppm, std::int64_t zero_ns, std::string& out) {
        const std::int64_t stamp =
            zero_ns + std::llround(1e9 * (t * (1 + 1e-6 * ppm) + stamp_noise_s * random.normal()));
        const std::int64_t arrival =
            50'000'000'000 + std::llround(1e9 * (t + 2e-3 - 1e-3 * std::log1p(-random.uniform())));
        if (!random.chance(0.02)) out += std::to_string(stamp) + "," + std::to_string(arrival) + "\n";
      };
      sample(ppm_a, zero_a_ns, a);
      sample(ppm_b, zero_b_ns, b);
    }
  }
  /// B − A at a stamp of A.
  [[nodiscard]] double offset_ns(std::int64_t stamp_a_ns) const {
    const double t_ns = static_cast<double>(stamp_a_ns - zero_a_ns) / (1 + 1e-6 * ppm_a);
    return static_cast<double>(zero_b_ns - zero_a_ns) + 1e-6 * (ppm_b - ppm_a) * t_ns;
  }
};

TEST(ClockJob, SensorsThatShareATriggerAreRelated) {
  double mean = 0, squares = 0;
  constexpr int runs = 16;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const SharedTrigger made(seed);
    const TemporaryFolder folder;
    ClockJob job;
    job.shared_trigger = {folder.file("left.csv", made.a), folder.file("right.csv", made.b)};
    const Estimate e = relate_clocks(job).estimate;
    ASSERT_EQ(e.verdict, Verdict::trusted) << e.reasons.front();
    EXPECT_EQ(e.sensor, "left");
    EXPECT_EQ(e.reference, "right");
    EXPECT_GT(extra(e, "triggers_lost_left"), 0);
    const double error_s = 1e-9 * (static_cast<double>(e.offset->count()) - made.offset_ns(to_ns(e.epoch)));
    EXPECT_LT(std::abs(error_s), 20e-6) << "a neighbour's trigger, or no better than one stamp";
    mean += error_s / *e.sigma_s / runs;
    squares += error_s * error_s / *e.sigma_s / *e.sigma_s / runs;
    EXPECT_NEAR(*e.drift, 1e-6 * (made.ppm_b - made.ppm_a), 5 * *e.drift_sigma + 1e-9);
  }
  // 16 runs: the mean within 3.3/√16, chi-square of 16 leaves 0.32 … 2.1 in 998 of 1000 cases.
  EXPECT_LT(std::abs(mean), 0.83);
  EXPECT_GT(squares, 0.32);
  EXPECT_LT(squares, 2.1);
}

/// Stamps that are middles of exposures are not the same instant in two cameras: the answer is off by as much.
TEST(ClockJob, MiddlesOfOtherExposuresAreNotTheTrigger) {
  const Board board(301);
  ClockJob job;
  job.shared_trigger = {board.folder.file("cam0.csv", Board::arrivals_csv(board.made.cameras[0])),
                        board.folder.file("cam1.csv", Board::arrivals_csv(board.made.cameras[1]))};
  const Estimate e = relate_clocks(job).estimate;
  ASSERT_NE(e.verdict, Verdict::refused) << e.reasons.front();
  const ClockMap<> a = board.made.cameras[0].truth.clock_map(), b = board.made.cameras[1].truth.clock_map();
  const auto t = as<SensorClock>(from_ns(to_ns(e.epoch)));
  const std::int64_t utc_ns = to_ns(e.epoch) + a.offset_at(t).count();
  const auto other = as<SensorClock>(from_ns(to_ns(e.epoch) + e.offset->count()));
  const double apart_s = 1e-9 * static_cast<double>(to_ns(other) + b.offset_at(other).count() - utc_ns);
  EXPECT_NEAR(apart_s, 1.5e-3 + 15e-6, 1.5e-3);
}

/// A receiver that stamps the strobes itself; a tenth of its messages tell one edge only, a hundredth are lost.
std::string stamped_by_receiver(const Board& board, const TriggeredCamera& camera, std::uint64_t seed, bool ends) {
  Random random(seed, "marks");
  const ClockMap<> truth = board.made.truth.clock_map();
  const double tick_ns = 1e9 / camera.strobes.counter.tick_hz;
  const auto gps_ns = [&](std::int64_t ticks) {
    const auto t = from_ns(static_cast<std::int64_t>(std::llround(static_cast<double>(ticks) * tick_ns)));
    const std::int64_t utc_ns = to_ns(t) + truth.offset_at(as<SensorClock>(t)).count();
    return to_ns(to_gps(from_ns<Utc>(utc_ns))) + std::llround(20 * random.normal());
  };
  std::string out;
  int count = 65000;
  for (const FrameStrobe& s : camera.strobes.strobes) {
    count = (count + 1) % 65536;
    const std::int64_t start = gps_ns(s.start_ticks), end = ends ? gps_ns(s.end_ticks) : 0;
    if (random.chance(0.01)) continue;
    if (ends && random.chance(0.1))
      out += gnss_writing::tim_tm2(count, start, 0, 25) + gnss_writing::tim_tm2(count, 0, end, 25);
    else
      out += gnss_writing::tim_tm2(count, start, end, 25);
  }
  return out;
}

TEST(ClockJob, FramesStampedByTheReceiverAreOnUtc) {
  double squares = 0;
  for (std::uint64_t seed = 301; seed <= 304; ++seed) {
    const Board board(seed);
    ClockJob job;
    job.frames = board.frames;
    job.labels = {board.folder.file("gnss.ubx", stamped_by_receiver(board, board.made.cameras[1], seed, true))};
    const ClockOutcome found = relate_clocks(job);
    ASSERT_EQ(found.estimate.verdict, Verdict::trusted);
    EXPECT_EQ(found.estimate.reference, "utc");
    EXPECT_EQ(found.estimate.frame_instant, "middle");
    EXPECT_NEAR(extra(found.estimate, "events_lost"), 60, 40);
    squares += std::pow(relative_error(found.estimate, board.made.cameras[1].truth), 2);
    std::size_t paired = 0;
    for (const PulseStamp& s : found.stamps) {
      if (!s.used) continue;
      ++paired;
      const auto t = as<SensorClock>(from_ns(s.device_ns));
      const std::int64_t utc_ns = s.device_ns + board.made.cameras[1].truth.clock_map().offset_at(t).count();
      EXPECT_LT(std::abs(s.stamp.reference_ns - utc_ns), 200'000) << "another frame's event";
    }
    EXPECT_GT(paired * 100, found.stamps.size() * 95);
  }
  EXPECT_LT(squares / 4, 3);
}

TEST(ClockJob, EventsWithoutEndsAreEdgesNotMiddles) {
  const Board board(301, 120);
  ClockJob job;
  job.frames = board.frames;
  job.labels = {board.folder.file("gnss.ubx", stamped_by_receiver(board, board.made.cameras[1], 1, false))};
  const Estimate e = relate_clocks(job).estimate;
  // Equal intervals, and no widths to tell frames apart by: only the holes on either side remain.
  if (e.answered()) {
    EXPECT_NE(e.frame_instant, "middle");
  } else {
    EXPECT_NE(e.reasons.front().find("ambiguous"), std::string::npos);
  }
  job.event_channel = 1;
  EXPECT_NE(complaint([&] { (void)relate_clocks(job); }).find("TIM-TM2"), std::string::npos);
}

TEST(ClockJob, AReceiversEventsAreStamps) {
  const TemporaryFolder folder;
  ClockJob job;
  const std::int64_t utc_ns = 1'700'000'000'123'456'789, gps_ns = to_ns(to_gps(from_ns<Utc>(utc_ns)));
  job.labels = {folder.file("gnss.ubx", gnss_writing::tim_tm2(7, gps_ns, gps_ns + 5'000'000, 25))};
  const ClockOutcome found = relate_clocks(job);
  ASSERT_EQ(found.stamps.size(), 2U);
  EXPECT_EQ(found.stamps[0].stamp.reference_ns, utc_ns);
  EXPECT_EQ(found.stamps[1].stamp.reference_ns, utc_ns + 5'000'000);
  EXPECT_EQ(found.stamps[0].stamp.state, ClockState::locked);
  EXPECT_DOUBLE_EQ(found.stamps[0].stamp.sigma_s, 25e-9);
}

TEST(ClockJob, InspectListsTablesOfPulsesAndReceiversLogs) {
  const TemporaryFolder folder;
  std::string table = "sequence,ticks\n";
  for (int i = 0; i < 50; ++i) table += std::to_string(i) + "," + std::to_string(1000 + i * 48'000'000LL) + "\n";
  const Inspection pulses = inspect(folder.file("pps.csv", table));
  ASSERT_EQ(pulses.streams.size(), 1U);
  EXPECT_EQ(pulses.streams[0].kind, "pulses");
  EXPECT_NEAR(pulses.streams[0].stamps.rate_hz.value_or(0), 1, 1e-6);
  EXPECT_EQ(inspect(folder.file("gnss.ubx", gnss_writing::tim_tm2(7, 1, 2, 25))).format, "receiver's log");
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
