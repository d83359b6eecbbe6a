// SPDX-License-Identifier: Apache-2.0
// Every numbered scenario, in process: honest σ, bounds that hold, never a wrong second.
#include "takt/estimators/clock/pps_clock.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "takt/estimators/clock/live_clock.h"
#include "takt/estimators/clock/pair_clock.h"
#include "takt/recording/gnss_log.h"
#include "takt/simulation/clock_rig.h"
#include "takt/simulation/random.h"
#include "takt/simulation/scenario.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

std::vector<LabelStream> logs_of(const ClockRecording& r, bool nmea, bool ubx) {
  std::vector<LabelStream> out;
  const auto add = [&](const std::string& bytes, const std::string& arrivals) {
    out.push_back(read_gnss_log(bytes, "gnss"));
    stamp_arrivals(out.back(), arrivals, "arrivals");
  };
  if (nmea) add(r.nmea, r.nmea_arrivals);
  if (ubx) add(r.ubx, r.ubx_arrivals);
  return out;
}

struct Against {
  double nees = 0, worst_s = 0;
  int wrong_seconds = 0;
};
Against against(const Estimate& e, const Estimate& truth) {
  Against out;
  const ClockMap<> found = e.clock_map(), right = truth.clock_map();
  const std::int64_t from = e.pieces.empty() ? to_ns(e.epoch) : to_ns(e.pieces.front().start);
  const std::int64_t to = e.pieces.empty() ? to_ns(e.epoch) : to_ns(e.pieces.back().start);
  int n = 0;
  for (int k = 0; k < 300; ++k) {
    const auto t = as<SensorClock>(from_ns(from + (to - from) / 300 * k + 777));
    const double error = to_seconds(found.offset_at(t) - right.offset_at(t));
    if (std::abs(error) > 0.4) {
      ++out.wrong_seconds;
      continue;
    }
    const double sigma = found.sigma_s(t);
    out.nees += error * error / sigma / sigma;
    out.worst_s = std::max(out.worst_s, std::abs(error));
    ++n;
  }
  out.nees /= std::max(n, 1);
  return out;
}

ClockRecording scenario(const std::string& name, std::uint64_t seed) {
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TAKT_SOURCE_DIR) / "scenarios"))
    if (entry.path().filename().string().find("-clock-" + name) != std::string::npos) {
      ClockParameters p;
      change(p, read_scenario(entry.path().string()));
      return simulate_clock(p, seed);
    }
  throw std::runtime_error("no scenario " + name);
}

class Scenarios : public ::testing::TestWithParam<const char*> {};

TEST_P(Scenarios, NeverAWrongSecondAndHonest) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const ClockRecording r = scenario(GetParam(), seed);
    for (const auto& [nmea, ubx] : {std::pair{true, true}, {true, false}, {false, true}}) {
      const PpsResult found = discipline(r.pulses, logs_of(r, nmea, ubx));
      if (!found.estimate.answered()) {
        ASSERT_FALSE(found.estimate.reasons.empty());
        EXPECT_NE(found.estimate.reasons.front().find("ambiguous"), std::string::npos);
        for (const PulseStamp& s : found.stamps) EXPECT_EQ(s.stamp.state, ClockState::ambiguous);
        continue;
      }
      const Against a = against(found.estimate, r.truth);
      EXPECT_EQ(a.wrong_seconds, 0) << GetParam() << seed << nmea << ubx;
      EXPECT_LT(a.nees, 3) << GetParam() << seed << nmea << ubx;
      EXPECT_LT(a.worst_s, 2e-6) << GetParam();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Clock, Scenarios,
                         ::testing::Values("normal", "wander", "thermal-ramp", "lost-pulses", "false-pulses",
                                           "wrong-polarity", "late-label", "fractional-label", "leap-second",
                                           "negative-leap", "stalled-receiver", "wrong-leap", "week-rollover",
                                           "wrap-32-bit", "restart", "byte-loss", "fifo-overrun", "host-stall",
                                           "unplugged"));

Verdict verdict_of(const std::string& name, bool nmea, bool ubx) {
  const ClockRecording r = scenario(name, 1);
  return discipline(r.pulses, logs_of(r, nmea, ubx)).estimate.verdict;
}

TEST(PpsClock, WhatCanBeAnsweredIs) {
  for (const char* name :
       {"normal", "false-pulses", "lost-pulses", "fractional-label", "leap-second", "negative-leap", "stalled-receiver",
        "week-rollover", "wrap-32-bit", "byte-loss", "fifo-overrun", "unplugged"})
    EXPECT_EQ(verdict_of(name, true, true), Verdict::trusted) << name;
  EXPECT_EQ(verdict_of("wrong-leap", false, true), Verdict::trusted) << "GPS time is not touched by leap seconds";
}

TEST(PpsClock, WhatCannotIsRefused) {
  EXPECT_EQ(verdict_of("wrong-polarity", true, true), Verdict::refused);
  EXPECT_EQ(verdict_of("late-label", true, true), Verdict::refused);
  EXPECT_EQ(verdict_of("wrong-leap", true, false), Verdict::refused) << "NMEA does not say when leap seconds are known";
  EXPECT_EQ(verdict_of("restart", true, true), Verdict::weak);
}

TEST(PpsClock, LabelsWithoutArrivalAreAmbiguous) {
  const ClockRecording r = scenario("normal", 1);
  std::vector<LabelStream> logs{read_gnss_log(r.nmea, "gnss")};
  const Estimate refused = discipline(r.pulses, logs).estimate;
  EXPECT_EQ(refused.verdict, Verdict::refused);
  EXPECT_NE(refused.reasons.front().find("arrival"), std::string::npos);
  PpsOptions told;
  told.labels.same_start = true;
  EXPECT_EQ(against(discipline(r.pulses, logs, told).estimate, r.truth).wrong_seconds, 0);
}

/// Every label late by more than a second: only the ends of the log can show it.
TEST(PpsClock, LabelsLateByASecondAreNotBelieved) {
  ClockParameters p;
  p.label_delay_s = 1.2;
  const ClockRecording r = simulate_clock(p, 1);
  PulseStream pulses = r.pulses;
  pulses.pulses.pop_back();  // the log ends with a label for each pulse
  EXPECT_EQ(discipline(pulses, logs_of(r, true, false)).estimate.verdict, Verdict::refused);
}

TEST(PpsClock, EveryFifthPulseMissingIsNoHindrance) {
  ClockRecording r = scenario("normal", 1);
  std::vector<Pulse> kept;
  for (std::size_t i = 0; i < r.pulses.size(); ++i)
    if (i % 5 != 2) kept.push_back(r.pulses.pulses[i]);
  r.pulses.pulses = kept;
  const Estimate e = discipline(r.pulses, logs_of(r, true, true)).estimate;
  ASSERT_EQ(e.verdict, Verdict::trusted);
  EXPECT_LT(against(e, r.truth).nees, 3);
}

TEST(PpsClock, QErrIsAppliedWithTheSignThatHelps) {
  const ClockRecording r = scenario("normal", 1);
  const std::vector<LabelStream> logs = logs_of(r, false, true);
  std::vector<LabelStream> turned = logs;
  for (PulseError& e : turned[0].pulse_errors) e.error_s = -e.error_s;
  PpsOptions off;
  off.qerr = "off";
  const double with = *discipline(r.pulses, logs).estimate.sigma_s;
  EXPECT_LT(with, *discipline(r.pulses, logs, off).estimate.sigma_s);
  EXPECT_DOUBLE_EQ(*discipline(r.pulses, turned).estimate.sigma_s, with);
}

TEST(PpsClock, HardBoundsHold) {
  const ClockParameters p;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const ClockRecording r = simulate_clock(p, seed);
    PpsOptions bounded;
    bounded.pulse_error_s = p.pulse_error_s;
    for (const PulseStamp& s : discipline(r.pulses, logs_of(r, true, true), bounded).stamps) {
      ASSERT_TRUE(s.stamp.lower_ns && s.stamp.upper_ns);
      const std::int64_t truth = r.true_utc_ns[s.index];
      EXPECT_LE(*s.stamp.lower_ns, truth);
      EXPECT_GE(*s.stamp.upper_ns, truth);
    }
  }
}

/// An event's stamp is the edge's, which lies half a tick behind the count: half a tick is 1.7 σ of it.
TEST(PpsClock, StampsOfEdgesAreHonest) {
  double nees = 0, mean = 0, n = 0;
  for (std::uint64_t seed = 301; seed <= 302; ++seed) {
    const ClockRecording r = simulate_clock({}, seed);
    for (const PulseStamp& s : discipline(r.pulses, logs_of(r, true, true)).stamps) {
      const double e = 1e-9 * static_cast<double>(s.stamp.reference_ns - r.true_utc_ns[s.index]) / s.stamp.sigma_s;
      nees += e * e, mean += e, n += 1;
    }
  }
  EXPECT_LT(std::abs(mean / n), 0.15);
  EXPECT_GT(nees / n, 0.7);
  EXPECT_LT(nees / n, 1.4);
}

/// The counter wraps between the first pulse and the first label; each log's wraps alone say nothing of that.
TEST(PpsClock, AWrapBetweenPulseAndLabelIsSeen) {
  ClockParameters p;
  p.counter_bits = 32;
  p.counter_start = 4294967296.0 - 48'000;
  const ClockRecording r = simulate_clock(p, 301);
  const Estimate e = discipline(r.pulses, logs_of(r, true, false)).estimate;
  ASSERT_EQ(e.verdict, Verdict::trusted);
  EXPECT_EQ(against(e, r.truth).wrong_seconds, 0);

  // A log that begins a minute after the pulses may be of another wrap, which are 89 s apart.
  std::vector<LabelStream> late = logs_of(r, true, false);
  late[0].labels.erase(late[0].labels.begin(), late[0].labels.begin() + 180);
  const Estimate refused = discipline(r.pulses, late).estimate;
  EXPECT_EQ(refused.verdict, Verdict::refused);
  EXPECT_NE(refused.reasons.front().find("wrap"), std::string::npos);
}

/// Labels 20 ms behind the next pulse, give or take 30: the first few may all lie clear of it.
TEST(PpsClock, FewLabelsThatScatterOverAPulseAreNotBelieved) {
  ClockParameters p;
  p.duration_s = 12;
  p.label_delay_s = 1.05;
  for (std::uint64_t seed = 301; seed <= 340; ++seed) {
    const ClockRecording r = simulate_clock(p, seed);
    EXPECT_EQ(discipline(r.pulses, logs_of(r, true, false)).estimate.verdict, Verdict::refused) << seed;
  }
}

TEST(PpsClock, ADateOfARolledOverWeekIsNotBelieved) {
  ClockParameters p;
  p.rollover_at_s = 0;
  const ClockRecording r = simulate_clock(p, 301);
  EXPECT_EQ(discipline(r.pulses, logs_of(r, true, false)).estimate.verdict, Verdict::refused);
  PpsOptions old;
  old.labels.old_dates = true;
  EXPECT_TRUE(discipline(r.pulses, logs_of(r, true, false), old).estimate.answered());
}

/// By the hull alone too, whose lines know nothing of leap seconds; and no pulse's second is another's.
TEST(PpsClock, TheHullFollowsALeapSecond) {
  for (const char* name : {"leap-second", "negative-leap"})
    for (std::uint64_t seed = 301; seed <= 302; ++seed) {
      const ClockRecording r = scenario(name, seed);
      PpsOptions hull;
      hull.method = "hull";
      hull.pulse_error_s = ClockParameters{}.pulse_error_s;
      const PpsResult found = discipline(r.pulses, logs_of(r, true, true), hull);
      ASSERT_TRUE(found.estimate.answered()) << found.estimate.reasons.front();
      const Against a = against(found.estimate, r.truth);
      EXPECT_EQ(a.wrong_seconds, 0) << name << seed;
      EXPECT_LT(a.nees, 3) << name << seed;
      const ClockMap<> map = found.estimate.clock_map();
      for (const PulseStamp& s : found.stamps) {
        const auto t = as<SensorClock>(from_ns(s.device_ns));
        const std::int64_t utc_ns = s.device_ns + map.offset_at(t).count();
        EXPECT_LT(std::abs(utc_ns - r.true_utc_ns[s.index]), 1'000'000) << name << seed << " pulse " << s.index;
        EXPECT_LE(*s.stamp.lower_ns, r.true_utc_ns[s.index]);
        EXPECT_GE(*s.stamp.upper_ns, r.true_utc_ns[s.index]);
      }
    }
}

TEST(PpsClock, TheHullIsNoSurerThanItMayBeOverAGap) {
  for (std::uint64_t seed = 301; seed <= 304; ++seed) {
    const ClockRecording r = scenario("lost-pulses", seed);
    PpsOptions hull;
    hull.method = "hull";
    hull.pulse_error_s = ClockParameters{}.pulse_error_s;
    const Estimate e = discipline(r.pulses, logs_of(r, true, true), hull).estimate;
    if (e.answered()) {
      EXPECT_LT(against(e, r.truth).nees, 3) << seed;
    }
  }
}

TEST(PpsClock, CountsBeyondStampsAreRefused) {
  PulseStream far;
  far.counter.tick_hz = 48e6;
  for (int i = 0; i < 100; ++i) far.pulses.push_back({.ticks = (std::int64_t{1} << 62) + i * 48'000'000LL});
  const Estimate e = discipline(far, {}).estimate;
  EXPECT_EQ(e.verdict, Verdict::refused);
  EXPECT_NE(e.reasons.front().find("years"), std::string::npos);
}

TEST(PpsClock, WithoutLabelsOnlyWithinTheSecond) {
  const ClockRecording r = scenario("normal", 1);
  const Estimate e = discipline(r.pulses, {}).estimate;
  ASSERT_TRUE(e.answered());
  EXPECT_EQ(e.reference, "pps");
  EXPECT_LE(std::abs(e.offset->count()), 501'000'000);
}

TEST(PpsClock, NothingToFindIsRefused) {
  PulseStream few;
  few.counter.tick_hz = 48e6;
  EXPECT_EQ(discipline(few, {}).estimate.verdict, Verdict::refused);
  takt::Random random(1, "noise");
  for (int i = 0; i < 300; ++i) few.pulses.push_back({.ticks = static_cast<std::int64_t>(random.uniform() * 48e8)});
  std::sort(few.pulses.begin(), few.pulses.end(), [](const Pulse& a, const Pulse& b) { return a.ticks < b.ticks; });
  EXPECT_NE(discipline(few, {}).estimate.verdict, Verdict::trusted);
}

/// The live clock gets what the offline one gets, in the order of the counter.
TEST(LiveClock, NeverAWrongSecondLive) {
  for (const char* name : {"normal", "false-pulses", "late-label", "stalled-receiver", "wrong-polarity", "restart",
                           "unplugged", "wrap-32-bit"}) {
    const ClockRecording r = scenario(name, 1);
    LabelStream log = logs_of(r, true, false)[0];
    LiveClock clock(r.pulses.counter);
    std::size_t label = 0, locked = 0, wrong = 0;
    double nees = 0;
    CountExtender of_pulses(r.pulses.counter.bits, r.pulses.counter.tick_hz),
        of_labels(r.pulses.counter.bits, r.pulses.counter.tick_hz);
    std::vector<ExtendedCount> arrivals;
    for (const TimeLabel& l : log.labels) arrivals.push_back(of_labels.extend(*l.arrival_ticks));
    for (std::size_t i = 0; i < r.pulses.size(); ++i) {
      const ExtendedCount at = of_pulses.extend(r.pulses.pulses[i].ticks);
      for (; label < arrivals.size() && (arrivals[label].restarts < at.restarts ||
                                         (arrivals[label].restarts == at.restarts && arrivals[label].ticks < at.ticks));
           ++label)
        clock.observe_label(log.labels[label]);
      clock.observe_pulse(r.pulses.pulses[i].ticks);
      const auto stamp = clock.stamp(r.pulses.pulses[i].ticks);
      if (!stamp || stamp->state == ClockState::ambiguous) continue;
      const double error = 1e-9 * static_cast<double>(stamp->reference_ns - r.true_utc_ns[i]);
      ++locked;
      wrong += std::abs(error) > 1e-3;
      nees += error * error / (stamp->sigma_s * stamp->sigma_s + 30e-9 * 30e-9);
    }
    EXPECT_EQ(wrong, 0U) << name;
    if (std::string(name) == "normal" || std::string(name) == "wrap-32-bit") {
      EXPECT_GT(locked, 850U) << name;
      EXPECT_LT(nees / static_cast<double>(locked), 1.5) << name;
    }
  }
}

}  // namespace
}  // namespace takt
