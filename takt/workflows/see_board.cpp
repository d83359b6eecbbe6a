// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/see_board.h"

#include "takt/signals/target/target_corners.h"

namespace takt {

std::vector<CornerStream> see_board(const std::vector<CameraStream>& cameras, const Target& target, int threads,
                                    const std::function<void(double done)>& progress) {
  std::vector<CornerStream> out;
  for (const CameraStream& camera : cameras) {
    TargetCornersOptions options;
    options.threads = threads;
    options.progress = [&, before = out.size()](std::size_t done, std::size_t total) {
      if (progress && total > 0)
        progress((static_cast<double>(before) + static_cast<double>(done) / static_cast<double>(total)) /
                 static_cast<double>(cameras.size()));
    };
    out.push_back(find_target_corners(camera, target, options));
  }
  return out;
}

}  // namespace takt
