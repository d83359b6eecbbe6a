// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// GPMF, the telemetry that GoPro cameras write: big-endian key–length–value items, padded to 4 bytes, that may nest
/// (https://gopro.github.io/gpmf-parser). Bytes in, plain data out; no file, no clock.
namespace takt::gpmf {

/// One item. `bytes` and `children` view the payload that was parsed.
struct Item {
  std::string key;                   ///< "GYRO"
  char type = 0;                     ///< 's' int16, 'f' float, ...; 0: nested, see `children`
  std::size_t sample_bytes = 0;      ///< size of one sample, all its columns
  std::size_t samples = 0;           ///< how often it repeats
  std::span<const std::byte> bytes;  ///< without the padding
  std::vector<Item> children;
};

/// All items up to the end, or up to the first damage: then `problem` says what is wrong at which byte.
struct Payload {
  std::vector<Item> items;
  std::string problem;  ///< empty: sound
};
[[nodiscard]] Payload parse(std::span<const std::byte> bytes);

/// A table of numbers, row after row.
struct Numbers {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;
  [[nodiscard]] double operator()(std::size_t row, std::size_t column) const { return values[row * columns + column]; }
};
/// An item's values as stored. `structure` is what a TYPE item said, for items of type '?'. Columns that are no numbers
/// (dates, identifiers) are NaN. Nothing where the layout does not fit the sample size or is unknown.
[[nodiscard]] std::optional<Numbers> numbers(const Item& item, std::string_view structure = {});
/// Text of an item of type 'c' (also 'F', 'U'), without trailing zeros. Degree and micro signs become UTF-8.
[[nodiscard]] std::string text(const Item& item);

/// One STRM: the data item and what stands before it and says what it means.
struct Stream {
  std::string device;                    ///< DVNM: "HERO8 Black"
  std::string name;                      ///< STNM: "Gyroscope (z,x,y)"
  std::string key;                       ///< of the data item, which is the last of the STRM: "GYRO"
  std::string unit;                      ///< SIUN or UNIT, of the first column
  std::optional<std::int64_t> total;     ///< TSMP: samples since the start of the recording, these ones included
  std::optional<std::int64_t> stamp_us;  ///< STMP: when the first of these samples arrived
  std::optional<std::int64_t> tick_ms;   ///< TICK: the same, coarse, from the operating system's clock
  std::optional<double> temperature_c;   ///< TMPC
  std::string stored_axes;               ///< ORIN: "zxY": column 0 is −Z, 1 is −X, 2 is Y
  std::string output_axes;               ///< ORIO: axes of the rows of MTRX
  std::vector<double> matrix;            ///< MTRX, row-major 3×3
  std::optional<double> delay_s;         ///< TIMO
  Numbers data;                          ///< divided by SCAL
};
/// Every STRM of every device whose data are numbers. What cannot be read is left out.
[[nodiscard]] std::vector<Stream> streams(const Payload& payload);

}  // namespace takt::gpmf
