// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/corners.h"

#include "takt/streams/streams.h"

namespace takt {

CornerStream without_corners(const CameraStream& camera, std::vector<Vec3> board) {
  CornerStream out;
  out.name = camera.name;
  out.clock = camera.clock;
  out.stamps = camera.stamps;
  out.exposures_s = camera.exposures_s;
  out.corners.resize(camera.size());
  out.board = std::move(board);
  out.timing = camera.timing;
  out.model = camera.model;
  out.T_body_cam = camera.T_body_cam;
  return out;
}

}  // namespace takt
