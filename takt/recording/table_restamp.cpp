// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/table_restamp.h"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/output_file.h"

namespace takt {

namespace {

constexpr std::size_t head_bytes = 1U << 20;
constexpr std::size_t block_bytes = 1U << 20;
constexpr std::size_t most_line_bytes = 1U << 20;

/// Lines of a file with their ends, one after the other.
class Lines {
 public:
  Lines(const ByteSource& file, std::uint64_t from) : file_(file), at_(from) {}

  /// Valid until the next one. False at the end.
  bool next(std::string_view& line, const std::string& where) {
    std::size_t end = text_.find('\n', place_);
    while (end == std::string::npos && at_ < file_.size()) {
      text_.erase(0, place_);
      place_ = 0;
      if (text_.size() > most_line_bytes) throw Error("has a line of more than a megabyte", where, "is this a table?");
      const std::size_t before = text_.size();
      text_.resize(before + static_cast<std::size_t>(std::min<std::uint64_t>(block_bytes, file_.size() - at_)));
      const auto block = std::as_writable_bytes(std::span(text_)).subspan(before);
      if (!file_.read(at_, block)) throw Error("broke off while being read", where, "is the disk well?");
      at_ += block.size();
      end = text_.find('\n', before);
    }
    if (place_ == text_.size()) return false;
    const std::size_t size = (end == std::string::npos ? text_.size() : end + 1) - place_;
    line = std::string_view(text_).substr(place_, size);
    place_ += size;
    return true;
  }

 private:
  const ByteSource& file_;
  std::uint64_t at_;
  std::string text_;
  std::size_t place_ = 0;
};

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/// A cell without blanks and quotes around it, as TableRows sees it.
std::string_view cell_at(std::string_view line, char separator, std::size_t column) {
  const auto trim = [](std::string_view s) {
    while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
    while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
    return s;
  };
  line = trim(line);
  for (; column > 0; --column) {
    const std::size_t end = separator == ' ' ? line.find_first_of(" \t") : line.find(separator);
    if (end == std::string_view::npos) return {};
    line.remove_prefix(end + 1);
    if (separator == ' ') line = trim(line);
  }
  const std::size_t end = separator == ' ' ? line.find_first_of(" \t") : line.find(separator);
  line = trim(line.substr(0, end));
  if (line.size() >= 2 && line.front() == '"' && line.back() == '"') line = line.substr(1, line.size() - 2);
  return line;
}

int decimals_of(std::string_view number) {
  const std::size_t point = number.find('.');
  if (point == std::string_view::npos || number.find_first_of("eE") != std::string_view::npos) return 0;
  return static_cast<int>(number.size() - point - 1);
}

}  // namespace

void restamp_table(const std::string& in, const std::string& out,
                   const std::function<TimeColumn(TableRows& first_rows)>& find, const std::function<Stamp(Stamp)>& map,
                   const std::function<void(Stamp before, Stamp after)>& saw, std::size_t table_at) {
  const auto file = open_bytes(in);
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(table_at + head_bytes, file->size())), '\0');
  if (!file->read(0, std::as_writable_bytes(std::span(head)))) throw Error("cannot be read", in, "");
  if (head.size() < file->size()) head.resize(head.rfind('\n') + 1);  // the last line may be cut
  TableRows rows(std::string_view(head).substr(std::min(table_at, head.size())), in);
  const TimeColumn time = find(rows);
  const char separator = rows.shape().separator;
  const std::size_t rows_at = table_at + rows.header_bytes();

  OutputFile output(out);
  output.copy(*file, 0, rows_at);
  Lines lines(*file, rows_at);
  auto number =
      static_cast<std::size_t>(std::count(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(rows_at), '\n'));
  for (std::string_view line; lines.next(line, in);) {
    ++number;
    const std::size_t begin = line.find_first_not_of(" \t\r\n");
    const bool is_row = begin != std::string_view::npos && line[begin] != '#';
    const std::string_view cell = is_row ? cell_at(line, separator, time.column) : std::string_view();
    const auto ns = decimal_to_ns(cell, time.exponent_to_ns);
    if (is_row && !ns)
      throw Error(fmt::format("column {} is no stamp", time.column + 1), fmt::format("{}:{}", in, number),
                  "correct or delete the row");
    const Stamp before = from_ns(ns.value_or(0)), after = is_row ? map(before) : before;
    if (is_row) saw(before, after);
    if (after == before) {
      output.write(std::as_bytes(std::span(line)));
      continue;
    }
    const auto at = static_cast<std::size_t>(cell.data() - line.data());
    output.write(std::as_bytes(std::span(line.substr(0, at))));
    output.write(decimal_of_ns(to_ns(after), time.exponent_to_ns, decimals_of(cell)));
    output.write(std::as_bytes(std::span(line.substr(at + cell.size()))));
  }
  output.finish();
}

}  // namespace takt
