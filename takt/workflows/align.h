// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/alignment/alignment.h"
#include "takt/recording/format.h"

/// `takt align`: the offset between a camera (or poses, or a second gyro) and a gyro, from their motion alone.
namespace takt {

struct AlignJob {
  std::vector<std::string> inputs;  ///< one recording with both streams, or two: the sensor's and the reference's
  std::string sensor, reference;    ///< stream names; empty: chosen by kind
  OpenOptions open;
  std::string intrinsics;  ///< camera file (ASL sensor.yaml or Kalibr camchain) that overrides the recording's
  double assumed_fov_rad = 70 * std::numbers::pi / 180;  ///< horizontal field of view where nothing else is known
  AlignmentOptions alignment;
  std::function<void(std::size_t done, std::size_t total)> progress;
};

struct Outcome {
  Estimate estimate;               ///< its notes say what was assumed on the way
  std::vector<std::string> files;  ///< what was read
};

[[nodiscard]] Outcome align(const AlignJob& job);

}  // namespace takt
