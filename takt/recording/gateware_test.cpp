// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gateware.h"

#include <gtest/gtest.h>

#include "gateware/sim/vectors.h"
#include "takt/recording/open_recording.h"
#include "takt/simulation/random.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint, testing_tools::TemporaryFolder;

std::string text(const wire::Frame& f) {
  const auto bytes = wire::encode(f);
  return {bytes.begin(), bytes.end()};
}
wire::Frame heartbeat(wire::Word word, std::uint16_t sequence, std::uint64_t stamp, std::uint32_t payload) {
  return {wire::Kind::heartbeat, static_cast<std::uint8_t>(word), 0, sequence, stamp, payload};
}
wire::Frame imu(std::uint16_t sequence, std::uint64_t stamp, std::uint8_t flags = wire::flag_level) {
  return {wire::Kind::data_ready, 0, flags, sequence, stamp, 0};
}
wire::Frame exposure(bool start, std::uint32_t frame, std::uint16_t sequence, std::uint64_t stamp) {
  return {wire::Kind::exposure, 0, static_cast<std::uint8_t>(start ? wire::flag_level : 0), sequence, stamp, frame};
}
std::vector<GatewareEvent> all(GatewareDecoder& decoder) {
  std::vector<GatewareEvent> out;
  while (auto e = decoder.next()) out.push_back(*e);
  return out;
}
std::vector<GatewareEvent> decode(const std::string& bytes) {
  GatewareDecoder decoder;
  decoder.feed(bytes);
  return all(decoder);
}
const GatewareHealth::Channel& channel(const GatewareHealth& health, wire::Kind kind) {
  for (const auto& c : health.channels)
    if (c.kind == kind) return c;
  throw std::runtime_error("no such channel");
}

TEST(Wire, GoldenVectorsBothWays) {
  std::size_t frames = 0, commands = 0;
  for (const auto& v : sim::wire_vectors()) {
    if (v.type == "frame") {
      ASSERT_EQ(v.fields.size(), 6u) << v.name;
      const wire::Frame f{static_cast<wire::Kind>(v.fields[0]),
                          static_cast<std::uint8_t>(v.fields[1]),
                          static_cast<std::uint8_t>(v.fields[2]),
                          static_cast<std::uint16_t>(v.fields[3]),
                          v.fields[4],
                          static_cast<std::uint32_t>(v.fields[5])};
      const auto bytes = wire::encode(f);
      EXPECT_EQ(std::vector(bytes.begin(), bytes.end()), v.bytes) << v.name;
      ASSERT_EQ(v.bytes.size(), wire::frame_size);
      const auto back = wire::decode_frame(std::span(v.bytes).first<wire::frame_size>());
      EXPECT_EQ(back.fault, wire::Fault::none) << v.name;
      EXPECT_EQ(back.frame, f) << v.name;
      ++frames;
    } else {
      const auto bytes =
          wire::encode(wire::Command{static_cast<wire::Operation>(v.fields[0]), static_cast<std::uint8_t>(v.fields[1]),
                                     static_cast<std::uint8_t>(v.fields[2]), static_cast<std::uint32_t>(v.fields[3])});
      EXPECT_EQ(std::vector(bytes.begin(), bytes.end()), v.bytes) << v.name;
      ++commands;
    }
  }
  EXPECT_GE(frames, 10u);
  EXPECT_GE(commands, 4u);
}

TEST(Wire, EveryFlippedBitOfAFrameIsSeen) {
  const auto good = wire::encode(imu(77, 123456789012345));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_NE(wire::decode_frame(bad).fault, wire::Fault::none) << bit;
  }
}

TEST(Wire, TriggersThatCannotBeAreRefused) {
  EXPECT_EQ(wire::trigger_commands(1, {1000, 100, 950})[2].value, 50u) << "a pulse may pass the end of its period";
  EXPECT_THROW((void)wire::trigger_commands(0, {1, 0, 1}), std::invalid_argument);
  EXPECT_THROW((void)wire::trigger_commands(0, {100, 100, 1}), std::invalid_argument);
  EXPECT_THROW((void)wire::trigger_commands(0, {100, 0, 100}), std::invalid_argument);
  EXPECT_THROW((void)wire::trigger_commands(9, {100, 0, 10}), std::invalid_argument);
}

TEST(GatewareDecoder, TakesPiecesOfAnySizeAndFindsItsWayThroughGarbage) {
  Random random(3, "garbage");
  std::string bytes;
  std::size_t garbage = 0;
  for (std::uint16_t i = 0; i < 500; ++i) {
    const auto junk = static_cast<std::size_t>(random.chance(0.3) ? 1 + random.bits() % 30 : 0);
    for (std::size_t k = 0; k < junk; ++k) bytes.push_back(static_cast<char>(1 + random.bits() % 200));
    garbage += junk;
    bytes += std::string(random.bits() % 3, '\0');
    bytes += text(imu(i, 1000u * i));
  }
  GatewareDecoder decoder;
  std::vector<GatewareEvent> events;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = 1 + random.bits() % 50;
    decoder.feed(std::string_view(bytes).substr(at, size));
    at += size;
    for (auto& e : all(decoder)) events.push_back(e);
  }
  ASSERT_EQ(events.size(), 500u);
  EXPECT_EQ(decoder.health().garbage_bytes, garbage);
  EXPECT_EQ(channel(decoder.health(), wire::Kind::data_ready).lost, 0u);
  EXPECT_EQ(bytes.substr(events[250].byte, 20), text(imu(250, 250'000)));
}

TEST(GatewareDecoder, CountsWhatIsLostRepeatedAndOverrun) {
  std::string bytes;
  for (const int i : {65533, 65534, 0, 1, 1, 5}) bytes += text(imu(static_cast<std::uint16_t>(i), 1000u));
  bytes += text(imu(6, 1000, wire::flag_overrun));
  bytes[3 * wire::frame_size + 9] ^= 1;  // number 1 is broken; its repetition stands in for it
  GatewareDecoder decoder;
  decoder.feed(bytes);
  const auto events = all(decoder);
  ASSERT_EQ(events.size(), 6u);
  EXPECT_EQ(events[2].lost, 1u) << "65535 is missing, across the wrap";
  const auto health = decoder.health();
  EXPECT_EQ(channel(health, wire::Kind::data_ready).lost, 1u + 3u);
  EXPECT_EQ(channel(health, wire::Kind::data_ready).overruns, 1u);
  EXPECT_EQ(health.bad_crc, 1u);
}

TEST(GatewareDecoder, ExtendsACounterAcrossItsWraps) {
  for (const int bits : {32, 40, 48}) {
    std::string bytes = text(heartbeat(wire::Word::clock_hz, 8, 10, 48'000'000)) +
                        text(heartbeat(wire::Word::features, 9, 11, static_cast<std::uint32_t>(bits)));
    const std::uint64_t range = std::uint64_t{1} << bits;
    std::vector<std::uint64_t> truth;
    for (std::uint64_t k = 1; k < 12; ++k) {
      truth.push_back(k * (range / 3) + 5);
      truth.push_back(k * (range / 3));  // a little backwards: frames leave the device nearly in order
    }
    for (std::size_t i = 0; i < truth.size(); ++i) bytes += text(imu(static_cast<std::uint16_t>(i), truth[i] % range));
    const auto events = decode(bytes);
    ASSERT_EQ(events.size(), truth.size() + 2);
    for (std::size_t i = 0; i < truth.size(); ++i)
      EXPECT_EQ(events[i + 2].ticks, static_cast<std::int64_t>(truth[i])) << bits;
    EXPECT_EQ(events.back().boot, 0);
  }
}

TEST(GatewareDecoder, SeesThatTheDeviceStartedAnew) {
  const std::string before =
      text(heartbeat(wire::Word::clock_hz, 500, 9'000'000'000, 48'000'000)) + text(imu(4000, 9'000'000'100));
  const std::string hello = text(heartbeat(wire::Word::clock_hz, 0, 1, 48'000'000));
  for (const bool hello_lost : {false, true}) {
    GatewareDecoder decoder;
    decoder.feed(before + (hello_lost ? "" : hello) + text(imu(0, 5000)) + text(imu(1, 6000)));
    const auto events = all(decoder);
    EXPECT_EQ(events.back().boot, 1);
    EXPECT_EQ(events.back().ticks, 6000);
    EXPECT_EQ(decoder.health().resets, 1u);
    EXPECT_EQ(channel(decoder.health(), wire::Kind::data_ready).lost, 0u) << "numbers start anew too";
  }
}

TEST(GatewareDecoder, AnotherVersionIsCountedAndNotRead) {
  auto bytes = wire::encode(imu(1, 2));
  bytes[2] = static_cast<std::uint8_t>(0x20 | 4);
  const auto crc = wire::crc16(std::span(bytes).subspan(2, 16));
  bytes[18] = static_cast<std::uint8_t>(crc >> 8);
  bytes[19] = static_cast<std::uint8_t>(crc);
  const std::string message = complaint([&] {
    (void)read_gateware_capture(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "x.takt");
  });
  EXPECT_NE(message.find("another version"), std::string::npos) << message;
}

std::string board(std::uint64_t stamp = 0) {
  return text(heartbeat(wire::Word::clock_hz, 100, stamp, 48'000'000)) +
         text(heartbeat(wire::Word::features, 101, stamp + 1, 0x80144240));
}

TEST(GatewareCapture, MiddlesComeFromTheSameFrameOnly) {
  std::string bytes = board();
  bytes += text(exposure(true, 1, 0, 48'000)) + text(exposure(false, 1, 1, 96'000));
  bytes += text(exposure(true, 2, 2, 148'000));                                         // its end is lost
  bytes += text(exposure(true, 3, 4, 248'000)) + text(exposure(false, 3, 5, 254'000));  // half the exposure
  bytes += text(exposure(false, 4, 7, 360'000));                                        // its start is lost
  bytes += text(exposure(true, 5, 8, 448'000)) + text(exposure(false, 5, 9, 496'000));
  const Recording recording = read_gateware(bytes, "x.takt");
  ASSERT_EQ(recording.cameras.size(), 1u);
  const CameraStream& cam = recording.cameras[0];
  ASSERT_EQ(cam.size(), 3u);
  EXPECT_EQ(to_ns(cam.stamps[0]), 1'500'010);  // (1 ms + 2 ms) / 2 and half a tick
  EXPECT_EQ(to_ns(cam.stamps[1]), 5'229'177);
  EXPECT_NEAR(cam.exposures_s[0], 1e-3, 2e-9);
  EXPECT_NEAR(cam.exposures_s[1], 0.125e-3, 2e-9);
  const auto says = [&](const char* words) {
    return std::any_of(recording.notes.begin(), recording.notes.end(),
                       [&](const std::string& n) { return n.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(says("2 exposures of which only one edge came"));
  EXPECT_TRUE(says("2 events missing"));
}

TEST(GatewareCapture, ExchangesWithTheHostsMarks) {
  std::string bytes = board();
  const auto mark = [](wire::HostMark m, std::uint16_t token, std::uint64_t ns) {
    return text({wire::Kind::host, static_cast<std::uint8_t>(m), 0, token, ns, 0});
  };
  bytes += mark(wire::HostMark::request_sent, 9, 1'700'000'000'000'000'000);
  bytes += text({wire::Kind::exchange, 0, 0, 480, 48'000'480, (9u << 24) | 4320});
  bytes += mark(wire::HostMark::answer_received, 9, 1'700'000'000'000'400'000);
  const auto capture = read_gateware_capture(bytes, "x.takt");
  ASSERT_EQ(capture.exchanges.size(), 1u);
  EXPECT_TRUE(capture.exchanges.two_way);
  EXPECT_EQ(capture.exchanges.pairs[0].request_ns, 1'700'000'000'000'000'000);
  EXPECT_EQ(capture.exchanges.pairs[0].device_ns, 1'000'050'010);  // the middle of 48 000 000 and 48 004 800
  EXPECT_EQ(capture.exchanges.pairs[0].arrival_ns, 1'700'000'000'000'400'000);
}

TEST(GatewareCapture, TextKeepsTheStampOfItsBurst) {
  std::string bytes = board();
  bytes += text({wire::Kind::gnss_start, 0, 0, 0, 1000, 0}) + text({wire::Kind::gnss_text, 0, 3, 0, 1100, 0x44434241});
  bytes += text({wire::Kind::gnss_start, 0, 0, 1, 9000, 0}) + text({wire::Kind::gnss_text, 0, 1, 1, 9100, 0x00004645});
  const auto capture = read_gateware_capture(bytes, "x.takt");
  EXPECT_EQ(capture.gnss_text, "ABCDEF");
  ASSERT_EQ(capture.bursts.size(), 2u);
  EXPECT_EQ(capture.bursts[1].first, 4u);
  EXPECT_EQ(capture.bursts[1].ticks, 9000);
}

TEST(GatewareCapture, SaysWhatIsMissing) {
  EXPECT_NE(complaint([] { (void)read_gateware_capture("not a frame at all, but long enough", "x"); }).find("no frame"),
            std::string::npos);
  EXPECT_NE(complaint([] { (void)read_gateware_capture(text(imu(0, 1)), "x"); }).find("clock's rate"),
            std::string::npos);
}

TEST(GatewareCapture, IsFoundByItsFrames) {
  const TemporaryFolder folder;
  const std::string path = folder.file(
      "rig.takt", "xx" + board() + text(exposure(true, 1, 0, 48'000)) + text(exposure(false, 1, 1, 96'000)));
  const Recording recording = open_recording(path);
  EXPECT_EQ(recording.format, "gateware capture");
  EXPECT_EQ(recording.cameras.size(), 1u);
  EXPECT_FALSE(looks_like_gateware(folder.file("other.bin", std::string(10'000, '\xD5'))));
}

}  // namespace
}  // namespace takt
