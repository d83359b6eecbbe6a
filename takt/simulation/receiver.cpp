// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/receiver.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <initializer_list>

namespace takt {

namespace {

constexpr std::int64_t gps_epoch_unix_s = 315964800;
constexpr std::int64_t week_s = 604800;

struct Civil {
  int year, month, day, hour, minute, second;
};

/// The receiver's UTC; during a leap second its 60th.
Civil civil(const ReceiverSecond& s) {
  const std::int64_t unix_s = s.gps_s + gps_epoch_unix_s - s.gps_minus_utc_s - (s.leap_second ? 1 : 0) + s.date_shift_s;
  const auto days = std::chrono::floor<std::chrono::days>(std::chrono::sys_seconds(std::chrono::seconds(unix_s)));
  const std::chrono::year_month_day date(days);
  const auto in_day = static_cast<int>(unix_s - days.time_since_epoch().count() * 86400);
  return {static_cast<int>(date.year()),
          static_cast<int>(static_cast<unsigned>(date.month())),
          static_cast<int>(static_cast<unsigned>(date.day())),
          in_day / 3600,
          in_day / 60 % 60,
          in_day % 60 + (s.leap_second ? 1 : 0)};
}

std::string sentence(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}\r\n", body, sum);
}

class Payload {
 public:
  Payload& add(std::int64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xffU);
    return *this;
  }
  [[nodiscard]] std::string framed(int message_class, int id) const {
    Payload head;
    head.add(message_class, 1).add(id, 1).add(static_cast<std::int64_t>(bytes_.size()), 2);
    const std::string body = head.bytes_ + bytes_;
    unsigned a = 0, b = 0;
    for (const char c : body) {
      a = (a + static_cast<unsigned char>(c)) & 0xffU;
      b = (b + a) & 0xffU;
    }
    return "\xb5\x62" + body + static_cast<char>(a) + static_cast<char>(b);
  }

 private:
  std::string bytes_;
};

}  // namespace

std::string nmea_messages(const ReceiverSecond& s) {
  const Civil c = civil(s);
  const auto hundredths = static_cast<int>(std::lround(100 * s.fix_fraction_s));
  const std::string time = fmt::format("{:02}{:02}{:02}.{:02}", c.hour, c.minute, c.second, hundredths);
  return sentence(fmt::format("GNRMC,{},A,4724.5000,N,00832.6000,E,0.02,,{:02}{:02}{:02},,,A", time, c.day, c.month,
                              c.year % 100)) +
         sentence(fmt::format("GNGGA,{},4724.5000,N,00832.6000,E,1,12,0.8,470.0,M,47.9,M,,", time)) +
         sentence(fmt::format("GNZDA,{},{:02},{:02},{:04},00,00", time, c.day, c.month, c.year));
}

std::string ubx_messages(const ReceiverSecond& s) {
  const Civil c = civil(s);
  const auto fraction_ms = static_cast<std::int64_t>(std::lround(1e3 * s.fix_fraction_s));
  const std::int64_t gps_s = s.gps_s + s.date_shift_s, week = gps_s / week_s;
  const std::int64_t itow_ms = gps_s % week_s * 1000 + fraction_ms;
  const std::int64_t nano = fraction_ms * 1'000'000 - 87;  // never quite zero
  const int valid = 3 | (s.leap_resolved ? 4 : 0);
  Payload pvt, timegps, timeutc, tp;
  pvt.add(itow_ms, 4).add(c.year, 2);
  for (const int v : {c.month, c.day, c.hour, c.minute, c.second, valid}) pvt.add(v, 1);
  pvt.add(21, 4).add(nano, 4).add(3, 1).add(1, 1).add(0, 1).add(12, 1);
  for (int i = 0; i < 17; ++i) pvt.add(0, 4);
  timegps.add(itow_ms, 4).add(-87, 4).add(week, 2).add(s.gps_minus_utc_s, 1).add(valid, 1).add(9, 4);
  timeutc.add(itow_ms, 4).add(21, 4).add(nano, 4).add(c.year, 2);
  for (const int v : {c.month, c.day, c.hour, c.minute, c.second, valid}) timeutc.add(v, 1);
  const std::int64_t next_s = gps_s + 1;
  tp.add(next_s % week_s * 1000, 4)
      .add(0, 4)
      .add(std::llround(s.next_error_s * 1e12), 4)
      .add(next_s / week_s, 2)
      .add(2, 1)
      .add(0, 1);
  return pvt.framed(1, 0x07) + timegps.framed(1, 0x20) + timeutc.framed(1, 0x21) + tp.framed(0x0d, 0x01);
}

}  // namespace takt
