// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Text with one row a line: CSV in its usual variations.
namespace takt {

/// What the first lines of a table say. `#` lines, and a first line that is not numbers, are its header.
struct TableShape {
  char separator = ',';  ///< ',', ';', tab, or ' ' for any run of blanks
  std::size_t columns = 0;
  std::vector<std::string> names;  ///< from the header, one a column; empty without a header
};

/// Walks the rows of a table, in place: cells are views into the text.
class TableRows {
 public:
  /// Throws takt::Error where the text is empty, binary or has no row of numbers.
  TableRows(std::string_view text, std::string where);

  [[nodiscard]] const TableShape& shape() const { return shape_; }
  /// Goes to the next row; false at the end. Blank and `#` lines are passed over.
  /// Throws takt::Error where a row has another number of columns.
  bool next();
  [[nodiscard]] std::string_view cell(std::size_t column) const { return cells_[column]; }
  /// The cell as a finite number. Throws takt::Error naming line and column.
  [[nodiscard]] double number(std::size_t column) const;
  /// The cell as an exact stamp (decimal.h). Throws likewise.
  [[nodiscard]] std::int64_t time_ns(std::size_t column, int exponent_to_ns) const;
  /// "file.csv:17"
  [[nodiscard]] std::string place() const;
  /// Bytes of text after the current row, and of the current row with its line end: to reserve memory by.
  [[nodiscard]] std::size_t rows_left_about() const;
  /// Bytes of text before the first row.
  [[nodiscard]] std::size_t header_bytes() const { return mark_bytes_ + first_place_; }
  /// Back before the first row.
  void rewind();

 private:
  bool next_line(std::string_view& line);
  void split(std::string_view line);
  [[noreturn]] void fail_cell(std::size_t column, const char* expected) const;

  std::string_view text_;
  std::string where_;
  TableShape shape_;
  std::vector<std::string_view> cells_;
  std::size_t place_ = 0;        // byte after the current line
  std::size_t line_ = 0;         // its number, from 1
  std::size_t row_bytes_ = 0;    // length of the current line
  std::size_t mark_bytes_ = 0;   // of the byte order mark, which the text is without
  std::size_t first_place_ = 0;  // where rows begin
  std::size_t first_line_ = 0;
};

}  // namespace takt
