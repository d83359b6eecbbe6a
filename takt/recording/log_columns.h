// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "takt/recording/text_table.h"

namespace takt {

/// Which columns of a log mean what, counted from 0.
struct LogColumns {
  std::size_t time = 0;
  std::optional<std::array<std::size_t, 3>> gyro;
  std::optional<std::array<std::size_t, 3>> accel;
  std::optional<std::size_t> angle;
  bool rates_by_default = false;  ///< three columns alone, with no word of what they measure
  std::string note;
};

/// By the header's names where there is a header: t, time, timestamp, t_ns ...; wx, gx, GyroX, gyro_x, w_RS_S_x ...;
/// ax, acc_x, a_RS_S_x ...; angle, theta; plain X, Y, Z are accelerations beside named rates, else rates.
/// Without one by place: the first column that only grows is time (else the last one), then 1 angle, 3 rates, or 3
/// rates and 3 accelerations. `head` holds the first rows. Throws takt::Error at `where`.
[[nodiscard]] LogColumns find_columns(const TableShape& shape, const std::vector<std::vector<double>>& head,
                                      const std::string& where);

}  // namespace takt
