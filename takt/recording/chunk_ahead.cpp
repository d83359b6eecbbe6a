// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/chunk_ahead.h"

namespace takt {

namespace {

constexpr std::size_t ahead = 2;  // chunks under way besides the one that is looked at

}  // namespace

void ChunkAhead::start(std::uint64_t place) {
  std::unique_ptr<ChunkBuffer> buffer;
  if (spare_.empty()) {
    buffer = std::make_unique<ChunkBuffer>();
  } else {
    buffer = std::move(spare_.back());
    spare_.pop_back();
  }
  ChunkBuffer* const into = buffer.get();
  jobs_.push_back(
      {place, std::move(buffer), std::async(std::launch::async, [this, place, into] { return load_(place, *into); })});
}

const ChunkBuffer* ChunkAhead::at(std::uint64_t place) {
  if (current_) spare_.push_back(std::move(current_));
  while (!jobs_.empty() && jobs_.front().place != place) {  // passed over after all
    jobs_.front().done.wait();
    spare_.push_back(std::move(jobs_.front().buffer));
    jobs_.pop_front();
  }
  if (jobs_.empty()) start(place);
  while (jobs_.size() <= ahead) {
    const std::uint64_t next = next_(jobs_.back().place);
    if (next == 0) break;
    start(next);
  }
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  const bool good = job.done.get();
  current_ = std::move(job.buffer);
  return good ? current_.get() : nullptr;
}

}  // namespace takt
