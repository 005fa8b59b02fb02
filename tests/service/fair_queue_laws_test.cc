// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/fair_queue.h"

#include <gtest/gtest.h>

#include <map>
#include <new>
#include <set>

#include "prescene/core/random.h"
#include "tests/support/allocations.h"

namespace prescene::service::fair_queue_laws_test {
namespace {

struct Numbered {
  std::string client;
  int number = 0;
};

TEST(FairQueue, WhoWasRefusedKeepsNoTurn) {
  FairQueue<int> queue({10, 2, 1000});
  queue.push("a", 1, 1);
  queue.push("c", 2, 1);
  EXPECT_EQ(queue.push("b", 3, 1).size(), 1u);
  EXPECT_EQ(queue.pop()->item, 1);
  queue.push("d", 4, 1);
  EXPECT_EQ(queue.pop()->item, 2);
  queue.push("b", 5, 1);  // comes after d
  EXPECT_EQ(queue.pop()->item, 4);
  EXPECT_EQ(queue.pop()->item, 5);
}

TEST(FairQueue, ClientsTakeTurns) {
  FairQueue<int> queue({10, 100, 1000});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.push("a", i, 1).empty());
  EXPECT_TRUE(queue.push("b", 10, 1).empty());
  EXPECT_TRUE(queue.push("c", 20, 1).empty());
  EXPECT_TRUE(queue.push("b", 11, 1).empty());
  std::vector<int> order;
  while (const auto next = queue.pop()) order.push_back(next->item);
  EXPECT_EQ(order, (std::vector<int>{0, 10, 20, 1, 11, 2}));
}

TEST(FairQueue, WhoHasMostGivesWay) {
  FairQueue<int> queue({3, 4, 1000});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.push("a", i, 1).empty());
  const auto own = queue.push("a", 3, 1);
  ASSERT_EQ(own.size(), 1U);
  EXPECT_EQ(own[0].item, 3);
  EXPECT_EQ(own[0].bound, FairBound::kOfClient);
  EXPECT_TRUE(queue.push("b", 10, 1).empty());
  const auto of_a = queue.push("b", 11, 1);
  ASSERT_EQ(of_a.size(), 1U);
  EXPECT_EQ(of_a[0].item, 2) << "the newest of the client with most";
  EXPECT_EQ(of_a[0].bound, FairBound::kOfAll);
  const auto of_equals = queue.push("b", 12, 1);
  ASSERT_EQ(of_equals.size(), 1U);
  EXPECT_EQ(of_equals[0].item, 12) << "of equals, the one that comes now";
}

TEST(FairQueue, BytesAreBounded) {
  FairQueue<int> queue({10, 10, 100});
  EXPECT_TRUE(queue.push("a", 1, 60).empty());
  EXPECT_TRUE(queue.push("a", 2, 40).empty());
  const auto of_a = queue.push("b", 3, 30);
  ASSERT_EQ(of_a.size(), 1U);
  EXPECT_EQ(of_a[0].item, 2);
  EXPECT_EQ(of_a[0].bound, FairBound::kBytesOfAll);
  const auto too_long = queue.push("c", 4, 101);
  ASSERT_EQ(too_long.size(), 1U);
  EXPECT_EQ(too_long[0].item, 4) << "what can never fit takes nobody's place";
  EXPECT_EQ(queue.size(), 2U);
}

// Whatever is pushed and popped: nothing is lost, bounds are kept, each client's items keep their order, and between
// two items of a client that waits none of another's is served twice.
TEST(FairQueue, LawsHoldInRandomUse) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto below = [&stream](int end) { return static_cast<int>(stream.uniform() * end); };
    const FairLimits limits{static_cast<std::size_t>(1 + below(6)), static_cast<std::size_t>(1 + below(12)),
                            static_cast<std::size_t>(1 + below(60))};
    FairQueue<Numbered> queue(limits);
    std::map<std::string, std::set<int>> waiting;
    std::map<std::string, std::map<std::string, int>> served_since;  // by who waits: whom, how often
    std::map<std::string, std::size_t> bytes;                        // of each item by its name
    const auto name = [](const Numbered& item) { return item.client + std::to_string(item.number); };
    for (int number = 0; number < 300; ++number) {
      if (below(5) < 3) {
        const Numbered item{std::string(1, static_cast<char>('a' + below(4))), number};
        const auto size = static_cast<std::size_t>(below(20));
        bytes[name(item)] = size;
        if (waiting[item.client].empty()) served_since[item.client].clear();
        waiting[item.client].insert(number);
        for (const auto& refused : queue.push(item.client, item, size)) {
          ASSERT_EQ(waiting[refused.item.client].erase(refused.item.number), 1U);
          EXPECT_TRUE(waiting[refused.item.client].empty() ||
                      *waiting[refused.item.client].rbegin() < refused.item.number)
              << "not the newest";
          if (refused.bound != FairBound::kOfAll) continue;
          for (const auto& [client, items] : waiting)
            EXPECT_LE(items.size(), waiting[refused.item.client].size() + 1) << "another one has more";
        }
      } else if (below(5) == 0) {
        const int multiple = 2 + below(3);
        const auto is_multiple = [multiple](const Numbered& item) { return item.number % multiple == 0; };
        std::size_t expected = 0;
        for (auto& [client, items] : waiting)
          expected += std::erase_if(items, [multiple](int one) { return one % multiple == 0; });
        EXPECT_EQ(queue.erase_if(is_multiple), expected);
        EXPECT_EQ(queue.find_if(is_multiple), nullptr);
      } else {
        const auto next = queue.pop();
        std::size_t count = 0;
        for (const auto& [client, items] : waiting) count += items.size();
        ASSERT_EQ(next.has_value(), count > 0);
        if (!next) continue;
        const std::string& served = *next->client;
        EXPECT_EQ(served, next->item.client);
        EXPECT_EQ(*waiting[served].begin(), next->item.number) << "not the oldest";
        waiting[served].erase(next->item.number);
        served_since[served].clear();
        for (const auto& [client, items] : waiting) {
          if (client == served || items.empty()) continue;
          EXPECT_LE(++served_since[client][served], 1) << client << " waits while " << served << " goes on";
        }
      }
      std::size_t count = 0, sum = 0;
      for (const auto& [client, items] : waiting) {
        count += items.size();
        EXPECT_LE(items.size(), limits.of_client);
        for (const int one : items) sum += bytes[client + std::to_string(one)];
      }
      EXPECT_EQ(queue.size(), count);
      EXPECT_LE(count, limits.of_all);
      EXPECT_LE(sum, limits.bytes_of_all);
    }
  }
}

TEST(FairQueue, TakingOutTakesNoMemory) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "sanitizers bring an allocator of their own";
  FairQueue<std::string> queue({10, 100, 1000});
  const std::string one(100, 'a'), other(100, 'b');  // too long to be kept without memory
  queue.push(one, std::string(100, '1'), 1);
  queue.push(one, std::string(100, '2'), 1);
  queue.push(other, std::string(100, '3'), 1);
  tests::fail_allocation_after(0);
  const auto first = queue.pop(), second = queue.pop(), third = queue.pop();
  EXPECT_TRUE(tests::stop_failing_allocations());
  ASSERT_TRUE(first && second && third);
  EXPECT_EQ(*first->client, one);
  EXPECT_EQ(*second->client, other);
  EXPECT_EQ(*third->client, one);
  EXPECT_EQ(third->item, std::string(100, '2'));
}

// At each allocation of a push in turn: what waited before is served as if nothing had come, and nothing else waits.
TEST(FairQueue, APushThatFindsNoMemoryChangesNothing) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "sanitizers bring an allocator of their own";
  const std::string names[] = {std::string(100, 'a'), std::string(100, 'b')};  // too long to be kept without memory
  int failures = 0;
  for (const FairLimits& limits : {FairLimits{50, 50, 5000}, FairLimits{2, 50, 5000}, FairLimits{50, 2, 5000}}) {
    for (const std::string& client : names) {
      for (std::uint64_t after = 0;; ++after) {
        FairQueue<std::string> queue(limits);
        queue.push(names[0], std::string(100, '1'), 30);
        queue.push(names[0], std::string(100, '2'), 20);
        std::string item(100, '3');
        bool failed = false;
        tests::fail_allocation_after(after);
        try {
          queue.push(client, std::move(item), 10);
        } catch (const std::bad_alloc&) {
          failed = true;
        }
        tests::stop_failing_allocations();
        if (!failed) break;
        ++failures;
        EXPECT_EQ(queue.size(), 2U);
        EXPECT_TRUE(queue.push(names[1], std::string(100, '4'), 1).size() == (limits.of_all == 2 ? 1U : 0U));
        std::string served;
        while (const auto next = queue.pop()) served += (*next->client)[0] + next->item.substr(0, 1);
        EXPECT_EQ(served, limits.of_all == 2 ? "a1b4" : "a1b4a2");
      }
    }
  }
  EXPECT_GE(failures, 6);
}

TEST(FairQueue, WhoMayNotGoIsPassedOverAndKeepsTheTurn) {
  FairQueue<int> queue({10, 100, 1000});
  for (const int item : {1, 2}) queue.push("a", item, 1);
  for (const int item : {3, 4}) queue.push("b", item, 1);
  const auto not_a = [](const std::string& client, int) { return client != "a"; };
  EXPECT_EQ(queue.pop_if(not_a)->item, 3);
  EXPECT_EQ(queue.pop_if(not_a)->item, 4);
  EXPECT_FALSE(queue.pop_if(not_a));
  EXPECT_EQ(queue.pop()->item, 1);
}

}  // namespace
}  // namespace prescene::service::fair_queue_laws_test
