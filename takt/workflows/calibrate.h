// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/batch/batch.h"
#include "takt/recording/format.h"
#include "takt/streams/corners.h"

/// `takt calibrate`: cameras against IMUs, all on one body that was moved before a known board.
namespace takt {

struct CalibrateJob {
  std::string input;
  std::string target;             ///< Kalibr's target file
  std::string camchain;           ///< Kalibr's camchain, for intrinsics; empty: the recording's own
  std::string imu;                ///< Kalibr's imu file: its noise figures are compared with what is measured
  std::string sensor, reference;  ///< stream names; empty: every camera, every IMU with an accelerometer
  OpenOptions open;
  BatchOptions batch;
  std::function<void(double done)> progress;  ///< 0 to 1
};

struct Calibrated {
  /// The first camera against the first IMU. Further cameras and IMUs follow in `estimates`: each camera against the
  /// first IMU, each IMU (as the sensor) against the first one.
  Estimate estimate;
  std::vector<std::string> files;     ///< what was read
  std::vector<CornerStream> cameras;  ///< what was seen, for the files that are written
  std::vector<Estimate> all;          ///< one a camera, then one a further IMU, refused ones included
  double imu_rate_hz = 0;
};

/// Throws takt::Error for files that fail and recordings without a camera or an IMU.
[[nodiscard]] Calibrated calibrate(const CalibrateJob& job);

/// Kalibr's result files: <prefix>-camchain-imucam.yaml, <prefix>-imu.yaml, <prefix>-results-imucam.txt, as text.
/// Stamps are the recording's: where those do not mean the middle of the exposure, the time shift has the difference.
struct KalibrFiles {
  std::string camchain, imu, results;
};
/// `opencv`: so that OpenCV's FileStorage reads them too.
[[nodiscard]] KalibrFiles kalibr_files(const Calibrated& result, bool opencv);

}  // namespace takt
