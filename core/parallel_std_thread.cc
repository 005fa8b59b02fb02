// SPDX-License-Identifier: Apache-2.0
// The loops on threads of the standard library, which the thread sanitizer can see into (Debian's libtbb is not
// instrumented).
#include <algorithm>
#include <thread>

#include "own_threads.h"
#include "prescene/core/check.h"
#include "prescene/core/parallel.h"

namespace prescene::core {

struct ThreadPool::Impl {
  OwnThreads threads;
};

ThreadPool::ThreadPool(int threads, PoolPriority priority) {
  PRESCENE_CHECK(threads >= 0);
  if (threads == 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  impl_ = std::unique_ptr<Impl>(new Impl{{threads, priority}});
}

ThreadPool::~ThreadPool() = default;

int ThreadPool::threads() const { return impl_->threads.threads(); }

void ThreadPool::for_blocks(std::size_t count, std::size_t block,
                            const std::function<void(std::size_t, std::size_t)>& body) {
  impl_->threads.for_blocks(count, block, body);
}

void ThreadPool::for_each_index(std::size_t count, const std::function<void(std::size_t)>& body) {
  for_blocks(count, 1, [&](std::size_t begin, std::size_t) { body(begin); });
}

}  // namespace prescene::core
