// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/target_corners.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <vector>

#include "takt/signals/target/corner_finder.h"

namespace takt {

namespace {

/// Frames that are followed without a fresh start; fewer where they are large, for a piece is held in memory.
constexpr std::size_t longest_piece = 32;
constexpr std::size_t piece_bytes = 32U << 20;

/// The threads' common source of work: pieces of the film in order.
class Pieces {
 public:
  Pieces(const CameraStream& stream) : reader_(stream.open()) {}

  /// The next frames, decoded under the lock; empty at the end.
  std::vector<Frame> next() {
    const std::lock_guard lock(guard_);
    std::vector<Frame> piece;
    std::size_t bytes = 0;
    while (piece.size() < longest_piece && bytes < piece_bytes) {
      auto frame = reader_->next();
      if (!frame) break;
      bytes += static_cast<std::size_t>(frame->image.width) * static_cast<std::size_t>(frame->image.height);
      piece.push_back(std::move(*frame));
    }
    return piece;
  }

 private:
  std::mutex guard_;
  std::unique_ptr<FrameReader> reader_;
};

}  // namespace

CornerStream find_target_corners(const CameraStream& stream, const Target& target,
                                 const TargetCornersOptions& options) {
  CornerStream out = without_corners(stream, board_points(target));
  const BoardLayout layout = board_layout(target);
  Pieces pieces(stream);
  std::atomic<std::size_t> done{0};
  std::mutex guard;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::vector<Frame> piece = pieces.next(); !piece.empty(); piece = pieces.next()) {
        CornerFinder finder(layout);
        for (const Frame& frame : piece)
          out.corners[frame.index] = finder.find(frame.image, seconds_since(stream.stamps.front(), frame.stamp));
        done += piece.size();
        if (!options.progress) continue;
        const std::lock_guard lock(guard);
        options.progress(done, stream.size());
      }
    } catch (...) {
      const std::lock_guard lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int threads = options.threads > 0 ? options.threads : cores;
  {
    std::vector<std::jthread> helpers;
    for (int i = 1; i < threads; ++i) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return out;
}

}  // namespace takt
