// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/inbox.h"

#include <gtest/gtest.h>

#include <thread>

namespace prescene::service {
namespace {

interfaces::ReceivedMessage message(const std::string& topic, core::TimeNs time) {
  return {topic, "t", {}, time, time};
}

TEST(Inbox, DropsTheOldestOfAFullTopicAndCounts) {
  Inbox inbox({{"/depth", {.messages = 2}}});
  for (int i = 0; i < 5; ++i) inbox.put(message("/depth", i));
  inbox.put(message("/tf", 9));
  const auto taken = inbox.take_all(std::chrono::steady_clock::now());
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_EQ(taken[0].received_ns, 3);
  EXPECT_EQ(taken[1].received_ns, 4);
  EXPECT_EQ(taken[2].topic, "/tf");
  EXPECT_EQ(inbox.dropped(), 3u);
  EXPECT_TRUE(inbox.take_all(std::chrono::steady_clock::now()).empty());
  inbox.put(message("/depth", 7));
  EXPECT_EQ(inbox.take_all(std::chrono::steady_clock::now()).size(), 1u) << "taking makes room";
}

TEST(Inbox, BoundsTheBytesOfATopicButKeepsItsNewestMessage) {
  Inbox inbox({{"/tf", {.messages = 100, .bytes = 1000}}});
  const auto put = [&](const std::string& topic, std::size_t bytes) {
    inbox.put({topic, "t", std::vector<std::uint8_t>(bytes), 0, 0});
  };
  for (int i = 0; i < 50; ++i) put("/tf", 300);
  put("/image", 5000);
  EXPECT_EQ(inbox.dropped(), 47u) << "three of 300 bytes fit";
  put("/tf", 4000);
  EXPECT_EQ(inbox.dropped(), 50u);
  EXPECT_EQ(inbox.dropped_by_topic(), (std::map<std::string, std::uint64_t>{{"/tf", 50}}));
  const auto taken = inbox.take_all(std::chrono::steady_clock::now());
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken[0].topic, "/image");
  EXPECT_EQ(taken[1].cdr.size(), 4000u) << "a message beyond the limit waits alone";
}

TEST(Inbox, WaitingEndsWithAMessageOrAWake) {
  Inbox inbox({});
  const auto far = std::chrono::steady_clock::now() + std::chrono::hours(1);
  std::thread sender([&] { inbox.put(message("/a", 1)); });
  EXPECT_EQ(inbox.take_all(far).size(), 1u);
  sender.join();
  std::thread waker([&] { inbox.wake(); });
  EXPECT_TRUE(inbox.take_all(far).empty());
  waker.join();
}

}  // namespace
}  // namespace prescene::service
