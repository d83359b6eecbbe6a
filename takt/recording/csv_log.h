// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "takt/recording/format.h"
#include "takt/recording/table_restamp.h"

/// Bare logs: gyro or IMU `t,wx,wy,wz[,ax,ay,az]`, and angle `t,angle`, as text in any of the usual separators.
/// Column meaning, time unit and rate unit are found and said in the notes; stamps keep every nanosecond.
namespace takt {

[[nodiscard]] bool looks_like_csv_log(const std::string& path);
[[nodiscard]] Recording read_csv_log(const std::string& path, const OpenOptions& options);
/// The same from memory; `path` gives the stream its name.
[[nodiscard]] Recording read_csv_log(std::string_view text, const std::string& path, const OpenOptions& options);

/// An IMU log whose columns and units a format fixes: t [ns], rates [rad/s], accelerations [m/s²] in columns 1 to 7
/// (1 to 4 without accelerometer). Order is kept. Throws takt::Error with file and line.
[[nodiscard]] ImuStream read_imu_table(std::string_view text, const std::string& where);

/// Which column of a log is its time, and its unit; what was found is said in `note`.
[[nodiscard]] TimeColumn time_column_of_log(TableRows& rows, const std::string& where, TimeUnit asked,
                                            std::string& note);

/// The log with other numbers in its time column, in its own unit.
[[nodiscard]] Restamped restamp_csv_log(const std::string& in, const std::string& out, const Restamping& order,
                                        const OpenOptions& options);

}  // namespace takt
