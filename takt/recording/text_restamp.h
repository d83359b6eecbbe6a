// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/recording/format.h"

namespace takt {

/// An ASL folder with other stamps in a sensor's data.csv, and in its exposure.csv, which goes by the same stamps.
/// Pictures keep their names. Throws takt::Error where no sensor has that name.
[[nodiscard]] Restamped restamp_asl(const std::string& in, const std::string& out, const Restamping& order,
                                    const OpenOptions& options);

/// A tracks folder, likewise: camN_tracks.csv and imuN.csv.
[[nodiscard]] Restamped restamp_tracks_folder(const std::string& in, const std::string& out, const Restamping& order,
                                              const OpenOptions& options);

/// A bare log with other numbers in its time column, in the log's own unit.
[[nodiscard]] Restamped restamp_csv_log(const std::string& in, const std::string& out, const Restamping& order,
                                        const OpenOptions& options);

}  // namespace takt
