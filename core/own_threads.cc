// SPDX-License-Identifier: Apache-2.0
#include "own_threads.h"

#include <algorithm>
#include <system_error>

#include "prescene/core/check.h"
#include "prescene/core/thread_priority.h"

namespace prescene::core {

OwnThreads::OwnThreads(int count, PoolPriority priority) : threads_(count) {
  try {
    for (int i = 1; i < count; ++i)
      workers_.emplace_back([this, priority] {
        if (priority == PoolPriority::kLow) lower_thread_priority();
        work();
      });
  } catch (const std::system_error&) {
    threads_ = 1 + static_cast<int>(workers_.size());  // The system makes no more.
  }
}

OwnThreads::~OwnThreads() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_workers_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void OwnThreads::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_workers_.wait(lock, [this] { return stopping_ || !open_jobs_.empty(); });
    if (stopping_) return;
    run_block(*open_jobs_.back(), lock);
  }
}

void OwnThreads::run_block(Job& job, std::unique_lock<std::mutex>& lock) {
  const std::size_t b = job.next++;
  if (job.next == job.blocks) open_jobs_.erase(std::find(open_jobs_.begin(), open_jobs_.end(), &job));
  lock.unlock();
  (*job.body)(b * job.block, std::min(job.count, (b + 1) * job.block));
  lock.lock();
  if (++job.done == job.blocks) wake_callers_.notify_all();
}

void OwnThreads::for_blocks(std::size_t count, std::size_t block,
                            const std::function<void(std::size_t, std::size_t)>& body) {
  PRESCENE_CHECK(block > 0);
  Job job{count, block, count / block + (count % block != 0), &body};
  if (job.blocks <= 1) {
    if (job.blocks == 1) body(0, count);
    return;
  }
  std::unique_lock lock(mutex_);
  open_jobs_.push_back(&job);
  wake_workers_.notify_all();
  while (job.next < job.blocks) run_block(job, lock);
  wake_callers_.wait(lock, [&job] { return job.done == job.blocks; });
}

}  // namespace prescene::core
