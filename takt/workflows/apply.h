// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/apply/stamp_map.h"
#include "takt/calibration/estimate.h"
#include "takt/recording/format.h"

/// `takt apply`: a recording with the stamps that a result says are right.
namespace takt {

struct ApplyJob {
  Estimate result;
  std::string in;
  std::string out;     ///< where to write, a name that nobody looks at yet; empty: only say what would change
  std::string stream;  ///< whose stamps move; empty: the result's sensor (or reference)
  Moved moved = Moved::sensor;
  bool record_time = false;  ///< move the recorder's times along
  FrameMeaning meaning;      ///< what a frame's stamp is to mean afterwards
  OpenOptions open;
};

/// Throws takt::Error; std::logic_error where the result has no answer.
[[nodiscard]] Restamped apply(const ApplyJob& job);

/// Gives what was written its final name. Throws takt::Error.
void publish_recording(const std::string& temporary, const std::string& final_name);

}  // namespace takt
