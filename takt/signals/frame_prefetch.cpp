// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/frame_prefetch.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace takt {

struct FramePrefetch::State {
  std::unique_ptr<FrameReader> reader;
  std::size_t ahead = 0;

  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<Frame> waiting;
  std::size_t broken = 0;
  bool finished = false;
  std::exception_ptr failure;
  std::jthread decoder;  // last: it stops before the rest goes

  void decode(const std::stop_token& stop) {
    try {
      while (std::optional<Frame> frame = reader->next()) {
        std::unique_lock lock(mutex);
        broken = reader->broken();
        if (!changed.wait(lock, stop, [this] { return waiting.size() < ahead; })) return;
        waiting.push_back(std::move(*frame));
        changed.notify_all();
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    broken = reader->broken();
    finished = true;
    changed.notify_all();
  }
};

FramePrefetch::FramePrefetch(std::unique_ptr<FrameReader> reader, std::size_t ahead)
    : state_(std::make_unique<State>()) {
  if (!reader) throw std::invalid_argument("FramePrefetch: no reader");
  state_->reader = std::move(reader);
  state_->ahead = ahead;
  if (ahead > 0) state_->decoder = std::jthread([s = state_.get()](const std::stop_token& stop) { s->decode(stop); });
}

FramePrefetch::~FramePrefetch() = default;

std::optional<Frame> FramePrefetch::next() {
  State& s = *state_;
  if (s.ahead == 0) return s.reader->next();
  std::unique_lock lock(s.mutex);
  s.changed.wait(lock, [&s] { return !s.waiting.empty() || s.finished; });
  if (s.waiting.empty()) {
    if (s.failure) std::rethrow_exception(std::exchange(s.failure, nullptr));
    return std::nullopt;
  }
  Frame frame = std::move(s.waiting.front());
  s.waiting.pop_front();
  s.changed.notify_all();
  return frame;
}

std::size_t FramePrefetch::broken() const {
  if (state_->ahead == 0) return state_->reader->broken();
  const std::lock_guard lock(state_->mutex);
  return state_->broken;
}

}  // namespace takt
