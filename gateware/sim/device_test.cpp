// SPDX-License-Identifier: Apache-2.0
// The device in Verilator, its UART read bit by bit, its bytes by the decoder that hosts use.
#include <gtest/gtest.h>

#include <map>
#include <numeric>

#include TAKT_DEVICE_HEADER
#include "gateware/sim/rig.h"
#include "gateware/sim/vectors.h"
#include "takt/recording/gateware.h"
#include "takt/simulation/random.h"

namespace takt::sim {
namespace {

using Device = Rig<TAKT_DEVICE>;
constexpr int bit = 16;
constexpr double tick_hz = 48e6;
/// Netlists are slow: they get shorter runs of the same tests.
#ifdef TAKT_NETLIST
constexpr std::int64_t length = 400'000;
#else
constexpr std::int64_t length = 12'000'000;
#endif

struct Heard {
  std::vector<GatewareEvent> events;
  GatewareHealth health;
  [[nodiscard]] std::vector<GatewareEvent> of(wire::Kind kind, int channel = -1) const {
    std::vector<GatewareEvent> out;
    for (const auto& e : events)
      if (e.frame.kind == kind && (channel < 0 || e.frame.channel == channel)) out.push_back(e);
    return out;
  }
};
Heard hear(const Device& device) {
  GatewareDecoder decoder;
  decoder.feed(device.bytes());
  Heard out;
  while (auto e = decoder.next()) out.events.push_back(*e);
  out.health = decoder.health();
  EXPECT_EQ(out.health.bad_crc, 0u);
  EXPECT_EQ(out.health.garbage_bytes, 0u);
  EXPECT_EQ(device.framing_errors, 0u);
  return out;
}
void sort(std::vector<PinChange>& changes) {
  std::stable_sort(changes.begin(), changes.end(), [](auto& a, auto& b) { return a.cycle < b.cycle; });
}
std::int64_t say(std::vector<PinChange>& changes, const wire::Command& command, std::int64_t cycle) {
  return append_uart(changes, GatewarePin::host, wire::encode(command), cycle, bit);
}

/// Edges of an IMU at 1 kHz with jitter: their stamps are off by a rounded tick and nothing else.
TEST(Device, StampsEdgesToATick) {
  Device device;
  Random random(1, "edges");
  std::vector<double> truth;
  std::vector<PinChange> changes;
  for (double t = 3000; t < length - 10'000; t += 9600 + 9600 * random.uniform()) {
    truth.push_back(t);
    changes.push_back({cycle_of_edge(t), GatewarePin::imu, 0, true});
    changes.push_back({cycle_of_edge(t) + 1000, GatewarePin::imu, 0, false});
  }
  sort(changes);
  device.run(changes, length);
  const auto edges = hear(device).of(wire::Kind::data_ready, 0);
  ASSERT_EQ(edges.size(), truth.size());
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(edges[i].lost, 0u);
    EXPECT_FALSE(edges[i].frame.overrun());
    const double error = static_cast<double>(edges[i].ticks) + 0.5 - truth[i];
    EXPECT_LE(std::abs(error), 0.5);
    sum += error;
    squares += error * error;
  }
  const auto n = static_cast<double>(truth.size());
  const double rms = std::sqrt(squares / n), expected = 1 / std::sqrt(12.0);
  RecordProperty("edges", static_cast<int>(truth.size()));
  RecordProperty("rms_ns", std::to_string(rms / tick_hz * 1e9));
  // The variance of a square of a uniform error: 1/180; five standard deviations.
  EXPECT_NEAR(rms * rms, expected * expected, 5 * std::sqrt(1.0 / 180 / n));
  EXPECT_NEAR(sum / n, 0, 5 * expected / std::sqrt(n));
}

TEST(Device, BothEdgesOfAnExposureCarryItsNumber) {
  Device device;
  std::vector<PinChange> changes;
  // Exposures that change from frame to frame, on all cameras at once.
  const int frames = static_cast<int>(length / 60'000);
  for (int f = 0; f < frames; ++f)
    for (int cam = 0; cam < TAKT_CAMERAS; ++cam) {
      const std::int64_t start = 5000 + f * 60'000 + 7 * cam;
      changes.push_back({start - 2, GatewarePin::exposure, cam, true});
      changes.push_back({start + 1000 + 500 * (f % 50) - 2, GatewarePin::exposure, cam, false});
    }
  sort(changes);
  device.run(changes, length);
  const auto heard = hear(device);
  for (int cam = 0; cam < TAKT_CAMERAS; ++cam) {
    const auto edges = heard.of(wire::Kind::exposure, cam);
    ASSERT_EQ(edges.size(), 2u * static_cast<unsigned>(frames));
    for (int f = 0; f < frames; ++f) {
      const auto &start = edges[static_cast<std::size_t>(2 * f)], &end = edges[static_cast<std::size_t>(2 * f + 1)];
      ASSERT_EQ(start.ticks, 5000 + f * 60'000 + 7 * cam);
      ASSERT_EQ(end.ticks - start.ticks, 1000 + 500 * (f % 50));
      ASSERT_TRUE(start.frame.level());
      ASSERT_FALSE(end.frame.level());
      ASSERT_EQ(start.frame.payload, static_cast<unsigned>(f + 1));
      ASSERT_EQ(end.frame.payload, start.frame.payload);
    }
  }
}

/// The same bytes as the decoder's test: what the device says first, and a command as it stands in the file.
TEST(Device, SpeaksTheGoldenVectors) {
  Device device;
  std::vector<PinChange> changes;
  append_uart(changes, GatewarePin::host, wire_vector("command", "write_enable").bytes, 6000, bit);
  device.run(changes, 20'000);
  std::vector<std::uint8_t> first;
  for (std::size_t i = 0; i < wire::frame_size; ++i) first.push_back(device.sent.at(i).byte);
  EXPECT_EQ(first, wire_vector("frame", "first_heartbeat").bytes);
  const auto answers = hear(device).of(wire::Kind::reply);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].frame.payload, 0x00FF00FFu);
}

/// A read, writes with their answers, refusals, a command with a wrong sum.
TEST(Device, AnswersCommands) {
  Device device;
  std::vector<PinChange> changes;
  using wire::Operation, wire::Status;
  struct Case {
    wire::Command command;
    Status status;
    std::uint32_t value;
  };
  const std::vector<Case> cases{
      {{Operation::read, wire::reg::id, 1, 0}, Status::ok, wire::identity},
      {{Operation::read, wire::reg::clock_hz, 2, 0}, Status::ok, 48'000'000},
      {{Operation::write, wire::reg::enable, 3, 0x00FF00FF}, Status::ok, 0x00FF00FF},
      {{Operation::read, wire::reg::enable, 4, 0}, Status::ok, 0x00FF00FF},
      {{Operation::write, wire::reg::clock_hz, 5, 1}, Status::read_only, 48'000'000},
      {{Operation::read, 0x77, 6, 0}, Status::no_register, 0},
      {{Operation::write, 0x13, 7, 9}, Status::no_register, 0},
      {{static_cast<Operation>(9), wire::reg::id, 8, 0}, Status::unknown, 0},
      {{Operation::write, wire::reg::run, 9, 1}, Status::ok, 1},
      {{Operation::write, wire::reg::trigger, 10, 4798}, Status::ok, 4798},
      {{Operation::read, wire::reg::run, 11, 0}, Status::ok, 0},  // stopped by the write to the trigger
  };
  std::int64_t cycle = 2000;
  for (const auto& c : cases) cycle = say(changes, c.command, cycle) + 6000;
  auto broken = wire::encode(wire::Command{Operation::write, wire::reg::enable, 12, 0});
  broken[6] ^= 4;
  cycle = append_uart(changes, GatewarePin::host, broken, cycle, bit) + 6000;
  cycle = say(changes, {Operation::read, wire::reg::enable, 13, 0}, cycle);
  device.run(changes, cycle + 12'000);
  const auto answers = hear(device).of(wire::Kind::reply);
  ASSERT_EQ(answers.size(), cases.size() + 1);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto& f = answers[i].frame;
    EXPECT_EQ(f.sequence, cases[i].command.token << 8 | cases[i].command.address) << i;
    EXPECT_EQ(f.channel, static_cast<int>(cases[i].status)) << i;
    const bool has_value = cases[i].status == Status::ok || cases[i].status == Status::read_only;
    if (has_value) {
      EXPECT_EQ(f.payload, cases[i].value) << i;
    }
  }
  EXPECT_EQ(answers.back().frame.payload, 0x00FF00FFu) << "a command with a wrong sum must change nothing";
}

/// Period, phase and width as they were set; the answer to `run` is the common zero; a capture that is wired to a
/// trigger gives its very stamp.
TEST(Device, TriggersKeepTheirPhase) {
  Device device;
  device.loop_trigger0_to_imu1 = TAKT_IMUS > 1;
  std::vector<PinChange> changes;
  std::int64_t cycle = 2000;
  std::vector<wire::TriggerSetting> settings{{9600, 0, 480}, {19200, 4800, 10}, {48000, 47999, 100}, {7, 3, 2}};
  settings.resize(std::min<std::size_t>(settings.size() - 1, TAKT_TRIGGERS));
  for (std::size_t k = 0; k < settings.size(); ++k)
    for (const auto& c : wire::trigger_commands(static_cast<int>(k), settings[k]))
      cycle = say(changes, c, cycle) + 6000;
  const std::uint32_t all = (1u << settings.size()) - 1;
  cycle = say(changes, {wire::Operation::write, wire::reg::run, 77, all}, cycle);
  device.run(changes, cycle + 300'000);
  const auto heard = hear(device);
  const auto answers = heard.of(wire::Kind::reply);
  ASSERT_EQ(answers.size(), 3 * settings.size() + 1);
  const std::int64_t zero = answers.back().ticks;
  for (std::size_t k = 0; k < settings.size(); ++k) {
    const auto reports = heard.of(wire::Kind::trigger, static_cast<int>(k));
    std::vector<std::int64_t> pins;
    for (const auto& r : device.rises)
      if (r.trigger == static_cast<int>(k)) pins.push_back(r.cycle + 2);
    ASSERT_GE(reports.size(), 5u);
    for (std::size_t i = 0; i < reports.size(); ++i) {
      ASSERT_EQ(reports[i].ticks, zero + settings[k].phase + static_cast<std::int64_t>(i) * settings[k].period);
      ASSERT_EQ(reports[i].ticks, pins[i]);
    }
  }
  if (device.loop_trigger0_to_imu1) {
    const auto sent = heard.of(wire::Kind::trigger, 0), caught = heard.of(wire::Kind::data_ready, 1);
    ASSERT_GE(caught.size(), 5u);
    for (std::size_t i = 0; i < caught.size(); ++i) EXPECT_EQ(caught[i].ticks, sent[i].ticks);
  }
}

/// Two-way exchanges, some of them behind a queue of other frames: both ends are told to the tick.
TEST(Device, ExchangesTime) {
  Device device;
  std::vector<PinChange> changes;
  std::vector<std::int64_t> requests;
  std::int64_t cycle = 4000;
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < i; ++k) {
      changes.push_back({cycle + 40 * k, GatewarePin::imu, 0, true});
      changes.push_back({cycle + 40 * k + 20, GatewarePin::imu, 0, false});
    }
    cycle += 997;
    requests.push_back(cycle + 2);
    cycle = say(changes, {wire::Operation::exchange, 0, static_cast<std::uint8_t>(200 + i), 0}, cycle) + 30'000;
  }
  sort(changes);
  device.run(changes, cycle);
  std::vector<wire::Exchange> found;
  std::vector<std::int64_t> starts;  // of the frames, as the pin shows them
  GatewareDecoder decoder;
  decoder.feed(device.bytes());
  while (auto e = decoder.next())
    if (e->frame.kind == wire::Kind::exchange) {
      found.push_back(wire::exchange_of(e->frame));
      starts.push_back(device.sent[e->byte].stamp);
    }
  ASSERT_EQ(found.size(), requests.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].token, 200 + i);
    EXPECT_EQ(static_cast<std::int64_t>(found[i].request), requests[i]);
    ASSERT_TRUE(found[i].answer);
    EXPECT_EQ(static_cast<std::int64_t>(*found[i].answer), starts[i]);
  }
}

/// Frames leave every 3220 clocks. Just below that nothing is lost; above it the losses are told, and counted to the
/// last.
TEST(Device, LosesNothingUpToTheDocumentedRateAndSaysWhatItLosesBeyond) {
#ifdef TAKT_NETLIST
  constexpr std::int64_t span = 300'000, tail = 100'000;
  const std::vector<double> loads{0.98};  // what it loses beyond takes longer than a netlist can
#else
  constexpr std::int64_t span = 3'000'000, tail = 300 * 3300;
  const std::vector<double> loads{0.98, 1.5};
#endif
  for (const double load : loads) {
    Device device;
    std::vector<PinChange> changes;
    std::int64_t sent = 0;
    for (double t = 4000; t < span; t += 20 * 161 / load, ++sent) {
      changes.push_back({static_cast<std::int64_t>(t), GatewarePin::imu, 0, true});
      changes.push_back({static_cast<std::int64_t>(t) + 900, GatewarePin::imu, 0, false});
    }
    const auto last = span + tail;
    changes.push_back({last, GatewarePin::imu, 0, true});
    ++sent;
    device.run(changes, last + 10'000);
    const auto heard = hear(device);
    const auto edges = heard.of(wire::Kind::data_ready, 0);
    std::int64_t lost = 0;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      lost += static_cast<std::int64_t>(edges[i].lost);
      EXPECT_EQ(edges[i].frame.overrun(), edges[i].lost > 0) << "the flag and the numbers must agree";
    }
    EXPECT_EQ(static_cast<std::int64_t>(edges.size()) + lost, sent);
    const bool overrun_expected = load > 1;
    if (load < 1) {
      EXPECT_EQ(lost, 0);
    }
    if (overrun_expected) {
      EXPECT_GT(lost, 0);
      EXPECT_GT(heard.health.losses_told, 0u) << "the heartbeat tells of losses too";
    }
    RecordProperty(load < 1 ? "lost_below" : "lost_above", static_cast<int>(lost));
  }
}

/// Edges closer together than the scanner's round: the second one of a pair is lost, and the next event says so.
TEST(Device, SaysThatEdgesCameTooFast) {
  Device device;
  std::vector<PinChange> changes;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t t = 4000 + 10'000 * i;
    changes.insert(changes.end(), {{t, GatewarePin::imu, 0, true},
                                   {t + 1, GatewarePin::imu, 0, false},
                                   {t + 2, GatewarePin::imu, 0, true},
                                   {t + 100, GatewarePin::imu, 0, false}});
  }
  device.run(changes, 220'000);
  const auto edges = hear(device).of(wire::Kind::data_ready, 0);
  ASSERT_GE(edges.size(), 20u);
  std::size_t told = 0;
  for (const auto& e : edges) told += e.frame.overrun();
  EXPECT_GE(edges.size() + told, 38u);
  EXPECT_GT(told, 10u);
}

TEST(Device, HearsTheReceiver) {
#ifdef TAKT_REDUCED
  constexpr std::int64_t pause = 150'000;  // without a UART the line is idle after 31 · 4096 clocks
#else
  constexpr std::int64_t pause = 20'000;
#endif
  Device device;
  std::vector<PinChange> changes;
  const std::string text = "$GNRMC,123519.00,A\r\n";
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  std::int64_t cycle = say(changes, {wire::Operation::write, wire::reg::gnss_bit, 1, 50}, 170'000);
  std::vector<std::int64_t> starts;
  for (int i = 0; i < 3; ++i) {
    cycle += pause;
    starts.push_back(cycle + 2);
    cycle = append_uart(changes, GatewarePin::gnss, bytes.first(text.size() - static_cast<unsigned>(i)), cycle, 50);
  }
  device.run(changes, cycle + 30'000);
  const auto heard = hear(device);
  const auto bursts = heard.of(wire::Kind::gnss_start);
  ASSERT_EQ(bursts.size(), starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) EXPECT_EQ(bursts[i].ticks, starts[i]);
  std::string said;
  for (const auto& e : heard.of(wire::Kind::gnss_text))
    for (unsigned i = 0; i <= (e.frame.flags & wire::detail_mask); ++i)
      said.push_back(static_cast<char>(e.frame.payload >> (8 * i)));
#ifdef TAKT_REDUCED
  EXPECT_EQ(said, "") << "the reduced device stamps the beginnings only";
#else
  EXPECT_EQ(said, text + text.substr(0, text.size() - 1) + text.substr(0, text.size() - 2));
#endif
}

#ifndef TAKT_REDUCED
/// Everything at once, at random: the fast model must give the same bytes in the same clocks.
TEST(Device, IsWhatTheFastModelSays) {
#ifdef TAKT_NETLIST
  const int runs = 1;
#else
  const int runs = 6;
#endif
  for (int seed = 1; seed <= runs; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "chaos");
    std::vector<PinChange> changes;
    const std::int64_t end = 1'500'000;
    // Loads from idle to three times what the UART carries, edges as close as one clock.
    const double load = 0.3 * seed * seed;
    for (int line = 0; line < 7; ++line) {
      bool level = false;
      double t = 100 + 3000 * random.uniform();
      while (t < static_cast<double>(end) - 1'000) {
        level = !level;
        const GatewarePin pin = line == 0 ? GatewarePin::pps : line < 3 ? GatewarePin::imu : GatewarePin::exposure;
        changes.push_back({static_cast<std::int64_t>(t), pin, line < 3 ? std::max(0, line - 1) : line - 3, level});
        t += random.chance(0.1) ? 1 + 30 * random.uniform() : 20'000 / load * random.uniform();
      }
    }
    std::int64_t cycle = 160'000;
    say(changes, {wire::Operation::write, wire::reg::gnss_bit, 1, 40}, cycle);
    for (cycle = 170'000; cycle < end - 40'000;) {
      std::vector<std::uint8_t> text(static_cast<std::size_t>(1 + 20 * random.uniform()));
      for (auto& b : text) b = static_cast<std::uint8_t>(random.bits());
      cycle =
          append_uart(changes, GatewarePin::gnss, text, cycle, 40) + static_cast<std::int64_t>(3000 * random.uniform());
    }
    std::uint8_t token = 2;
    bool set = false;
    for (cycle = 165'000; cycle < end - 40'000;) {
      const double dice = random.uniform();
      wire::Command c{wire::Operation::exchange, 0, token++, 0};
      if (!set || dice < 0.1) {
        const auto period = static_cast<std::uint32_t>(200 + 40'000 * random.uniform());
        const wire::TriggerSetting setting{period, static_cast<std::uint32_t>(random.uniform() * period),
                                           1 + period / 3};
        const int k = static_cast<int>(4 * random.uniform());
        for (const auto& w : wire::trigger_commands(k, setting)) cycle = say(changes, w, cycle) + 4000;
        c = {wire::Operation::write, wire::reg::run, token++, static_cast<std::uint32_t>(random.bits() & 15)};
        set = true;
      } else if (dice < 0.3) {
        c = {wire::Operation::read, static_cast<std::uint8_t>(random.bits() & 31), token++, 0};
      } else if (dice < 0.35) {
        c = {wire::Operation::write, wire::reg::enable, token++,
             static_cast<std::uint32_t>(random.bits() | 0x00F00002)};
      } else if (dice < 0.4) {
        c = {wire::Operation::write, wire::reg::invert, token++, static_cast<std::uint32_t>(random.bits() & 0xFFF1)};
      }
      auto bytes = wire::encode(c);
      if (random.chance(0.05)) bytes[5] ^= 1;
      // Sometimes before the last answer is through.
      cycle = append_uart(changes, GatewarePin::host, bytes, cycle, bit) +
              static_cast<std::int64_t>(random.chance(0.2) ? 1 : 200 + 30'000 * random.uniform());
    }
    sort(changes);
    Device device;
    device.run(changes, end);
    GatewareBuild build;
    build.heartbeat_log2 = TAKT_HEARTBEAT_LOG2;
    GatewareModel model(build);
    std::vector<SentByte> expected;
    model.run(changes, end, [&](const SentByte& b) { expected.push_back(b); });
    ASSERT_GT(device.sent.size(), 2000u);
    ASSERT_GE(expected.size(), device.sent.size());
    for (std::size_t i = 0; i < device.sent.size(); ++i) {
      if (device.sent[i] == expected[i]) continue;
      const auto decode = [&](auto& bytes) {
        const std::size_t at = i / 20 * 20;
        std::array<std::uint8_t, 20> frame{};
        for (std::size_t k = 0; k < 20 && at + k < bytes.size(); ++k) frame[k] = bytes[at + k].byte;
        const wire::Frame f = wire::decode_frame(frame).frame;
        return "kind " + std::to_string(static_cast<int>(f.kind)) + " channel " + std::to_string(f.channel) +
               " flags " + std::to_string(f.flags) + " sequence " + std::to_string(f.sequence) + " stamp " +
               std::to_string(f.stamp) + " payload " + std::to_string(f.payload) + " at " +
               std::to_string(bytes[at].stamp);
      };
      FAIL() << "seed " << seed << ", byte " << i << " of " << device.sent.size() << "\nRTL   " << decode(device.sent)
             << "\nmodel " << decode(expected);
    }
  }
}
#endif

}  // namespace
}  // namespace takt::sim
