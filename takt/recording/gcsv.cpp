// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gcsv.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"

namespace takt {

namespace {

constexpr std::string_view first_line = "GYROFLOW IMU LOG";
constexpr std::string_view other_first_line = "CAMERA IMU LOG";
constexpr double standard_gravity = 9.80665;
constexpr std::size_t most_header_bytes = 1U << 16;

struct Header {
  std::map<std::string, std::string, std::less<>> values;
  std::size_t table_at = 0;  ///< the line that names the columns
  std::size_t lines = 0;     ///< before it
};

Header read_header(std::string_view text, const std::string& where) {
  Header header;
  std::size_t at = 0;
  while (at < std::min(text.size(), most_header_bytes)) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    const std::size_t comma = line.find(',');
    const std::string_view key = line.substr(0, comma);
    if (key == "t") {
      header.table_at = at;
      return header;
    }
    if (comma != std::string_view::npos) header.values[std::string(key)] = line.substr(comma + 1);
    at = end + 1;
    ++header.lines;
  }
  throw Error("has no line t,gx,gy,gz after its header", where, "check that the log was written to its end");
}

/// A scale of the header; `otherwise` where it is not given.
double scale(const Header& header, const char* key, double otherwise, const std::string& where) {
  const auto found = header.values.find(key);
  if (found == header.values.end()) return otherwise;
  const auto value = finite_double(found->second);
  if (!value || *value == 0) throw Error(std::string(key) + " is no scale", where, "correct the header");
  return *value;
}

/// "YxZ": which of the log's axes stands in each place, small letters with the other sign.
struct Axes {
  std::array<int, 3> from{0, 1, 2};
  std::array<double, 3> sign{1, 1, 1};

  [[nodiscard]] Vec3 operator()(const Vec3& v) const {
    return {sign[0] * v[from[0]], sign[1] * v[from[1]], sign[2] * v[from[2]]};
  }
};

Axes read_orientation(const Header& header, const std::string& name, std::vector<std::string>& notes) {
  const auto found = header.values.find("orientation");
  if (found == header.values.end()) return {};
  const std::string& text = found->second;
  Axes axes;
  Mat3 turn = Mat3::Zero();
  for (std::size_t i = 0; i < std::min<std::size_t>(text.size(), 3); ++i) {
    const int axis = std::toupper(static_cast<unsigned char>(text[i])) - 'X';
    if (axis < 0 || axis > 2) continue;
    axes.from[i] = axis;
    axes.sign[i] = std::isupper(static_cast<unsigned char>(text[i])) ? 1 : -1;
    turn(static_cast<int>(i), axis) = axes.sign[i];
  }
  if (text.size() == 3 && std::abs(turn.determinant() - 1) < 0.5) return axes;
  notes.push_back(fmt::format("{}: its orientation '{}' is no rotation; the axes are left as they stand", name,
                              text.substr(0, 16)));
  return {};
}

/// The unit of the time column, in 1e-18 s.
std::int64_t time_unit(const Header& header, const std::string& where) {
  const auto tscale = header.values.find("tscale");
  const auto unit = decimal_to_ns(tscale == header.values.end() ? "0.001" : tscale->second, 18);
  if (!unit || *unit <= 0) throw Error("tscale is no time unit", where, "correct the header");
  return *unit;
}

std::optional<int> exponent_to_ns(std::int64_t unit) {
  int power = 0;
  for (; unit % 10 == 0; unit /= 10) ++power;
  return unit == 1 ? std::optional(power - 9) : std::nullopt;
}

/// The first cell times its unit, which is given in 1e-18 s. Exact where the unit is a power of ten, as in most logs.
std::int64_t stamp_ns(const TableRows& rows, std::int64_t unit) {
  if (const auto exponent = exponent_to_ns(unit)) return rows.time_ns(0, *exponent);
  const std::int64_t thousandths = rows.time_ns(0, 3);
  const long double ns = static_cast<long double>(thousandths) * static_cast<long double>(unit) * 1e-12L;
  if (!(std::abs(ns) < 9e18L)) throw Error("stamp does not fit into 64-bit nanoseconds", rows.place(), "check tscale");
  return static_cast<std::int64_t>(std::llroundl(ns));
}

}  // namespace

bool looks_like_gcsv(const std::string& path) {
  const std::string head = file_head(path, 64);
  return head.starts_with(first_line) || head.starts_with(other_first_line);
}

Recording read_gcsv(const std::string& path, const OpenOptions&) {
  return read_gcsv(read_file(path), path);
}

GcsvTable gcsv_table(std::string_view head, const std::string& where) {
  const Header header = read_header(head, where);
  return {header.table_at, exponent_to_ns(time_unit(header, where))};
}

Recording read_gcsv(std::string_view text, const std::string& path) {
  const Header header = read_header(text, path);
  const std::int64_t unit = time_unit(header, path);
  const double gyro_scale = scale(header, "gscale", 1, path), accel_scale = scale(header, "ascale", 1, path);

  Recording recording;
  recording.files = {path};
  ImuStream imu;
  imu.name = imu.clock = std::filesystem::path(path).stem().string();
  const Axes axes = read_orientation(header, imu.name, recording.notes);
  TableRows rows(text.substr(header.table_at), path);
  const std::size_t columns = rows.shape().columns;
  if (columns < 4) throw Error(fmt::format("has {} columns; t,gx,gy,gz expected", columns), path, "export it again");
  while (rows.next()) {
    imu.stamps.push_back(from_ns(stamp_ns(rows, unit)));
    imu.gyro_rad_s.push_back(gyro_scale * axes({rows.number(1), rows.number(2), rows.number(3)}));
    if (columns >= 7)
      imu.accel_m_s2.push_back(standard_gravity * accel_scale * axes({rows.number(4), rows.number(5), rows.number(6)}));
  }
  recording.notes.push_back(imu.name + ": times, rates and accelerations scaled as its header says");
  if (const auto readout = header.values.find("frame_readout_time"); readout != header.values.end())
    recording.notes.push_back(
        fmt::format("{}: its header says that the video's readout is {} ms", imu.name, readout->second.substr(0, 16)));
  recording.imus.push_back(std::move(imu));
  return recording;
}

}  // namespace takt
