// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ubx.h"

#include <fmt/core.h>

#include <array>
#include <cmath>

#include "takt/recording/byte_cursor.h"
#include "takt/recording/nmea.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::int64_t week_s = 604800;
constexpr unsigned most_weeks = 14000;  // beyond, ns since 1980 do not fit; no receiver means it

struct Name {
  std::uint8_t message_class, id;
  const char* name;
};
constexpr std::array<Name, 7> names{{{0x01, 0x07, "NAV-PVT"},
                                     {0x01, 0x20, "NAV-TIMEGPS"},
                                     {0x01, 0x21, "NAV-TIMEUTC"},
                                     {0x01, 0x22, "NAV-CLOCK"},
                                     {0x01, 0x26, "NAV-TIMELS"},
                                     {0x0d, 0x01, "TIM-TP"},
                                     {0x0d, 0x03, "TIM-TM2"}}};

struct Signed {
  ByteCursor& at;
  std::int32_t i32() { return static_cast<std::int32_t>(at.u32()); }
  std::uint16_t u16() {
    const unsigned low = at.u8();
    return static_cast<std::uint16_t>(low | static_cast<unsigned>(at.u8()) << 8);
  }
  int i8() { return static_cast<std::int8_t>(at.u8()); }
};

/// A date and time of the day with `nano` on top (−1e9 … 1e9); a 60th second repeats the 59th.
bool read_utc(ByteCursor& at, TimeLabel& label) {
  Signed f{at};
  const int year = f.u16(), month = at.u8(), day = at.u8(), hour = at.u8(), minute = at.u8(), second = at.u8();
  const auto days = days_from_date(year, month, day);
  if (!days || hour > 23 || minute > 59 || second > 60) return false;
  label.leap_second = second == 60;
  label.time_ns = (*days * 86400 + hour * 3600 + minute * 60 + second - (label.leap_second ? 1 : 0)) * second_ns;
  return true;
}

/// GPS − UTC as the receiver applied it: its GPS time of week against its UTC.
std::optional<int> applied_leap(std::uint32_t itow_ms, const TimeLabel& utc) {
  const std::int64_t since_epoch_ns = utc.time_ns + (utc.leap_second ? second_ns : 0) - gps_epoch_utc_s * second_ns;
  const std::int64_t apart_ns = std::int64_t{itow_ms} * 1'000'000 - since_epoch_ns % (week_s * second_ns);
  std::int64_t apart_s = (apart_ns + (apart_ns < 0 ? -second_ns / 2 : second_ns / 2)) / second_ns % week_s;
  if (apart_s > week_s / 2) apart_s -= week_s;
  if (apart_s < -week_s / 2) apart_s += week_s;
  if (std::abs(apart_s) > 120) return std::nullopt;
  return static_cast<int>(apart_s);
}

std::int64_t tow_ns(std::uint16_t week, std::uint32_t tow_ms, std::int64_t sub_ns) {
  return std::int64_t{week} * week_s * second_ns + std::int64_t{tow_ms} * 1'000'000 + sub_ns;
}

void read_pvt(ByteCursor at, TimeLabel label, LabelStream& out) {
  const std::uint32_t itow_ms = at.u32();
  const bool exists = read_utc(at, label);
  const unsigned valid = at.u8();
  at.u32();  // accuracy
  const std::int32_t nano = Signed{at}.i32();
  if (!exists || !at.good()) return;
  label.time_ns += nano;
  label.valid = (valid & 3U) == 3U;
  label.leap_resolved = (valid & 4U) != 0;
  label.gps_minus_utc_s = applied_leap(itow_ms, label);
  out.labels.push_back(std::move(label));
}

void read_timegps(ByteCursor at, TimeLabel label, LabelStream& out) {
  Signed f{at};
  const std::uint32_t itow_ms = at.u32();
  const std::int32_t sub_ns = f.i32();
  const std::uint16_t week = f.u16();
  const int leap_s = f.i8();
  const unsigned valid = at.u8();
  if (!at.good() || week > most_weeks) return;
  label.scale = LabelScale::gps;
  label.time_ns = tow_ns(week, itow_ms, sub_ns);
  label.valid = (valid & 3U) == 3U;
  label.leap_resolved = (valid & 4U) != 0;
  label.gps_minus_utc_s = leap_s;
  out.labels.push_back(std::move(label));
}

void read_timeutc(ByteCursor at, TimeLabel label, LabelStream& out) {
  const std::uint32_t itow_ms = at.u32();
  at.u32();  // accuracy
  const std::int32_t nano = Signed{at}.i32();
  const bool exists = read_utc(at, label);
  const unsigned valid = at.u8();
  if (!exists || !at.good()) return;
  label.time_ns += nano;
  label.valid = (valid & 3U) == 3U;
  label.leap_resolved = (valid & 4U) != 0;
  label.gps_minus_utc_s = applied_leap(itow_ms, label);
  out.labels.push_back(std::move(label));
}

void read_timels(ByteCursor at, LabelStream& out) {
  Signed f{at};
  LeapNotice notice;
  notice.gps_ns = std::int64_t{at.u32()} * 1'000'000;
  at.bytes(4);  // version, reserved
  at.u8();      // source of the current count
  const int current = f.i8();
  const int source_of_change = at.u8(), change = f.i8();
  const std::int32_t to_event = f.i32();
  at.bytes(7);  // date of the event, reserved
  const unsigned valid = at.u8();
  if (!at.good()) return;
  if (valid & 1U) notice.current_s = current;
  if (valid & 2U && source_of_change != 0) {
    notice.change_s = change;
    notice.seconds_to_event = to_event;
  }
  out.leap_notices.push_back(notice);
}

void read_clock(ByteCursor at, LabelStream& out) {
  Signed f{at};
  ReceiverClock clock;
  clock.gps_tow_ns = std::int64_t{at.u32()} * 1'000'000;
  clock.bias_s = 1e-9 * f.i32();
  clock.drift = 1e-9 * f.i32();
  clock.bias_sigma_s = 1e-9 * at.u32();
  clock.drift_sigma = 1e-12 * at.u32();
  if (at.good()) out.receiver_clock.push_back(clock);
}

/// The time of week may be on GPS time or on UTC (flag timeBase); it is the next pulse's either way.
void read_tp(ByteCursor at, TimeLabel label, LabelStream& out) {
  Signed f{at};
  const std::uint32_t tow_ms = at.u32();
  const double sub_ms = std::ldexp(static_cast<double>(at.u32()), -32);
  const std::int32_t error_ps = f.i32();
  const std::uint16_t week = f.u16();
  const unsigned flags = at.u8();
  at.u8();  // which GNSS or UTC standard
  if (!at.good() || week > most_weeks) return;
  label.scale = flags & 1U ? LabelScale::utc : LabelScale::gps;
  label.time_ns = tow_ns(week, tow_ms, std::llround(sub_ms * 1e6));
  if (label.scale == LabelScale::utc) {
    label.time_ns += gps_epoch_utc_s * second_ns;
    label.leap_resolved = (flags & 2U) != 0;
  }
  label.names_next = true;
  label.valid = week > 0;
  if (!(flags & 16U)) out.pulse_errors.push_back({label.scale, label.time_ns, 1e-12 * error_ps, label.byte});
  out.labels.push_back(std::move(label));
}

void read_tm2(ByteCursor at, LabelStream& out) {
  Signed f{at};
  EventMark event;
  event.channel = at.u8();
  const unsigned flags = at.u8();
  event.count = f.u16();
  const std::uint16_t week_rising = f.u16(), week_falling = f.u16();
  const std::uint32_t rising_ms = at.u32(), rising_sub = at.u32(), falling_ms = at.u32(), falling_sub = at.u32();
  event.accuracy_s = 1e-9 * at.u32();
  if (!at.good() || week_rising > most_weeks || week_falling > most_weeks) return;
  const unsigned base = flags >> 3 & 3U;
  event.scale = base == 2 ? LabelScale::utc : LabelScale::gps;
  const std::int64_t epoch = base == 2 ? gps_epoch_utc_s * second_ns : 0;
  if (flags & 0x80U) event.rising_ns = epoch + tow_ns(week_rising, rising_ms, rising_sub);
  if (flags & 0x04U) event.falling_ns = epoch + tow_ns(week_falling, falling_ms, falling_sub);
  event.valid = (flags & 0x40U) != 0 && base != 0;
  out.events.push_back(event);
}

}  // namespace

std::uint16_t ubx_checksum(std::span<const std::byte> bytes) {
  unsigned a = 0, b = 0;
  for (const std::byte byte : bytes) {
    a = (a + std::to_integer<unsigned>(byte)) & 0xffU;
    b = (b + a) & 0xffU;
  }
  return static_cast<std::uint16_t>(a | b << 8);
}

std::string ubx_name(std::uint8_t message_class, std::uint8_t id) {
  for (const Name& n : names)
    if (n.message_class == message_class && n.id == id) return n.name;
  return fmt::format("UBX-{:02X}-{:02X}", message_class, id);
}

void read_ubx(std::uint8_t message_class, std::uint8_t id, std::span<const std::byte> payload,
              std::optional<std::int64_t> arrival_ticks, std::uint64_t byte, LabelStream& out) {
  TimeLabel label;
  label.source = ubx_name(message_class, id);
  label.arrival_ticks = arrival_ticks;
  label.byte = byte;
  const ByteCursor at(payload);
  switch (message_class << 8 | id) {
    case 0x0107:
      return read_pvt(at, label, out);
    case 0x0120:
      return read_timegps(at, label, out);
    case 0x0121:
      return read_timeutc(at, label, out);
    case 0x0122:
      return read_clock(at, out);
    case 0x0126:
      return read_timels(at, out);
    case 0x0d01:
      return read_tp(at, label, out);
    case 0x0d03:
      return read_tm2(at, out);
    default:
      return;
  }
}

}  // namespace takt
