// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "takt/streams/gateware_wire.h"

/// The gateware in C++: the same bytes at the same clocks as the RTL (gateware/rtl), which gateware/sim proves on
/// random runs, at the speed of its events instead of its clocks. Days take minutes.
namespace takt {

enum class GatewarePin : std::uint8_t { pps, gnss, imu, exposure, host };

/// A pin takes a level in time for the clock edge that ends `cycle`; cycle c is the clock in which the counter stands
/// at c.
struct PinChange {
  std::int64_t cycle = 0;
  GatewarePin pin = GatewarePin::pps;
  int index = 0;
  bool level = false;
};

/// The cycle in which an edge at `ticks` on the counter's time scale is seen first: its stamp is then floor(ticks).
[[nodiscard]] std::int64_t cycle_of_edge(double ticks);

/// A byte that the device sent and the stamp of its start bit, which is exact.
struct SentByte {
  std::uint8_t byte = 0;
  std::int64_t stamp = 0;
  bool operator==(const SentByte&) const = default;
};

/// Parameters of takt_device.sv.
struct GatewareBuild {
  std::uint32_t clock_hz = 48'000'000;
  int imus = 2, cameras = 4, triggers = 4;
  int trigger_bits = 28;
  int fifo_log2 = 8;
  int heartbeat_log2 = 24;
  int clocks_per_bit = 16;
  int gnss_baud = 9600;
};

/// Appends the changes by which a UART sends `bytes` from `cycle` on, and returns the cycle after the last stop bit.
std::int64_t append_uart(std::vector<PinChange>& changes, GatewarePin pin, std::span<const std::uint8_t> bytes,
                         std::int64_t cycle, int clocks_per_bit);

class GatewareModel {
 public:
  explicit GatewareModel(const GatewareBuild& build = {});
  ~GatewareModel();
  GatewareModel(GatewareModel&&) noexcept;
  GatewareModel& operator=(GatewareModel&&) noexcept;

  /// Runs up to cycle `end` and calls `sent` for each byte that was handed to the UART before. Changes are in order of
  /// their cycles and not before the end of the last run.
  void run(std::span<const PinChange> changes, std::int64_t end, const std::function<void(const SentByte&)>& sent);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt
