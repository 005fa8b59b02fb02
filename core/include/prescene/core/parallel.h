// SPDX-License-Identifier: Apache-2.0
// Parallel loops whose results do not depend on the number of threads: the range is cut into blocks of a fixed size,
// and reductions join the blocks' values in the order of their index.
//
// The backend is oneTBB; with PRESCENE_PARALLEL_STD_THREAD (the thread sanitizer's preset) it is std::thread.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace prescene::core {

/// Of low priority: threads of its own that get the processor after others that want it, as far as the system allows
/// (nice 10), and that help no other pool. The thread that calls a loop works along at the priority that it has.
enum class PoolPriority { kNormal, kLow };

/// An arena of threads. Loops given the same arena share its threads; two arenas do not steal each other's.
class ThreadPool {
 public:
  /// threads >= 1, or 0 for the number of the machine's hardware threads.
  explicit ThreadPool(int threads = 0, PoolPriority priority = PoolPriority::kNormal);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const;

  /// Calls body(begin, end) for consecutive blocks of `block` indices of [0, count) (the last may be shorter), each
  /// once, from any thread, and returns when all are done. body must not throw. Nested calls run in the same arena.
  void for_blocks(std::size_t count, std::size_t block, const std::function<void(std::size_t, std::size_t)>& body);

  /// Calls body(i) for each i in [0, count), one index a block.
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& body);

  /// Joins map(begin, end) of each block in index order: join(join(init, block 0), block 1)...; the same bits for any
  /// number of threads.
  template <class Value, class Map, class Join>
  Value reduce_blocks(std::size_t count, std::size_t block, Value init, const Map& map, const Join& join) {
    std::vector<Value> parts((count + block - 1) / block, init);
    for_blocks(count, block, [&](std::size_t begin, std::size_t end) { parts[begin / block] = map(begin, end); });
    for (Value& part : parts) init = join(std::move(init), std::move(part));
    return init;
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::core
