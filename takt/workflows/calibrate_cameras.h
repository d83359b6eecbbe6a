// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/batch/intrinsics.h"
#include "takt/recording/format.h"
#include "takt/streams/corners.h"

/// `takt calibrate --cameras-only`: lenses, and how cameras stand to each other, from pictures of a known board.
namespace takt {

/// A lens model by Kalibr's name for it.
struct LensKind {
  const char* name;
  Projection projection;
  Distortion distortion;
};
/// pinhole-radtan, pinhole-equi, pinhole-fov, pinhole-none, omni-radtan, omni-none, ds-none, eucm-none.
[[nodiscard]] const std::vector<LensKind>& lens_kinds();

struct CamerasJob {
  std::string input;
  std::string target;               ///< Kalibr's target file
  std::string sensor;               ///< camera's name; empty: all
  std::vector<std::string> lenses;  ///< names of `lens_kinds`: one for all cameras, or one each
  OpenOptions open;
  int threads = 0;
  std::function<void(double done)> progress;  ///< 0 to 1
};

/// One camera of the answer.
struct CameraAnswer {
  std::string name;
  std::string lens;
  batch::CalibratedCamera found;
  std::optional<batch::CameraPair> to_before;  ///< to the camera before it in the recording
  std::vector<int> overlaps;                   ///< cameras that saw the board at the same time
};

struct CalibratedCameras {
  Verdict verdict = Verdict::refused;  ///< refused where no camera has an answer, weak where one has not
  std::vector<std::string> reasons;    ///< all cameras', each with its name
  std::vector<CameraAnswer> cameras;
  std::vector<std::string> notes;
  std::vector<std::string> files;  ///< what was read
  Provenance provenance;
};

/// Throws takt::Error for files that fail, a recording without a camera, and lenses that do not fit the cameras.
[[nodiscard]] CalibratedCameras calibrate_cameras(const CamerasJob& job);

/// The result object (docs/formats/result.md).
[[nodiscard]] std::string to_json(const CalibratedCameras& result);
[[nodiscard]] std::string to_yaml(const CalibratedCameras& result);

/// The HTML page: intrinsics with σ, how the cameras stand to each other, residuals and coverage of each.
[[nodiscard]] std::string report_page(const CalibratedCameras& result);

/// Kalibr's files of a camera calibration: <prefix>-camchain.yaml, <prefix>-results-cam.txt, as text. Refused cameras
/// are not in them, so that camN of the file is the N-th that has an answer.
struct KalibrCameraFiles {
  std::string camchain, results;
};
[[nodiscard]] KalibrCameraFiles kalibr_camera_files(const CalibratedCameras& result, bool opencv);

/// What a terminal shows: a camera's models with σ, its residuals and verdict.
[[nodiscard]] std::string in_words(const CalibratedCameras& result);

}  // namespace takt
