// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/simulation/gateware_model.h"

/// Runs a verilated device (RTL or netlist; the same ports) under a list of pin changes, and listens to its UART as a
/// host would, bit by bit. Cycle c is the clock in which the device's counter stands at c.
namespace takt::sim {

template <class Model>
class Rig {
 public:
  Rig() : top_(std::make_unique<Model>()) {
    top_->clk_i = 0;
    top_->rst_ni = 0;
    top_->pps_i = 0;
    top_->gnss_rx_i = 1;
    top_->imu_ready_i = 0;
    top_->exposure_i = 0;
    top_->uart_rx_i = 1;
    top_->spi_sclk_i = 0;
    top_->spi_cs_ni = 1;
    top_->spi_mosi_i = 0;
    for (int i = 0; i < 8; ++i) clock();
    top_->rst_ni = 1;
  }

  [[nodiscard]] std::int64_t cycle() const { return cycle_; }
  Model& pins() { return *top_; }

  /// Runs up to cycle `end`, changing pins on the way. Changes must be in order of their cycles.
  void run(const std::vector<PinChange>& changes, std::int64_t end, int clocks_per_bit = 16) {
    std::size_t next = 0;
    while (cycle_ < end) {
      for (; next < changes.size() && changes[next].cycle <= cycle_; ++next) apply(changes[next]);
      top_->eval();
      listen(clocks_per_bit);
      watch_triggers();
      clock();
      ++cycle_;
    }
  }

  /// What came out of the UART: bytes, and the stamps of their start bits.
  std::vector<SentByte> sent;
  /// Rising edges of the triggers: the cycle in which the pin is up first.
  struct Rise {
    int trigger;
    std::int64_t cycle;
  };
  std::vector<Rise> rises;
  bool loop_trigger0_to_imu1 = false;
  std::size_t framing_errors = 0;

  [[nodiscard]] std::string bytes() const {
    std::string out;
    for (const SentByte& b : sent) out.push_back(static_cast<char>(b.byte));
    return out;
  }

 private:
  void clock() {
    top_->clk_i = 0;
    top_->eval();
    top_->clk_i = 1;
    top_->eval();
  }

  template <class T>
  static void set_bit(T& pins, int index, bool level) {
    const auto mask = static_cast<T>(1u << index);
    pins = static_cast<T>(level ? pins | mask : pins & static_cast<T>(~mask));
  }

  void apply(const PinChange& c) {
    switch (c.pin) {
      case GatewarePin::pps:
        top_->pps_i = c.level;
        break;
      case GatewarePin::gnss:
        top_->gnss_rx_i = c.level;
        break;
      case GatewarePin::imu:
        set_bit(top_->imu_ready_i, c.index, c.level);
        break;
      case GatewarePin::exposure:
        set_bit(top_->exposure_i, c.index, c.level);
        break;
      case GatewarePin::host:
        top_->uart_rx_i = c.level;
        break;
    }
  }

  void watch_triggers() {
    const unsigned now = top_->trigger_o;
    for (int i = 0; i < 8; ++i)
      if ((now & ~before_) >> i & 1) rises.push_back({i, cycle_});
    before_ = now;
    if (loop_trigger0_to_imu1) set_bit(top_->imu_ready_i, 1, (now & 1) != 0);
  }

  /// An ideal receiver: samples the middle of each bit.
  void listen(int clocks_per_bit) {
    const bool level = top_->uart_tx_o;
    if (bit_ < 0) {
      if (!level) {
        bit_ = 0;
        start_ = cycle_;
        shift_ = 0;
      }
      return;
    }
    const std::int64_t since = cycle_ - start_;
    if (since % clocks_per_bit != clocks_per_bit / 2) return;
    const auto n = since / clocks_per_bit;
    if (n == 0) return;
    if (n <= 8) {
      shift_ |= static_cast<unsigned>(level) << (n - 1);
    } else {
      if (!level) ++framing_errors;
      sent.push_back({static_cast<std::uint8_t>(shift_), start_ + 2});
      bit_ = -1;
    }
  }

  std::unique_ptr<Model> top_;
  std::int64_t cycle_ = 0;
  unsigned before_ = 0;
  int bit_ = -1;
  std::int64_t start_ = 0;
  unsigned shift_ = 0;
};

}  // namespace takt::sim
