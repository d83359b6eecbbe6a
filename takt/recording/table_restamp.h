// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>

#include "takt/recording/restamp.h"
#include "takt/recording/text_table.h"

namespace takt {

/// Which column of a table is its time, and in which unit.
struct TimeColumn {
  std::size_t column = 0;
  int exponent_to_ns = 0;  ///< s 9, ms 6, µs 3, ns 0
};

/// A table of text, line by line, with other numbers in its time column: header, comments, other cells, separators and
/// line ends stay byte for byte. A cell keeps its decimals and gets as many more as the nanosecond needs; one that does
/// not move is not touched. `find` sees the first rows. `out` may be empty: a rehearsal. What stands before byte
/// `table_at` is copied unseen. Throws takt::Error for rows that the reader would not take either.
void restamp_table(const std::string& in, const std::string& out,
                   const std::function<TimeColumn(TableRows& first_rows)>& find, const std::function<Stamp(Stamp)>& map,
                   const std::function<void(Stamp before, Stamp after)>& saw, std::size_t table_at = 0);

}  // namespace takt
