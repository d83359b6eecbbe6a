// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/nmea.h"

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <vector>

#include "takt/recording/decimal.h"

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::int64_t day_s = 86400;

std::vector<std::string_view> fields_of(std::string_view sentence) {
  std::vector<std::string_view> out;
  sentence = sentence.substr(0, sentence.find('*'));
  while (true) {
    const auto comma = sentence.find(',');
    out.push_back(sentence.substr(0, comma));
    if (comma == std::string_view::npos) return out;
    sentence.remove_prefix(comma + 1);
  }
}

struct TimeOfDay {
  std::int64_t ns = 0;
  bool leap_second = false;
};

/// "235960.00": during a leap second the count of the second before is repeated, as Unix time does.
std::optional<TimeOfDay> time_of_day(std::string_view text) {
  if (text.size() < 6) return std::nullopt;
  const auto hour = whole_number(text.substr(0, 2)), minute = whole_number(text.substr(2, 2));
  const auto seconds_ns = decimal_to_ns(text.substr(4), 9);
  if (!whole_number(text.substr(4, 2)) || !hour || !minute || !seconds_ns) return std::nullopt;
  const bool leap = *seconds_ns >= 60 * second_ns && *seconds_ns < 61 * second_ns;
  if (*hour > 23 || *minute > 59 || *seconds_ns < 0 || *seconds_ns >= 61 * second_ns) return std::nullopt;
  if (leap && *minute != 59) return std::nullopt;
  return TimeOfDay{(*hour * 3600 + *minute * 60) * second_ns + *seconds_ns - (leap ? second_ns : 0), leap};
}

}  // namespace

bool nmea_checksum_fits(std::string_view sentence) {
  const auto star = sentence.find('*');
  if (sentence.empty() || star == std::string_view::npos || sentence.size() < star + 3) return false;
  unsigned sum = 0;
  for (const char c : sentence.substr(1, star - 1)) sum ^= static_cast<unsigned char>(c);
  unsigned said = 0;
  const std::string_view digits = sentence.substr(star + 1, 2);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + 2, said, 16);
  return error == std::errc{} && end == digits.data() + 2 && said == sum;
}

std::optional<std::int64_t> days_from_date(int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (month < 1 || month > 12 || day < 1 || day > 31 || year < 1970 || year > 2261 || !date.ok()) return std::nullopt;
  return std::chrono::sys_days(date).time_since_epoch().count();
}

std::optional<TimeLabel> NmeaTime::read(std::string_view sentence) {
  const auto fields = fields_of(sentence);
  if (fields[0].size() != 6) return std::nullopt;
  const std::string_view kind = fields[0].substr(3);
  TimeLabel label;
  label.source = kind;
  label.scale = LabelScale::utc;
  std::optional<std::int64_t> day;
  std::optional<TimeOfDay> time;
  if (fields.size() > 1) time = time_of_day(fields[1]);
  if (kind == "RMC" && fields.size() > 9) {
    status_ = fields[2] == "A";
    label.valid = *status_;
    const std::string_view date = fields[9];
    if (date.size() != 6) return std::nullopt;
    const auto d = whole_number(date.substr(0, 2)), m = whole_number(date.substr(2, 2)),
               y = whole_number(date.substr(4, 2));
    if (!d || !m || !y) return std::nullopt;
    day = days_from_date(*y >= 80 ? 1900 + *y : 2000 + *y, *m, *d);
  } else if (kind == "ZDA" && fields.size() > 4) {
    label.valid = status_.value_or(true);
    const auto d = whole_number(fields[2]), m = whole_number(fields[3]), y = whole_number(fields[4]);
    if (!d || !m || !y) return std::nullopt;
    day = days_from_date(*y, *m, *d);
  } else if (kind == "GGA" && fields.size() > 6) {
    const auto quality = whole_number(fields[6]);
    label.valid = quality && *quality > 0;
    if (!last_utc_ns_ || !time) return std::nullopt;
    // The day that brings it nearest to the sentence before.
    const std::int64_t last_s = *last_utc_ns_ / second_ns;
    day = last_s / day_s;
    const std::int64_t apart = *day * day_s + time->ns / second_ns - last_s;
    *day += apart > day_s / 2 ? -1 : apart < -day_s / 2 ? 1 : 0;
  } else {
    return std::nullopt;
  }
  if (!day || !time) return std::nullopt;
  label.time_ns = *day * day_s * second_ns + time->ns;
  label.leap_second = time->leap_second;
  if (kind != "GGA") last_utc_ns_ = label.time_ns;
  return label;
}

}  // namespace takt
