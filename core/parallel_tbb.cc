// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "own_threads.h"
#include "prescene/core/check.h"
#include "prescene/core/parallel.h"

namespace prescene::core {

namespace {

/// How many of so many threads the system makes, ours among them. TBB ends the program where it can't make one.
int possible_threads(int count) {
  std::vector<std::thread> workers;
  std::mutex hold;
  {
    const std::lock_guard lock(hold);  // Until all are there together.
    try {
      while (static_cast<int>(workers.size()) + 1 < count)
        workers.emplace_back([&hold] { const std::lock_guard released(hold); });
    } catch (const std::system_error&) {
      count = 1 + static_cast<int>(workers.size());
    }
  }
  for (std::thread& worker : workers) worker.join();
  return count;
}

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

/// Of the workers that all pools share.
struct SharedThreads {
  explicit SharedThreads(int count) : threads(count), arena(count) {
    if (count > hardware_threads()) {
      more_than_hardware.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
    }
  }
  int threads;
  // TBB has one worker a hardware thread, and warns when an arena asks for more, unless it is configured otherwise.
  std::optional<tbb::global_control> more_than_hardware;
  tbb::task_arena arena;
};

}  // namespace

/// One of both.
struct ThreadPool::Impl {
  Impl(int threads, PoolPriority priority) {
    // Workers of TBB serve all arenas, with one priority, and a block that one has begun holds it.
    if (priority == PoolPriority::kLow)
      own.emplace(threads, priority);
    else
      shared.emplace(possible_threads(threads));
  }
  std::optional<SharedThreads> shared;
  std::optional<OwnThreads> own;
};

ThreadPool::ThreadPool(int threads, PoolPriority priority) {
  PRESCENE_CHECK(threads >= 0);
  if (threads == 0) threads = hardware_threads();
  impl_ = std::make_unique<Impl>(threads, priority);
}

ThreadPool::~ThreadPool() = default;

int ThreadPool::threads() const { return impl_->own ? impl_->own->threads() : impl_->shared->threads; }

void ThreadPool::for_blocks(std::size_t count, std::size_t block,
                            const std::function<void(std::size_t, std::size_t)>& body) {
  if (impl_->own) return impl_->own->for_blocks(count, block, body);
  PRESCENE_CHECK(block > 0);
  const std::size_t blocks = count / block + (count % block != 0);
  if (blocks <= 1) {
    if (blocks == 1) body(0, count);
    return;
  }
  const auto run_blocks = [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t b = range.begin(); b != range.end(); ++b) body(b * block, std::min(count, (b + 1) * block));
  };
  // Isolated, so that a thread that waits for a nested loop does not start another block of the outer one: a body may
  // hold a workspace of its thread while it runs a loop.
  impl_->shared->arena.execute([&] {
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks, 1), run_blocks, tbb::simple_partitioner());
    });
  });
}

void ThreadPool::for_each_index(std::size_t count, const std::function<void(std::size_t)>& body) {
  for_blocks(count, 1, [&](std::size_t begin, std::size_t) { body(begin); });
}

}  // namespace prescene::core
