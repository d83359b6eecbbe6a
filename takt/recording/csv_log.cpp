// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/csv_log.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <numbers>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/log_columns.h"
#include "takt/recording/lower_case.h"
#include "takt/recording/text_table.h"
#include "takt/recording/units.h"

namespace takt {

namespace {

/// The first rows as plain numbers (cells that are none become 0): enough to find columns and units by.
std::vector<std::vector<double>> head_of(TableRows& rows) {
  constexpr std::size_t enough = 2000;
  std::vector<std::vector<double>> head;
  while (head.size() < enough && rows.next()) {
    std::vector<double>& row = head.emplace_back();
    for (std::size_t i = 0; i < rows.shape().columns; ++i) row.push_back(finite_double(rows.cell(i)).value_or(0));
  }
  rows.rewind();
  return head;
}

Vec3 vector_at(const TableRows& rows, const std::array<std::size_t, 3>& columns) {
  return {rows.number(columns[0]), rows.number(columns[1]), rows.number(columns[2])};
}

ImuStream read_imu(TableRows& rows, const LogColumns& columns, int exponent_to_ns) {
  ImuStream imu;
  imu.stamps.reserve(rows.rows_left_about());
  imu.gyro_rad_s.reserve(rows.rows_left_about());
  if (columns.accel) imu.accel_m_s2.reserve(rows.rows_left_about());
  while (rows.next()) {
    imu.stamps.push_back(from_ns(rows.time_ns(columns.time, exponent_to_ns)));
    imu.gyro_rad_s.push_back(vector_at(rows, *columns.gyro));
    if (columns.accel) imu.accel_m_s2.push_back(vector_at(rows, *columns.accel));
  }
  return imu;
}

AngleStream read_angles(TableRows& rows, const LogColumns& columns, int exponent_to_ns) {
  AngleStream angles;
  while (rows.next()) {
    angles.stamps.push_back(from_ns(rows.time_ns(columns.time, exponent_to_ns)));
    angles.angle_rad.push_back(rows.number(*columns.angle));
  }
  return angles;
}

/// Angles are radians unless the header says degrees.
std::string to_radians(std::vector<double>& angles, std::string header) {
  header = lower_case(std::move(header));
  const bool degrees = header.find("deg") != std::string::npos || header.find("\xc2\xb0") != std::string::npos;
  if (degrees)
    for (double& a : angles) a *= std::numbers::pi / 180;
  return degrees ? "angles taken as degrees (from the header)" : "angles taken as radians";
}

/// Phones write one file a sensor, all with the columns x, y, z: then the file's name is the only word.
void refuse_accelerometer(const LogColumns& columns, const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).stem().string());
  if (columns.rates_by_default && name.find("accel") != std::string::npos && name.find("gyro") == std::string::npos)
    throw Error("by its name holds an accelerometer, and takt needs rates", path,
                "give the gyroscope's file; if these are rates, name the columns wx, wy, wz");
}

/// Rates in deg/s or rad/s seldom keep the length of gravity.
bool like_gravity(const std::vector<Vec3>& v) {
  return norm_percentile(v, 0.25) > 9.3 && norm_percentile(v, 0.75) < 10.3;
}

}  // namespace

bool looks_like_csv_log(const std::string& path) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) return false;
  const std::string ending = ending_of(path);
  return ending == ".csv" || ending == ".txt" || ending == ".log" || ending == ".tsv" || ending == ".dat";
}

Recording read_csv_log(const std::string& path, const OpenOptions& options) {
  return read_csv_log(read_file(path), path, options);
}

Recording read_csv_log(std::string_view text, const std::string& path, const OpenOptions& options) {
  TableRows rows(text, path);
  const std::vector<std::vector<double>> head = head_of(rows);
  const LogColumns columns = find_columns(rows.shape(), head, path);
  refuse_accelerometer(columns, path);
  const auto header = [&](std::size_t column) {
    return rows.shape().names.empty() ? std::string() : rows.shape().names[column];
  };
  std::vector<double> times;
  for (const auto& row : head) times.push_back(row[columns.time]);
  const FoundTimeUnit time = find_time_unit(times, header(columns.time), options.time_unit);

  Recording recording;
  recording.files = {path};
  const std::string name = std::filesystem::path(path).stem().string();
  const auto say = [&](const std::string& note) { recording.notes.push_back(name + ": " + note); };
  say(columns.note);
  say(time.note);
  if (columns.gyro) {
    ImuStream imu = read_imu(rows, columns, exponent_to_ns(time.unit));
    imu.name = imu.clock = name;
    if (columns.rates_by_default)
      say(like_gravity(imu.gyro_rad_s)
              ? "x, y, z taken as rates, but their length stays near gravity's: is this an accelerometer's file?"
              : "x, y, z taken as rates, since nothing says what they are");
    say(to_rad_per_s(imu.gyro_rad_s, header((*columns.gyro)[0]), options.rate_unit));
    if (columns.accel) say(to_m_per_s2(imu.accel_m_s2, header((*columns.accel)[0])));
    recording.imus.push_back(std::move(imu));
  } else {
    AngleStream angles = read_angles(rows, columns, exponent_to_ns(time.unit));
    angles.name = angles.clock = name;
    say(to_radians(angles.angle_rad, header(*columns.angle)));
    recording.angles.push_back(std::move(angles));
  }
  return recording;
}

TimeColumn time_column_of_log(TableRows& rows, const std::string& where, TimeUnit asked, std::string& note) {
  const std::vector<std::vector<double>> head = head_of(rows);
  const LogColumns columns = find_columns(rows.shape(), head, where);
  std::vector<double> times;
  for (const auto& row : head) times.push_back(row[columns.time]);
  const std::string header = rows.shape().names.empty() ? std::string() : rows.shape().names[columns.time];
  const FoundTimeUnit unit = find_time_unit(times, header, asked);
  note = unit.note;
  return {columns.time, exponent_to_ns(unit.unit)};
}

ImuStream read_imu_table(std::string_view text, const std::string& where) {
  TableRows rows(text, where);
  const std::size_t columns = rows.shape().columns;
  if (columns != 4 && columns < 7)
    throw Error(fmt::format("has {} columns; t_ns,wx,wy,wz[,ax,ay,az] expected", columns), where,
                "export the IMU again");
  LogColumns fixed{.time = 0, .gyro = {{1, 2, 3}}, .accel = {}, .angle = {}, .note = {}};
  if (columns >= 7) fixed.accel = {{4, 5, 6}};
  return read_imu(rows, fixed, 0);
}

}  // namespace takt
