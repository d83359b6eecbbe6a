// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>

#include "takt/recording/format.h"
#include "takt/recording/write_messages.h"

/// `takt convert`: a recording's IMUs and cameras in another format.
namespace takt {

enum class ConvertTo { mcap, ros1_bag, db3, asl, csv };
/// By a name's ending: .mcap, .bag, .db3, .csv; without one it is an ASL folder. Throws takt::Error for other endings.
[[nodiscard]] ConvertTo convert_to(const std::string& name);

struct ConvertJob {
  std::string in;
  std::string out;  ///< where to write, a name that nobody looks at yet
  ConvertTo to = ConvertTo::mcap;
  std::string stream;  ///< only those whose names match; empty: all
  OpenOptions open;
  int threads = 0;
  std::function<void(double)> progress;
};

/// Stamps, rates and accelerations are the same bit by bit; so are pictures, and if not they have the same grey. Throws
/// takt::Error.
[[nodiscard]] Written convert(const ConvertJob& job);

}  // namespace takt
