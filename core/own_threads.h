// SPDX-License-Identifier: Apache-2.0
// Parallel loops on threads of the standard library. A loop is a job with a counter of its next block; idle threads
// join the newest job that has blocks left, and the caller works on its own job until none is left, then waits for the
// blocks that others still run. Such a block waits at most for loops inside it, so nesting can't deadlock.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "prescene/core/parallel.h"

namespace prescene::core {

class OwnThreads {
 public:
  /// The caller of a loop and count - 1 threads of its own; fewer where the system makes no more.
  OwnThreads(int count, PoolPriority priority);
  ~OwnThreads();
  OwnThreads(const OwnThreads&) = delete;
  OwnThreads& operator=(const OwnThreads&) = delete;

  int threads() const { return threads_; }
  /// As ThreadPool::for_blocks.
  void for_blocks(std::size_t count, std::size_t block, const std::function<void(std::size_t, std::size_t)>& body);

 private:
  struct Job {
    std::size_t count;
    std::size_t block;
    std::size_t blocks;
    const std::function<void(std::size_t, std::size_t)>* body;
    std::size_t next = 0;  // Guarded by the mutex, like `done`.
    std::size_t done = 0;
  };
  void work();
  // Takes the job's next block and runs it without the lock. The job must have one left.
  void run_block(Job& job, std::unique_lock<std::mutex>& lock);

  int threads_;
  std::mutex mutex_;
  std::condition_variable wake_workers_;
  std::condition_variable wake_callers_;
  std::vector<Job*> open_jobs_;  // Those with blocks left; they live on the stacks of their callers.
  bool stopping_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace prescene::core
