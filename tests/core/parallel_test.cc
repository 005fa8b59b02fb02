// SPDX-License-Identifier: Apache-2.0
// Linked with either backend: core_tests with the one of the build, core_std_thread_tests always with std::thread.
#include "prescene/core/parallel.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/core/thread_priority.h"

namespace prescene::core {
namespace {

constexpr int kThreadCounts[] = {1, 2, 3, 8};

TEST(ThreadPool, OfLowPriorityHasNiceThreadsAndLeavesThoseOfOthersAsTheyAre) {
  const auto nice_of_this_thread = [] { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); };
  const int usual = nice_of_this_thread();
  ThreadPool low(3, PoolPriority::kLow), normal(3);
  std::atomic<int> lowered = 0, as_before = 0;
  // As a thread that answers questions does: it is the first to use a pool.
  std::thread asks([&] {
    lower_thread_priority();
    low.for_each_index(300, [&](std::size_t) { lowered += nice_of_this_thread() >= 10 ? 1 : 0; });
  });
  asks.join();
  normal.for_each_index(300, [&](std::size_t) { as_before += nice_of_this_thread() == usual ? 1 : 0; });
  EXPECT_EQ(lowered, 300);
  EXPECT_EQ(as_before, 300);
}

TEST(ThreadPool, VisitsEachIndexOnceInConsecutiveBlocks) {
  for (const int threads : kThreadCounts) {
    for (const PoolPriority priority : {PoolPriority::kNormal, PoolPriority::kLow}) {
      ThreadPool pool(threads, priority);
      EXPECT_EQ(pool.threads(), threads);
      for (const std::size_t count : {0UL, 1UL, 7UL, 64UL, 1000UL}) {
        for (const std::size_t block : {1UL, 3UL, 64UL, 2000UL}) {
          std::vector<std::atomic<int>> visits(count);
          pool.for_blocks(count, block, [&](std::size_t begin, std::size_t end) {
            EXPECT_EQ(begin % block, 0U);
            EXPECT_LE(end, count);
            EXPECT_TRUE(end - begin == block || end == count);
            for (std::size_t i = begin; i < end; ++i) ++visits[i];
          });
          for (const auto& v : visits) ASSERT_EQ(v, 1) << threads << " threads, " << count << " by " << block;
        }
      }
    }
  }
}

TEST(ThreadPool, ForEachIndexVisitsEachOnce) {
  ThreadPool pool(3);
  std::vector<std::atomic<int>> visits(100);
  pool.for_each_index(100, [&](std::size_t i) { ++visits[i]; });
  for (const auto& v : visits) EXPECT_EQ(v, 1);
}

TEST(ThreadPool, ZeroMeansTheMachinesThreads) { EXPECT_GE(ThreadPool(0).threads(), 1); }

TEST(ThreadPool, WritesOfTheBodyAreSeenAfterTheLoop) {
  ThreadPool pool(4);
  std::vector<int> values(10000, 0);  // Not atomic: the loop's end must order them.
  for (int round = 0; round < 50; ++round) {
    pool.for_blocks(values.size(), 100, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++values[i];
    });
  }
  for (const int v : values) ASSERT_EQ(v, 50);
}

TEST(ThreadPool, ReductionsHaveTheSameBitsForAnyNumberOfThreads) {
  // Sums of such numbers depend on the order of additions in many bits.
  std::vector<double> values(10007);
  RandomStream stream(1, Purpose::kTest);
  for (double& x : values) {
    x = stream.normal();
    x *= std::pow(10.0, stream.uniform(-8.0, 8.0));
  }
  const auto sum_of = [&](std::size_t begin, std::size_t end) {
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += values[i];
    return sum;
  };
  for (const std::size_t block : {1UL, 64UL, 1000UL}) {
    double expected = 0.25;
    for (std::size_t begin = 0; begin < values.size(); begin += block) {
      expected += sum_of(begin, std::min(values.size(), begin + block));
    }
    for (const int threads : kThreadCounts) {
      ThreadPool pool(threads);
      for (int round = 0; round < 5; ++round) {
        const double sum =
            pool.reduce_blocks(values.size(), block, 0.25, sum_of, [](double a, double b) { return a + b; });
        ASSERT_EQ(sum, expected) << threads << " threads, blocks of " << block;
      }
    }
  }
}

TEST(ThreadPool, ReductionsJoinInOrderOfIndex) {
  ThreadPool pool(4);
  const auto letter = [](std::size_t begin, std::size_t) { return std::string(1, static_cast<char>('a' + begin)); };
  const auto join = [](std::string a, std::string b) { return a + b; };
  EXPECT_EQ(pool.reduce_blocks(26, 1, std::string(">"), letter, join), ">abcdefghijklmnopqrstuvwxyz");
  EXPECT_EQ(pool.reduce_blocks(0, 1, std::string(">"), letter, join), ">");
}

TEST(ThreadPool, NestedLoopsFinish) {
  for (const int threads : kThreadCounts) {
    ThreadPool pool(threads);
    std::atomic<int> visits = 0;
    pool.for_each_index(13, [&](std::size_t) {
      pool.for_each_index(11, [&](std::size_t) {
        pool.for_blocks(20, 3, [&](std::size_t begin, std::size_t end) { visits += static_cast<int>(end - begin); });
      });
    });
    EXPECT_EQ(visits, 13 * 11 * 20);
  }
}

TEST(ThreadPool, AThreadThatWaitsForANestedLoopStartsNoOtherBlockOfTheOuterOne) {
  // A body may keep a workspace of its thread over a nested loop.
  ThreadPool pool(3);
  std::atomic<int> reentered = 0;
  pool.for_each_index(64, [&](std::size_t) {
    thread_local int depth = 0;
    if (depth != 0) ++reentered;
    ++depth;
    pool.for_each_index(16, [](std::size_t) { std::this_thread::yield(); });
    --depth;
  });
  EXPECT_EQ(reentered, 0);
}

TEST(ThreadPool, TwoCallersMayShareAPool) {
  ThreadPool pool(2);
  std::atomic<int> visits = 0;
  const auto work = [&] {
    for (int round = 0; round < 20; ++round) pool.for_each_index(50, [&](std::size_t) { ++visits; });
  };
  std::thread first(work);
  std::thread second(work);
  first.join();
  second.join();
  EXPECT_EQ(visits, 2 * 20 * 50);
}

TEST(ThreadPool, PoolsUseTheirOwnThreadsOnly) {
  ThreadPool pool(1);
  std::set<std::thread::id> seen;
  pool.for_each_index(100, [&](std::size_t) { seen.insert(std::this_thread::get_id()); });
  EXPECT_EQ(seen, std::set<std::thread::id>{std::this_thread::get_id()});
}

}  // namespace
}  // namespace prescene::core
