// SPDX-License-Identifier: Apache-2.0
// The whole chain: pendulum -> pins -> gateware -> bytes -> decoder -> pulses and NMEA -> UTC -> streams -> takt's
// pendulum estimator, which must find the simulated IMU's delay. The gateware is its fast C++ model, which gateware/sim
// holds to the RTL byte for byte; where Verilator is there, the beginning of this very run goes through the RTL too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#ifdef TAKT_DEVICE
#include TAKT_DEVICE_HEADER
#include "gateware/sim/rig.h"
#endif
#include "takt/estimators/clock/pps_clock.h"
#include "takt/estimators/pendulum/pendulum.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gnss_log.h"
#include "takt/simulation/gateware_model.h"
#include "takt/simulation/pendulum_rig.h"
#include "takt/simulation/random.h"
#include "takt/time/time_scales.h"

namespace takt {
namespace {

constexpr int heartbeat_log2 = 16;  // of the verilated device
constexpr std::int64_t second_ns = 1'000'000'000;

/// The board's crystal: 21.7 ppm fast, and warming up by 0.4 ppm over the run.
class Crystal {
 public:
  explicit Crystal(std::int64_t on_utc_ns) : on_ns_(on_utc_ns) {}
  [[nodiscard]] double ticks(std::int64_t utc_ns) const {
    const double t = static_cast<double>(utc_ns - on_ns_) * 1e-9;
    const double warming = 0.4e-6 * (t - 20 * (1 - std::exp(-t / 20)));
    return 48e6 * (t * (1 + 21.7e-6) + warming);
  }

 private:
  std::int64_t on_ns_;
};

std::string rmc(std::int64_t utc_s) {
  const std::int64_t day = utc_s % 86400;
  char body[80];
  // The date of the rig's epoch, 14 November 2023.
  std::snprintf(body, sizeof body, "GNRMC,%02d%02d%02d.00,A,4717.11,N,00833.91,E,0.0,,141123,,,A",
                static_cast<int>(day / 3600), static_cast<int>(day / 60 % 60), static_cast<int>(day % 60));
  unsigned sum = 0;
  for (const char* c = body; *c != '\0'; ++c) sum ^= static_cast<unsigned char>(*c);
  char out[100];
  std::snprintf(out, sizeof out, "$%s*%02X\r\n", body, sum);
  return out;
}

struct Wired {
  PendulumRecording truth;
  std::vector<PinChange> changes;
  std::int64_t end = 0;
};

/// The rig's sensors and a receiver on the board's pins. The camera's exposure changes from frame to frame, its dial is
/// read at the middle.
Wired wire_up(const PendulumRig& rig, std::uint64_t seed) {
  Wired out;
  out.truth = simulate_pendulum(rig, seed);
  const std::int64_t on = rig.epoch_ns - 3 * second_ns - 123'456'789;
  const Crystal crystal(on);
  Random random(seed, "wires");
  const auto pulse = [&](GatewarePin pin, std::int64_t from_ns, std::int64_t to_ns) {
    out.changes.push_back({cycle_of_edge(crystal.ticks(from_ns)), pin, 0, true});
    out.changes.push_back({cycle_of_edge(crystal.ticks(to_ns)), pin, 0, false});
  };
  for (const Stamp s : out.truth.imus[0].stamps) pulse(GatewarePin::imu, to_ns(s), to_ns(s) + 50'000);
  for (const Stamp s : out.truth.dial.stamps) {
    const auto half = static_cast<std::int64_t>(100'000 + 900'000 * random.uniform());
    pulse(GatewarePin::exposure, to_ns(s) - half, to_ns(s) + half);
  }
  const std::int64_t last = rig.epoch_ns + static_cast<std::int64_t>(rig.duration_s * 1e9) + second_ns / 2;
  for (std::int64_t utc = on / second_ns + 1; utc * second_ns < last; ++utc) {
    // A receiver's pulse scatters by some ns; its message comes a fifth of a second later.
    const std::int64_t at = utc * second_ns + static_cast<std::int64_t>(std::lround(6 * random.normal()));
    pulse(GatewarePin::pps, at, at + 100'000'000);
    const std::string text = rmc(utc);
    append_uart(out.changes, GatewarePin::gnss, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                cycle_of_edge(crystal.ticks(at + 200'000'000 + static_cast<std::int64_t>(30e6 * random.uniform()))),
                5000);
  }
  std::stable_sort(out.changes.begin(), out.changes.end(), [](auto& a, auto& b) { return a.cycle < b.cycle; });
  out.end = static_cast<std::int64_t>(crystal.ticks(last + second_ns / 2));
  return out;
}

const PulseStream& stream(const GatewareCapture& capture, const std::string& name) {
  for (const PulseStream& s : capture.pulses)
    if (s.name == name) return s;
  throw std::runtime_error("no stream " + name);
}

TEST(Chain, FindsTheImusDelayThroughTheGateware) {
  PendulumRig rig = pendulum_rig("ordinary");
  rig.duration_s = 60;
  const std::uint64_t seed = 11;
  const Wired wired = wire_up(rig, seed);

  GatewareBuild build;
  build.heartbeat_log2 = heartbeat_log2;
  GatewareModel model(build);
  std::string bytes;
  std::vector<SentByte> sent;
  model.run(wired.changes, wired.end, [&](const SentByte& b) {
    bytes.push_back(static_cast<char>(b.byte));
    if (sent.size() < 40'000) sent.push_back(b);
  });

#ifdef TAKT_DEVICE
  sim::Rig<TAKT_DEVICE> rtl;
  rtl.run(wired.changes, 9'000'000);
  ASSERT_GT(rtl.sent.size(), 2500u);
  for (std::size_t i = 0; i < rtl.sent.size(); ++i)
    ASSERT_EQ(rtl.sent[i], sent[i]) << "RTL and model part at byte " << i;
#endif

  // What a user has: the bytes, and the values that the host read from its sensors, in order.
  const GatewareCapture capture = read_gateware_capture(bytes, "rig.takt");
  EXPECT_EQ(capture.health.bad_crc + capture.health.garbage_bytes, 0u);
  for (const auto& c : capture.health.channels) EXPECT_EQ(c.lost + c.overruns, 0u);
  LabelStream labels;
  GnssDecoder gnss;
  for (std::size_t i = 0; i < capture.bursts.size(); ++i) {
    const std::size_t first = capture.bursts[i].first;
    const std::size_t next = i + 1 < capture.bursts.size() ? capture.bursts[i + 1].first : capture.gnss_text.size();
    gnss.feed(std::string_view(capture.gnss_text).substr(first, next - first), capture.bursts[i].ticks, labels);
  }
  gnss.finish(labels);
  ASSERT_GE(labels.labels.size(), 60u);

  const PpsResult clock = discipline(stream(capture, "pps"), {labels});
  ASSERT_EQ(clock.estimate.verdict, Verdict::trusted)
      << (clock.estimate.reasons.empty() ? "" : clock.estimate.reasons.front());
  const ClockMap<> to_utc = clock.estimate.clock_map();
  const auto utc = [&](std::int64_t ticks_twice) {
    const auto ns = static_cast<std::int64_t>(std::llround(static_cast<long double>(ticks_twice) * 0.5e9L /
                                                           static_cast<long double>(capture.counter.tick_hz)));
    return Stamp(to_utc(from_ns<SensorClock>(ns)).time_since_epoch());
  };

  AngleStream dial = wired.truth.dial;
  const StrobeStream& strobes = capture.strobes.at(0);
  ASSERT_EQ(strobes.size(), dial.size());
  double worst = 0;
  for (std::size_t i = 0; i < dial.size(); ++i) {
    const Stamp found = utc(strobes.strobes[i].start_ticks + strobes.strobes[i].end_ticks + 1);
    worst = std::max(worst, std::abs(to_seconds(found - dial.stamps[i])));
    dial.stamps[i] = found;
  }
  ImuStream imu = wired.truth.imus[0];
  const PulseStream& ready = stream(capture, "imu0");
  ASSERT_EQ(ready.size(), imu.size());
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const Stamp found = utc(2 * ready.pulses[i].ticks + 1);
    worst = std::max(worst, std::abs(to_seconds(found - imu.stamps[i])));
    imu.stamps[i] = found;
  }
  RecordProperty("worst_stamp_ns", std::to_string(worst * 1e9));
  EXPECT_LT(worst, 200e-9) << "stamps on UTC";

  const Estimate found = calibrate_pendulum(dial, imu);
  const Estimate& truth = wired.truth.truth[0];
  ASSERT_EQ(found.verdict, Verdict::trusted) << (found.reasons.empty() ? "" : found.reasons.front());
  const double error = to_seconds(*found.offset - *truth.offset);
  RecordProperty("delay_error_us", std::to_string(error * 1e6));
  RecordProperty("delay_sigma_us", std::to_string(found.sigma_s.value_or(0) * 1e6));
  EXPECT_LT(std::abs(error), 5 * found.sigma_s.value_or(0));
  EXPECT_LT(found.sigma_s.value_or(1), 20e-6);
}

}  // namespace
}  // namespace takt
