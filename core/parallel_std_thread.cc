// SPDX-License-Identifier: Apache-2.0
// The loops on threads of the standard library, which the thread sanitizer can see into (Debian's libtbb is not
// instrumented). A loop is a job with a counter of its next block; idle threads join the newest job that has blocks
// left, and the caller works on its own job until none is left, then waits for the blocks that others still run. Such a
// block waits at most for loops inside it, so nesting can't deadlock.
#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>

#include "prescene/core/check.h"
#include "prescene/core/parallel.h"

namespace prescene::core {
namespace {

struct Job {
  std::size_t count;
  std::size_t block;
  std::size_t blocks;
  const std::function<void(std::size_t, std::size_t)>* body;
  std::size_t next = 0;  // Guarded by the pool's mutex, like `done`.
  std::size_t done = 0;
};

}  // namespace

struct ThreadPool::Impl {
  explicit Impl(int count) : threads(count) {
    try {
      for (int i = 1; i < count; ++i) workers.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      threads = 1 + static_cast<int>(workers.size());  // The system makes no more.
    }
  }
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    wake_workers.notify_all();
    for (std::thread& worker : workers) worker.join();
  }

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      wake_workers.wait(lock, [this] { return stopping || !open_jobs.empty(); });
      if (stopping) return;
      run_block(*open_jobs.back(), lock);
    }
  }

  // Takes the job's next block and runs it without the lock. The job must have one left.
  void run_block(Job& job, std::unique_lock<std::mutex>& lock) {
    const std::size_t b = job.next++;
    if (job.next == job.blocks) open_jobs.erase(std::find(open_jobs.begin(), open_jobs.end(), &job));
    lock.unlock();
    (*job.body)(b * job.block, std::min(job.count, (b + 1) * job.block));
    lock.lock();
    if (++job.done == job.blocks) wake_callers.notify_all();
  }

  void run(Job& job) {
    std::unique_lock lock(mutex);
    open_jobs.push_back(&job);
    wake_workers.notify_all();
    while (job.next < job.blocks) run_block(job, lock);
    wake_callers.wait(lock, [&job] { return job.done == job.blocks; });
  }

  int threads;
  std::mutex mutex;
  std::condition_variable wake_workers;
  std::condition_variable wake_callers;
  std::vector<Job*> open_jobs;  // Those with blocks left; they live on the stacks of their callers.
  bool stopping = false;
  std::vector<std::thread> workers;
};

ThreadPool::ThreadPool(int threads) {
  PRESCENE_CHECK(threads >= 0);
  if (threads == 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  impl_ = std::make_unique<Impl>(threads);
}

ThreadPool::~ThreadPool() = default;

int ThreadPool::threads() const { return impl_->threads; }

void ThreadPool::for_blocks(std::size_t count, std::size_t block,
                            const std::function<void(std::size_t, std::size_t)>& body) {
  PRESCENE_CHECK(block > 0);
  Job job{count, block, count / block + (count % block != 0), &body};
  if (job.blocks <= 1) {
    if (job.blocks == 1) body(0, count);
    return;
  }
  impl_->run(job);
}

void ThreadPool::for_each_index(std::size_t count, const std::function<void(std::size_t)>& body) {
  for_blocks(count, 1, [&](std::size_t begin, std::size_t) { body(begin); });
}

}  // namespace prescene::core
