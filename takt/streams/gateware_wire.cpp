// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/gateware_wire.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt::wire {

namespace {

template <class T>
void put(std::uint8_t* to, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}
template <class T>
T get(const std::uint8_t* from) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value = static_cast<T>(value | (static_cast<T>(from[i]) << (8 * i)));
  return value;
}

/// The CRC goes with its high byte first: summed up with what stands before it, it leaves 0.
template <std::size_t N>
void seal(std::array<std::uint8_t, N>& bytes) {
  const std::uint16_t crc = crc16(std::span(bytes).subspan(2, N - 4));
  bytes[N - 2] = static_cast<std::uint8_t>(crc >> 8);
  bytes[N - 1] = static_cast<std::uint8_t>(crc);
}

constexpr std::array<std::uint16_t, 256> crc_table = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    unsigned crc = i << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x8000) != 0 ? 0x1021u : 0u);
    table[i] = static_cast<std::uint16_t>(crc);
  }
  return table;
}();

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t b : bytes) crc = static_cast<std::uint16_t>((crc << 8) ^ crc_table[(crc >> 8) ^ b]);
  return crc;
}

FrameBytes encode(const Frame& frame) {
  FrameBytes bytes{frame_sync[0], frame_sync[1]};
  bytes[2] = static_cast<std::uint8_t>((wire_version << 4) | static_cast<unsigned>(frame.kind));
  bytes[3] = static_cast<std::uint8_t>((frame.flags << 4) | (frame.channel & 15));
  put(&bytes[4], frame.sequence);
  put(&bytes[6], frame.stamp);
  put(&bytes[14], frame.payload);
  seal(bytes);
  return bytes;
}

Decoded decode_frame(std::span<const std::uint8_t, frame_size> bytes) {
  Decoded out;
  if (!std::equal(frame_sync.begin(), frame_sync.end(), bytes.begin())) {
    out.fault = Fault::sync;
  } else if (crc16(bytes.subspan(2)) != 0) {
    out.fault = Fault::crc;
  } else if (bytes[2] >> 4 != wire_version) {
    out.fault = Fault::version;
  } else {
    out.frame.kind = static_cast<Kind>(bytes[2] & 15);
    out.frame.channel = bytes[3] & 15;
    out.frame.flags = static_cast<std::uint8_t>(bytes[3] >> 4);
    out.frame.sequence = get<std::uint16_t>(&bytes[4]);
    out.frame.stamp = get<std::uint64_t>(&bytes[6]);
    out.frame.payload = get<std::uint32_t>(&bytes[14]);
  }
  return out;
}

CommandBytes encode(const Command& command) {
  CommandBytes bytes{command_sync[0], command_sync[1]};
  bytes[2] = static_cast<std::uint8_t>((wire_version << 4) | static_cast<unsigned>(command.operation));
  bytes[3] = command.address;
  bytes[4] = command.token;
  put(&bytes[5], command.value);
  seal(bytes);
  return bytes;
}

std::array<Command, 3> trigger_commands(int k, const TriggerSetting& s) {
  if (k < 0 || k > 7) throw std::invalid_argument("trigger " + std::to_string(k) + ": there are 0 to 7");
  if (s.period < 2 || s.phase >= s.period || s.width < 1 || s.width >= s.period)
    throw std::invalid_argument("trigger " + std::to_string(k) + ": period " + std::to_string(s.period) + ", phase " +
                                std::to_string(s.phase) + ", width " + std::to_string(s.width) +
                                " ticks; phase and width must be below the period, which is at least 2");
  const auto base = static_cast<std::uint8_t>(reg::trigger + 4 * k);
  const auto fall = static_cast<std::uint32_t>((std::uint64_t{s.phase} + s.width) % s.period);
  const auto write = [&](unsigned place, std::uint32_t value) {
    return Command{Operation::write, static_cast<std::uint8_t>(base + place), 0, value};
  };
  return {write(0, s.period - 2), write(1, s.phase), write(2, fall)};
}

Features features_of(std::uint32_t word) {
  Features f;
  f.counter_bits = static_cast<int>(word & 0xFF);
  f.imus = static_cast<int>(word >> 8 & 15);
  f.cameras = static_cast<int>(word >> 12 & 15);
  f.triggers = static_cast<int>(word >> 16 & 15);
  f.gnss_text = (word >> 20 & 1) != 0;
  f.spi = (word >> 21 & 1) != 0;
  f.fifo_log2 = static_cast<int>(word >> 28);
  return f;
}

Exchange exchange_of(const Frame& frame) {
  Exchange e;
  e.token = static_cast<std::uint8_t>(frame.payload >> 24);
  e.request = frame.stamp - frame.sequence;
  const std::uint32_t delay = frame.payload & 0xFF'FFFF;
  if (delay < 0x80'0000) e.answer = frame.stamp + delay;
  return e;
}

}  // namespace takt::wire
