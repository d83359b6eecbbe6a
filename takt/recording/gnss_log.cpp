// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gnss_log.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"
#include "takt/recording/ubx.h"

namespace takt {

namespace {

/// NMEA allows 82 characters; receivers send up to about twice that.
constexpr std::size_t longest_sentence = 256;
constexpr std::size_t longest_ubx = 8192;
constexpr std::size_t longest_stamp = 40;

/// CRC-24Q of RTCM 3: its frames are passed over whole, so that nothing inside is taken for a message.
constexpr auto crc24q_table = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i << 16;
    for (int bit = 0; bit < 8; ++bit) c = c & 0x800000U ? (c << 1) ^ 0x1864CFBU : c << 1;
    table[i] = c & 0xFFFFFFU;
  }
  return table;
}();

std::uint32_t crc24q(std::string_view bytes) {
  std::uint32_t c = 0;
  for (const char byte : bytes) c = ((c << 8) & 0xFFFFFFU) ^ crc24q_table[(c >> 16) ^ static_cast<unsigned char>(byte)];
  return c;
}

unsigned at(std::string_view bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

bool printable(char c) {
  return static_cast<unsigned char>(c) >= 0x20 && static_cast<unsigned char>(c) < 0x7f;
}

struct FoundStamp {
  std::int64_t value = 0;
  bool seconds = false;
};

/// "1234567 " or "1700000000.123," before a sentence. Seconds come with a decimal point and become ns.
std::optional<FoundStamp> stamp_in(std::string_view text) {
  const std::string_view separators = " \t,;";
  const auto first = text.find_first_not_of(separators);
  const auto last = text.find_last_not_of(separators);
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, last + 1 - first);
  const bool seconds = text.find('.') != std::string_view::npos;
  if (text.find_first_not_of("0123456789.-") != std::string_view::npos) return std::nullopt;
  const auto value = decimal_to_ns(text, seconds ? 9 : 0);
  if (!value) return std::nullopt;
  return FoundStamp{*value, seconds};
}

}  // namespace

void GnssDecoder::feed(std::string_view bytes, std::optional<std::int64_t> arrival_ticks, LabelStream& out) {
  if (bytes.empty()) return;
  arrivals_.push_back({consumed_ + buffer_.size(), arrival_ticks});
  buffer_.append(bytes);
  while (at_ < buffer_.size() && step(out) == Step::took) {
  }
  if (at_ > 65536 || at_ == buffer_.size()) {
    consumed_ += at_;
    buffer_.erase(0, at_);
    at_ = 0;
    while (arrivals_.size() > 1 && arrivals_[1].byte <= consumed_) arrivals_.pop_front();
  }
}

void GnssDecoder::finish(LabelStream& out) {
  finished_ = true;
  while (at_ < buffer_.size()) step(out);
}

GnssDecoder::Step GnssDecoder::step(LabelStream& out) {
  if (in_comment_ || (line_start_ && (buffer_[at_] == '#' || buffer_[at_] == '{'))) return comment(out);
  switch (at(buffer_, at_)) {
    case '$':
      return nmea(out);
    case 0xb5:
      return ubx(out);
    case 0xd3:
      return rtcm(out);
    default: {
      const char c = buffer_[at_];
      const bool blank = c == '\r' || c == '\n';
      if (stamp_.size() < longest_stamp && !blank) stamp_ += c;
      skip(1, out, !blank);
      if (blank) {
        line_start_ = true;
        stamp_.clear();
      }
      return Step::took;
    }
  }
}

/// The logger's own words run to the end of their line; binary bytes end them too.
GnssDecoder::Step GnssDecoder::comment(LabelStream& out) {
  in_comment_ = true;
  while (at_ < buffer_.size()) {
    const char c = buffer_[at_];
    if (c == '\n' || at(buffer_, at_) == 0xb5) {
      in_comment_ = false;
      line_start_ = true;
      if (c == '\n') skip(1, out, false);
      return Step::took;
    }
    skip(1, out, false);
    line_start_ = false;
  }
  return Step::took;
}

GnssDecoder::Step GnssDecoder::nmea(LabelStream& out) {
  const std::size_t limit = std::min(buffer_.size(), at_ + longest_sentence);
  std::size_t end = at_ + 1;
  while (end < limit && printable(buffer_[end]) && buffer_[end] != '$') ++end;
  const bool cut_off = end == buffer_.size() && end - at_ < longest_sentence;
  if (cut_off && !finished_) return Step::wait;
  const std::string_view sentence(buffer_.data() + at_, end - at_);
  if (!nmea_checksum_fits(sentence)) {
    const bool was_sentence =
        sentence.size() > 6 && !cut_off && std::all_of(sentence.begin() + 1, sentence.begin() + 6, printable);
    if (was_sentence) ++out.broken;
    stamp_.clear();
    skip(1, out, true);
    return Step::took;
  }
  count(sentence.substr(1, sentence.find_first_of(",*") - 1), out);
  if (auto label = nmea_.read(sentence)) {
    label->byte = consumed_ + at_;
    label->arrival_ticks = arrival_at(at_);
    if (const auto stamp = stamp_in(stamp_)) {
      label->arrival_ticks = stamp->value;
      if (stamp->seconds) out.arrival_hz = 1e9;
      out.garbage_bytes -= std::min(out.garbage_bytes, stamp_.size());
    }
    out.labels.push_back(std::move(*label));
  }
  stamp_.clear();
  take(sentence.size());
  return Step::took;
}

GnssDecoder::Step GnssDecoder::ubx(LabelStream& out) {
  const std::string_view rest = std::string_view(buffer_).substr(at_);
  const auto wait_for = [&](std::size_t size) { return rest.size() < size && !finished_; };
  if (wait_for(2)) return Step::wait;
  const bool begins = rest.size() >= 2 && at(rest, 1) == 0x62;
  if (begins && wait_for(8)) return Step::wait;
  if (!begins || rest.size() < 8) {
    skip(1, out, true);
    return Step::took;
  }
  const std::size_t length = at(rest, 4) | at(rest, 5) << 8;
  if (length <= longest_ubx && wait_for(length + 8)) return Step::wait;
  if (length > longest_ubx || rest.size() < length + 8) {
    skip(1, out, true);
    return Step::took;
  }
  const auto body = std::as_bytes(std::span(rest.data() + 2, length + 4));
  const unsigned said = at(rest, length + 6) | at(rest, length + 7) << 8;
  if (said != ubx_checksum(body)) {
    ++out.broken;
    skip(1, out, true);
    return Step::took;
  }
  const auto message_class = static_cast<std::uint8_t>(at(rest, 2)), id = static_cast<std::uint8_t>(at(rest, 3));
  count(ubx_name(message_class, id), out);
  read_ubx(message_class, id, body.subspan(4), arrival_at(at_), consumed_ + at_, out);
  stamp_.clear();
  take(length + 8);
  line_start_ = true;
  return Step::took;
}

GnssDecoder::Step GnssDecoder::rtcm(LabelStream& out) {
  const std::string_view rest = std::string_view(buffer_).substr(at_);
  if (rest.size() < 3 && !finished_) return Step::wait;
  if (rest.size() >= 3 && (at(rest, 1) & 0xfcU) == 0) {
    const std::size_t length = (at(rest, 1) & 3U) << 8 | at(rest, 2);
    if (rest.size() < length + 6 && !finished_) return Step::wait;
    if (rest.size() >= length + 6) {
      const std::uint32_t said = at(rest, length + 3) << 16 | at(rest, length + 4) << 8 | at(rest, length + 5);
      if (said == crc24q(rest.substr(0, length + 3))) {
        take(length + 6);
        line_start_ = true;
        return Step::took;
      }
    }
  }
  skip(1, out, true);
  return Step::took;
}

void GnssDecoder::skip(std::size_t count, LabelStream& out, bool garbage) {
  if (garbage) out.garbage_bytes += count;
  take(count);
}

void GnssDecoder::take(std::size_t count) {
  at_ += count;
  line_start_ = false;
}

std::optional<std::int64_t> GnssDecoder::arrival_at(std::size_t place) const {
  const std::uint64_t byte = consumed_ + place;
  const auto after = std::upper_bound(arrivals_.begin(), arrivals_.end(), byte,
                                      [](std::uint64_t b, const Arrival& a) { return b < a.byte; });
  return after == arrivals_.begin() ? std::nullopt : std::prev(after)->ticks;
}

void GnssDecoder::count(std::string_view name, LabelStream& out) {
  // Places hold for the stream that they were found in; the caller may hand over another one each time.
  auto found = index_.find(name);
  if (found == index_.end() || found->second >= out.counts.size() || out.counts[found->second].message != name) {
    found = index_.insert_or_assign(std::string(name), out.counts.size()).first;
    out.counts.push_back({std::string(name), 0});
  }
  ++out.counts[found->second].count;
}

bool looks_like_gnss(const std::string& path) {
  const std::string head = file_head(path, 65536);
  try {
    LabelStream out;
    GnssDecoder decoder;
    decoder.feed(head, std::nullopt, out);
    return !out.counts.empty();
  } catch (const std::exception&) {
    return false;
  }
}

LabelStream read_gnss_log(const std::string& path) {
  return read_gnss_log(read_file(path), path);
}

LabelStream read_gnss_log(std::string_view bytes, const std::string& where) {
  LabelStream out;
  out.name = "gnss";
  GnssDecoder decoder;
  decoder.feed(bytes, std::nullopt, out);
  decoder.finish(out);
  if (out.counts.empty())
    throw Error(bytes.empty() ? "is empty" : "holds no NMEA or UBX message whose checksum is right", where,
                "give the receiver's raw output");
  if (out.broken > 0) out.notes.push_back(fmt::format("{}: {} messages with a wrong checksum", where, out.broken));
  if (out.labels.empty()) {
    std::string names;
    for (const auto& c : out.counts) names += (names.empty() ? "" : ", ") + c.message;
    out.notes.push_back(fmt::format("{}: no message that names a second among {}", where, names));
  }
  return out;
}

void stamp_arrivals(LabelStream& labels, const std::string& arrivals_path) {
  stamp_arrivals(labels, read_file(arrivals_path), arrivals_path);
}

void stamp_arrivals(LabelStream& labels, std::string_view table, const std::string& where) {
  TableRows rows(table, where);
  if (rows.shape().columns != 2)
    throw Error(fmt::format("has {} columns; byte,arrival expected", rows.shape().columns), where,
                "see docs/formats/clock.md");
  struct Row {
    std::int64_t byte, arrival;
  };
  std::vector<Row> arrivals;
  const bool seconds = rows.shape().names.size() == 2 && rows.shape().names[1].ends_with("_s");
  while (rows.next()) arrivals.push_back({rows.time_ns(0, 0), rows.time_ns(1, seconds ? 9 : 0)});
  if (!std::is_sorted(arrivals.begin(), arrivals.end(), [](const Row& a, const Row& b) { return a.byte < b.byte; }))
    throw Error("is not in the order of the bytes", where, "sort it by its first column");
  if (seconds) labels.arrival_hz = 1e9;
  for (TimeLabel& label : labels.labels) {
    const auto after =
        std::upper_bound(arrivals.begin(), arrivals.end(), label.byte,
                         [](std::uint64_t b, const Row& r) { return static_cast<std::int64_t>(b) < r.byte; });
    label.arrival_ticks.reset();
    if (after != arrivals.begin()) label.arrival_ticks = std::prev(after)->arrival;
  }
}

}  // namespace takt
