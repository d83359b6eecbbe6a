// SPDX-License-Identifier: Apache-2.0
// The device with SPI instead of UART, read by a host that takes it up and lays it down as it likes.
#include <Vspi.h>
#include <gtest/gtest.h>

#include <deque>

#include "takt/recording/gateware.h"
#include "takt/simulation/random.h"

namespace takt::sim {
namespace {

/// SCLK at an eighth of the device's clock, the fastest that the wire allows.
class SpiHost {
 public:
  SpiHost() {
    top_.clk_i = 0;
    top_.rst_ni = 0;
    top_.pps_i = 0;
    top_.gnss_rx_i = 1;
    top_.imu_ready_i = 0;
    top_.exposure_i = 0;
    top_.uart_rx_i = 1;
    top_.spi_sclk_i = 0;
    top_.spi_cs_ni = 1;
    top_.spi_mosi_i = 0;
    for (int i = 0; i < 8; ++i) tick();
    top_.rst_ni = 1;
    cycle_ = 0;
  }

  void wait(int clocks) {
    for (int i = 0; i < clocks; ++i) tick();
  }
  void select(bool on) {
    top_.spi_cs_ni = !on;
    wait(12);
  }
  /// One byte each way. `first_rise` is the cycle in which its first SCLK edge is seen.
  std::uint8_t exchange(std::uint8_t out) {
    std::uint8_t in = 0;
    for (int bit = 7; bit >= 0; --bit) {
      top_.spi_mosi_i = (out >> bit) & 1;
      wait(4);
      if (bit == 7) first_rise = cycle_;
      top_.spi_sclk_i = 1;
      EXPECT_TRUE(top_.spi_miso_enable_o);
      in = static_cast<std::uint8_t>((in << 1) | top_.spi_miso_o);
      wait(4);
      top_.spi_sclk_i = 0;
    }
    received.push_back(static_cast<char>(in));
    rises.push_back(first_rise);
    return in;
  }
  void pulse_imu() {
    edges.push_back(cycle_ + 2);
    top_.imu_ready_i = 1;
    tick();
    top_.imu_ready_i = 0;
  }

  std::string received;
  std::vector<std::int64_t> rises;  ///< one a received byte
  std::vector<std::int64_t> edges;  ///< true stamps
  std::int64_t first_rise = 0;

 private:
  void tick() {
    top_.clk_i = 0;
    top_.eval();
    top_.clk_i = 1;
    top_.eval();
    ++cycle_;
  }
  Vspi top_;
  std::int64_t cycle_ = 0;
};

TEST(Spi, CarriesFramesCommandsAndExchanges) {
  SpiHost host;
  Random random(5, "spi");
  std::deque<std::uint8_t> to_send;
  std::vector<std::int64_t> requests;
  std::vector<std::uint8_t> tokens;
  std::size_t since_command = 0;
  std::uint8_t token = 1;
  int reads = 0;
  for (int burst = 0; burst < 400; ++burst) {
    if (burst < 350) {
      host.wait(static_cast<int>(200 * random.uniform()));
      host.pulse_imu();
    }
    host.wait(static_cast<int>(300 * random.uniform()));
    host.select(true);
    const auto count = random.bits() % 60;
    for (std::size_t i = 0; i < count; ++i, ++since_command) {
      std::uint8_t out = 0;
      bool first = false;
      if (to_send.empty() && since_command > 400 && burst < 350 && count - i >= wire::command_size) {
        const bool read = random.chance(0.3);
        const wire::Command c{read ? wire::Operation::read : wire::Operation::exchange, 0, token, 0};
        for (const auto b : wire::encode(c)) to_send.push_back(b);
        if (read) ++reads;
        if (!read) tokens.push_back(token);
        first = !read;
        ++token;
        since_command = 0;
      }
      if (!to_send.empty()) {
        out = to_send.front();
        to_send.pop_front();
      }
      host.exchange(out);
      if (first) requests.push_back(host.first_rise + 2);
    }
    // Sometimes a transfer is given up before its first bit.
    host.select(false);
    if (random.chance(0.3)) {
      host.select(true);
      host.select(false);
    }
  }
  host.select(true);
  for (int i = 0; i < 12'000; ++i) host.exchange(0);

  GatewareDecoder decoder;
  decoder.feed(host.received);
  std::vector<std::int64_t> stamps;
  std::size_t exchanges = 0;
  int replies = 0;
  while (const auto e = decoder.next()) {
    if (e->frame.kind == wire::Kind::data_ready) {
      EXPECT_EQ(e->lost, 0u);
      stamps.push_back(e->ticks);
    }
    if (e->frame.kind == wire::Kind::reply) {
      EXPECT_EQ(e->frame.payload, wire::identity);
      ++replies;
    }
    if (e->frame.kind == wire::Kind::exchange) {
      const wire::Exchange x = wire::exchange_of(e->frame);
      ASSERT_LT(exchanges, requests.size());
      EXPECT_EQ(x.token, tokens[exchanges]);
      EXPECT_EQ(static_cast<std::int64_t>(x.request), requests[exchanges]);
      ASSERT_TRUE(x.answer);
      EXPECT_EQ(static_cast<std::int64_t>(*x.answer), host.rises[e->byte] + 2);
      ++exchanges;
    }
  }
  EXPECT_EQ(stamps, host.edges);
  EXPECT_EQ(exchanges, requests.size());
  EXPECT_GT(exchanges, 5u);
  EXPECT_EQ(replies, reads);
  EXPECT_GT(replies, 0);
  EXPECT_EQ(decoder.health().bad_crc, 0u);
  EXPECT_EQ(decoder.health().garbage_bytes, 0u);
  EXPECT_GT(decoder.health().idle_bytes, 1000u);
}

}  // namespace
}  // namespace takt::sim
