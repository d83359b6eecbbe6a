// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "takt/recording/nmea.h"
#include "takt/streams/clock_events.h"

/// What a GNSS receiver wrote: NMEA and UBX mixed as they come, with comments of the logger between.
namespace takt {

/// Decodes as the bytes come, from a file, a serial line or the gateware's FIFO. After a broken message it searches on
/// from the next byte, so no whole message behind it is lost.
class GnssDecoder {
 public:
  /// `arrival_ticks`: when the first byte of `bytes` came, on the pulses' counter. A message takes the arrival of the
  /// piece in which it begins. Results are appended to `out`.
  void feed(std::string_view bytes, std::optional<std::int64_t> arrival_ticks, LabelStream& out);
  /// No more bytes come: what is left is cut off.
  void finish(LabelStream& out);

 private:
  enum class Step { took, wait };
  Step step(LabelStream& out);
  Step nmea(LabelStream& out);
  Step ubx(LabelStream& out);
  Step rtcm(LabelStream& out);
  Step comment(LabelStream& out);
  void skip(std::size_t count, LabelStream& out, bool garbage);
  void take(std::size_t count);
  [[nodiscard]] std::optional<std::int64_t> arrival_at(std::size_t place) const;
  void count(std::string_view name, LabelStream& out);

  struct Arrival {
    std::uint64_t byte = 0;
    std::optional<std::int64_t> ticks;
  };
  std::string buffer_;
  std::size_t at_ = 0;          // in the buffer
  std::uint64_t consumed_ = 0;  // bytes before the buffer
  std::deque<Arrival> arrivals_;
  bool finished_ = false;
  bool line_start_ = true;
  bool in_comment_ = false;
  std::string stamp_;  // text since the line's start: a logger's stamp before the sentence
  NmeaTime nmea_;
  std::map<std::string, std::size_t, std::less<>> index_;
};

/// The first bytes look like NMEA or UBX, maybe behind `#` lines.
[[nodiscard]] bool looks_like_gnss(const std::string& path);
/// A whole file. A line may begin with the stamp of its arrival: `123456789 $GPRMC,...` (whole numbers: the pulses'
/// unit; with a decimal point: seconds). Throws takt::Error where the file holds no message at all.
[[nodiscard]] LabelStream read_gnss_log(const std::string& path);
[[nodiscard]] LabelStream read_gnss_log(std::string_view bytes, const std::string& where);

/// Arrivals from a table beside the log: byte,arrival; each message takes that of the last row at or before its first
/// byte. Replaces arrivals that the log has itself. Throws takt::Error.
void stamp_arrivals(LabelStream& labels, const std::string& arrivals_path);
void stamp_arrivals(LabelStream& labels, std::string_view table, const std::string& where);

}  // namespace takt
