// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "takt/estimators/pendulum/pendulum.h"
#include "takt/recording/format.h"

/// `takt pendulum`: the output delay of the IMUs on a pendulum's bob.
namespace takt {

struct PendulumJob {
  std::string input;                 ///< a recording, or empty when the two files are named
  std::string angle_file, imu_file;  ///< logs of angle and IMU
  std::string sensor, reference;     ///< stream names; empty: the only angle, and every IMU
  std::string estimator = "all";     ///< spline, damped, extrema; all is spline with the others beside it
  std::string rig_file;              ///< YAML (docs/methods/pendulum.md); empty: rig.yaml of the recording
  std::string dial_method;           ///< coded, keyframes, neighbours; empty: what the dial allows
  int threads = 0;                   ///< that read pictures; 0: as many as there are cores
  std::function<void(std::size_t done, std::size_t total)> progress;
  OpenOptions open;
  PendulumOptions pendulum;
};

struct PendulumOutcome {
  std::vector<Estimate> estimates;  ///< one an IMU; those that cannot be read come last
  std::vector<std::string> notes;   ///< what was assumed while reading
  std::vector<std::string> files;   ///< what was read
};

/// A recording that has no angles of its own may have them in `angle.csv`, else its camera's pictures of the dial are
/// read. A rolling shutter has its line delay estimated, told or not.
/// Throws takt::Error where angles or IMU are missing, std::invalid_argument for an estimator that there is not.
[[nodiscard]] PendulumOutcome calibrate_pendulum(const PendulumJob& job);

}  // namespace takt
