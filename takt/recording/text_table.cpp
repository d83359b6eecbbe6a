// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/text_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "takt/error.h"
#include "takt/recording/decimal.h"

namespace takt {

namespace {

constexpr std::size_t most_columns = 4096;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

std::string_view unquoted(std::string_view s) {
  const bool quoted = s.size() >= 2 && s.front() == '"' && s.back() == '"';
  return quoted ? s.substr(1, s.size() - 2) : s;
}

/// The strongest separator on a line: a blank separates only where nothing else does.
char separator_of(std::string_view line) {
  for (const char c : {';', '\t', ','})
    if (line.find(c) != std::string_view::npos) return c;
  return ' ';
}

/// Text has no zero bytes and hardly any control characters.
bool is_binary(std::string_view text) {
  const std::string_view head = text.substr(0, 4096);
  return std::any_of(head.begin(), head.end(), [](char c) {
    const auto u = static_cast<unsigned char>(c);
    return u < 0x20 && !is_blank(c) && c != '\n' && c != '\f';
  });
}

/// What of a cell an error message may show.
std::string shown(std::string_view cell) {
  std::string out;
  for (const char c : cell.substr(0, 24)) out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return cell.size() > 24 ? out + "..." : out;
}

}  // namespace

TableRows::TableRows(std::string_view text, std::string where) : text_(text), where_(std::move(where)) {
  if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(mark_bytes_ = 3);
  if (is_binary(text_)) throw Error("is binary, not text", where_, "give the CSV export of this log");

  std::string_view line, header;
  bool header_is_comment = false;
  while (next_line(line)) {
    if (line.front() == '#') {
      header = trimmed(line.substr(std::min(line.find_first_not_of('#'), line.size())));
      header_is_comment = true;
      continue;
    }
    shape_.separator = separator_of(line);
    split(line);
    // A header is a row without any number; a broken number elsewhere in the first row is reported as such.
    const bool numbers =
        std::any_of(cells_.begin(), cells_.end(), [](std::string_view c) { return finite_double(c).has_value(); });
    if (numbers) break;
    header = line;
    header_is_comment = false;
    cells_.clear();
  }
  if (cells_.empty())
    throw Error(header.empty() ? "is empty" : "has no row of numbers", where_,
                "check that the log was written to its end");
  shape_.columns = cells_.size();
  first_line_ = line_ - 1;
  first_place_ = static_cast<std::size_t>(line.data() - text_.data());

  if (!header.empty()) {
    const auto row = std::exchange(cells_, {});
    split(header);
    if (cells_.size() == shape_.columns)
      shape_.names.assign(cells_.begin(), cells_.end());
    else if (!header_is_comment)  // a comment may be prose
      throw Error(fmt::format("row has {} columns, its header {}", shape_.columns, cells_.size()), place(),
                  "name every column, or delete the header");
    cells_ = row;
  }
  rewind();
}

void TableRows::rewind() {
  place_ = first_place_;
  line_ = first_line_;
}

bool TableRows::next_line(std::string_view& line) {
  while (place_ < text_.size()) {
    const char* const begin = text_.data() + place_;
    const void* const found = std::memchr(begin, '\n', text_.size() - place_);
    const std::size_t length =
        found ? static_cast<std::size_t>(static_cast<const char*>(found) - begin) : text_.size() - place_;
    place_ += length + (found ? 1 : 0);
    row_bytes_ = length + 1;
    ++line_;
    line = trimmed({begin, length});
    if (!line.empty()) return true;
  }
  return false;
}

void TableRows::split(std::string_view line) {
  cells_.clear();
  const char separator = shape_.separator;
  const char* p = line.data();
  const char* const end = p + line.size();
  while (true) {
    const char* cell = p;
    if (separator == ' ')
      while (p != end && !is_blank(*p)) ++p;
    else
      while (p != end && *p != separator) ++p;
    cells_.push_back(unquoted(trimmed({cell, static_cast<std::size_t>(p - cell)})));
    if (p == end) return;
    ++p;
    if (separator == ' ')
      while (p != end && is_blank(*p)) ++p;
    if (cells_.size() >= most_columns)
      throw Error(fmt::format("has more than {} columns", most_columns), place(), "is this a log of one sensor?");
  }
}

bool TableRows::next() {
  std::string_view line;
  do {
    if (!next_line(line)) return false;
  } while (line.front() == '#');
  split(line);
  if (cells_.size() != shape_.columns) {
    const bool cut_off = place_ == text_.size();
    throw Error(
        fmt::format("row has {} column{}, {} expected", cells_.size(), cells_.size() == 1 ? "" : "s", shape_.columns),
        place(), cut_off ? "the last row is cut off: delete it" : "delete the row, or export the log again");
  }
  return true;
}

double TableRows::number(std::size_t column) const {
  const auto value = finite_double(cells_[column]);
  if (!value) fail_cell(column, "a finite number");
  return *value;
}

std::int64_t TableRows::time_ns(std::size_t column, int exponent_to_ns) const {
  const auto ns = decimal_to_ns(cells_[column], exponent_to_ns);
  if (!ns) fail_cell(column, "a stamp that fits into 64-bit nanoseconds");
  return *ns;
}

void TableRows::fail_cell(std::size_t column, const char* expected) const {
  const std::string name = shape_.names.empty() ? fmt::format("column {}", column + 1)
                                                : fmt::format("column {} ({})", column + 1, shape_.names[column]);
  throw Error(fmt::format("{} is '{}', not {}", name, shown(cells_[column]), expected), place(),
              "correct or delete the row");
}

std::string TableRows::place() const {
  return fmt::format("{}:{}", where_, line_);
}

std::size_t TableRows::rows_left_about() const {
  return (text_.size() - place_) / std::max<std::size_t>(row_bytes_, 1) + 1;
}

}  // namespace takt
