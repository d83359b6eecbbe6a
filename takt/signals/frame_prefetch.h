// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>

#include "takt/streams/streams.h"

namespace takt {

/// Decodes ahead in a thread of its own, so that decoding and tracking share two cores. The frames and their order are
/// the reader's; an error of the reader is thrown by the `next` that would have got its frame.
class FramePrefetch {
 public:
  /// At most `ahead` decoded frames wait; 0 decodes in the caller's thread.
  FramePrefetch(std::unique_ptr<FrameReader> reader, std::size_t ahead);
  ~FramePrefetch();
  FramePrefetch(const FramePrefetch&) = delete;
  FramePrefetch& operator=(const FramePrefetch&) = delete;

  std::optional<Frame> next();
  /// Frames that could not be decoded so far; complete once `next` has returned nothing.
  [[nodiscard]] std::size_t broken() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt
