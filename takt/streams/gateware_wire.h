// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

/// The bytes between the gateware and its host, as docs/formats/wire.md fixes them: frames of 20 bytes to the host,
/// commands of 11 bytes to the device. Only bytes and their fields; streams of them are read in
/// takt/recording/gateware.h.
namespace takt::wire {

inline constexpr unsigned wire_version = 1;
inline constexpr std::array<std::uint8_t, 2> frame_sync{0xD5, 0x7A};
inline constexpr std::array<std::uint8_t, 2> command_sync{0xC5, 0x3A};
inline constexpr std::size_t frame_size = 20;
inline constexpr std::size_t command_size = 11;

/// What a frame reports. Other values are a later version's.
enum class Kind : std::uint8_t {
  heartbeat = 0,   ///< channel: which word; payload: the word
  pulse = 1,       ///< rising edge of the GNSS receiver's pulse
  gnss_start = 2,  ///< first start bit after the receiver's line was idle
  gnss_text = 3,   ///< payload: detail + 1 bytes of the receiver
  data_ready = 4,  ///< rising edge of an IMU's line
  exposure = 5,    ///< an edge of a camera's strobe: level says which; payload: number of the frame
  trigger = 6,     ///< rising edge of a trigger
  reply = 8,       ///< to a read or write: channel: status; sequence: token, address; payload: value
  exchange = 12,   ///< to a time exchange: see Exchange
  host = 15,       ///< never from a device: the host's own stamps in a recording, see HostMark
};

/// Words of the heartbeat, by its channel.
enum class Word : std::uint8_t { clock_hz = 0, features = 1, status = 2, identity = 3 };
inline constexpr std::uint32_t identity = 0x7461'6B74;

inline constexpr std::uint8_t flag_overrun = 8;  ///< events of this channel were lost before this one
inline constexpr std::uint8_t flag_level = 4;    ///< the edge rose
inline constexpr std::uint8_t detail_mask = 3;
inline constexpr std::uint8_t flag_any_loss = 1;  ///< in a heartbeat: some channel lost something since the last one

struct Frame {
  Kind kind = Kind::heartbeat;
  std::uint8_t channel = 0;  ///< 4 bits
  std::uint8_t flags = 0;    ///< 4 bits
  std::uint16_t sequence = 0;
  std::uint64_t stamp = 0;  ///< ticks; the event was in [stamp, stamp + 1)
  std::uint32_t payload = 0;

  [[nodiscard]] bool overrun() const { return (flags & flag_overrun) != 0; }
  [[nodiscard]] bool level() const { return (flags & flag_level) != 0; }
  bool operator==(const Frame&) const = default;
};

/// Start 0xFFFF, polynomial 0x1021, most significant bit first (CRC-16/CCITT-FALSE).
[[nodiscard]] std::uint16_t crc16(std::span<const std::uint8_t> bytes);

using FrameBytes = std::array<std::uint8_t, frame_size>;
using CommandBytes = std::array<std::uint8_t, command_size>;

[[nodiscard]] FrameBytes encode(const Frame& frame);

enum class Fault : std::uint8_t { none, sync, crc, version };
/// The frame in these 20 bytes, or why there is none.
struct Decoded {
  Frame frame;
  Fault fault = Fault::none;
};
[[nodiscard]] Decoded decode_frame(std::span<const std::uint8_t, frame_size> bytes);

enum class Operation : std::uint8_t { read = 1, write = 2, exchange = 3 };
struct Command {
  Operation operation = Operation::read;
  std::uint8_t address = 0;
  std::uint8_t token = 0;  ///< chosen by the host, and found again in the answer
  std::uint32_t value = 0;
};
[[nodiscard]] CommandBytes encode(const Command& command);

enum class Status : std::uint8_t { ok = 0, no_register = 1, read_only = 2, unknown = 3, late = 4 };

/// Registers by address.
namespace reg {
inline constexpr std::uint8_t id = 0x00, clock_hz = 0x01, features = 0x02, enable = 0x04, invert = 0x05,
                              gnss_bit = 0x06, run = 0x08, trigger = 0x10;
}

/// Bits of `enable` and (below 16) of `invert`.
[[nodiscard]] constexpr std::uint32_t pulse_bit() {
  return 1u;
}
[[nodiscard]] constexpr std::uint32_t gnss_bit() {
  return 1u << 1;
}
[[nodiscard]] constexpr std::uint32_t imu_bit(int k) {
  return 1u << (4 + k);
}
[[nodiscard]] constexpr std::uint32_t camera_bit(int k) {
  return 1u << (8 + k);
}
[[nodiscard]] constexpr std::uint32_t trigger_bit(int k) {
  return 1u << (16 + k);
}

/// A trigger in ticks; what its three registers hold is made from it.
struct TriggerSetting {
  std::uint32_t period = 0;  ///< at least 2
  std::uint32_t phase = 0;   ///< of the rising edge, from the common start; < period
  std::uint32_t width = 1;   ///< < period
};
/// The writes that set up trigger `k` (and stop it); a write to `run` starts it. Throws std::invalid_argument for a
/// setting that no trigger can have.
[[nodiscard]] std::array<Command, 3> trigger_commands(int k, const TriggerSetting& setting);

/// What the features word says.
struct Features {
  int counter_bits = 64;
  int imus = 0, cameras = 0, triggers = 0;
  bool gnss_text = false, spi = false;
  int fifo_log2 = 0;
};
[[nodiscard]] Features features_of(std::uint32_t word);

/// A time exchange as the device saw it: the request's first bit and its answer's first bit, in ticks.
struct Exchange {
  std::uint8_t token = 0;
  std::uint64_t request = 0;
  std::optional<std::uint64_t> answer;  ///< nothing where the frame waited longer than 2^23 ticks
};
[[nodiscard]] Exchange exchange_of(const Frame& frame);

/// Channels of Kind::host: what the host writes into a recording beside the device's frames; the stamp is host ns.
enum class HostMark : std::uint8_t { request_sent = 0, answer_received = 1, arrival = 2 };

}  // namespace takt::wire
