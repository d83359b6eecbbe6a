// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/chunk_ahead.h"

#include <algorithm>

namespace takt {

namespace {

// Under way besides the chunk that is looked at. More would leave the cache before they are looked at: 8 cost lz4 a
// third more CPU time.
constexpr std::size_t most_ahead = 2;

}  // namespace

ChunkAhead::~ChunkAhead() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

const ChunkBuffer* ChunkAhead::at(const FileRecord& chunk) {
  std::unique_lock lock(mutex_);
  if (current_) spare_.push_back(std::move(current_));
  while (!jobs_.empty() && jobs_.front()->chunk.at != chunk.at) {  // passed over after all
    finish(*jobs_.front(), lock);
    spare_.push_back(std::move(jobs_.front()));
    jobs_.pop_front();
  }
  if (jobs_.empty()) add(chunk);
  while (jobs_.size() <= most_ahead) {
    const auto next = next_(jobs_.back()->chunk);
    if (!next) break;
    add(*next);
  }
  // Threads only where there is something ahead, and one fewer than cores: this one does its share.
  if (workers_.empty() && jobs_.size() > 1)
    for (unsigned i = 1; i < std::clamp(std::thread::hardware_concurrency(), 2U, 3U); ++i)
      workers_.emplace_back([this] { work(); });
  finish(*jobs_.front(), lock);
  current_ = std::move(jobs_.front());
  jobs_.pop_front();
  return current_->good ? &current_->buffer : nullptr;
}

void ChunkAhead::add(const FileRecord& chunk) {
  if (spare_.empty()) spare_.push_back(std::make_unique<Job>());
  jobs_.push_back(std::move(spare_.back()));
  spare_.pop_back();
  jobs_.back()->chunk = chunk;
  jobs_.back()->state = Job::State::waiting;
  changed_.notify_all();
}

ChunkAhead::Job* ChunkAhead::first_waiting() {
  for (const auto& job : jobs_)
    if (job->state == Job::State::waiting) return job.get();
  return nullptr;
}

void ChunkAhead::load(Job& job, std::unique_lock<std::mutex>& lock) {
  job.state = Job::State::under_way;
  lock.unlock();
  const bool good = load_records(file_, job.chunk.records, job.buffer);
  lock.lock();
  job.good = good;
  job.state = Job::State::done;
  changed_.notify_all();
}

/// Waits for a chunk, and rather than idly loads what nobody has begun.
void ChunkAhead::finish(Job& job, std::unique_lock<std::mutex>& lock) {
  while (job.state != Job::State::done) {
    if (Job* const waiting = first_waiting())
      load(*waiting, lock);
    else
      changed_.wait(lock);
  }
}

void ChunkAhead::work() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    if (Job* const waiting = first_waiting())
      load(*waiting, lock);
    else
      changed_.wait(lock);
  }
}

}  // namespace takt
