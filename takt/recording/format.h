// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/recording/restamp.h"
#include "takt/streams/streams.h"

namespace takt {

/// The unit of a log's time column. `automatic`: from its header, else from spacing and magnitude, and said in the
/// notes.
enum class TimeUnit { automatic, s, ms, us, ns };
/// The unit of a log's angular rates. `automatic`: from its header, else from the magnitude, and said in the notes.
enum class RateUnit { automatic, rad_s, deg_s };

struct OpenOptions {
  TimeUnit time_unit = TimeUnit::automatic;  ///< used where a file's time unit is not fixed by its format
  RateUnit rate_unit = RateUnit::automatic;  ///< likewise for rates
  std::optional<double> from_s = {};         ///< cut, s since the first stamp of each clock; nothing: from the start
  std::optional<double> to_s = {};           ///< nothing: to the end
  int decode_threads = 2;                    ///< of a video's decoder
  int frame_shift = 0;  ///< numbered pictures beside a stamp list: picture N has the (N + shift)-th stamp, from 1
};

/// One row of the table of formats. A new format is one file pair `<format>.{h,cpp}` with the first two functions and a
/// row in `formats` (open_recording.cpp). The cut of OpenOptions is applied by open_recording, not by formats.
struct Format {
  const char* name;                        ///< as it stands in Recording::format: "ASL folder"
  bool (*sniff)(const std::string& path);  ///< cheap, never throws: a look at names or at the first bytes
  Recording (*read)(const std::string& path, const OpenOptions& options);  ///< throws takt::Error
  /// Writes `in` with other stamps to `out`, a file or folder that is not there yet; nothing is written where `out` is
  /// empty. Null where the format cannot be written. Throws takt::Error.
  Restamped (*restamp)(const std::string& in, const std::string& out, const Restamping& order,
                       const OpenOptions& options) = nullptr;
};

}  // namespace takt
