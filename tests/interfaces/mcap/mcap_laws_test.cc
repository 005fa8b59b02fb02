// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "recordings.h"
#include "tests/support/laws.h"

namespace prescene::interfaces::mcap_laws_test {
namespace {

using tests::TopicMessage;

constexpr McapCompression kCompressions[] = {McapCompression::kNone, McapCompression::kLz4, McapCompression::kZstd};

std::vector<TopicMessage> by_time(std::vector<TopicMessage> messages) {
  std::stable_sort(messages.begin(), messages.end(),
                   [](const TopicMessage& a, const TopicMessage& b) { return a.log_time_ns < b.log_time_ns; });
  return messages;
}

TEST(McapLaws, MessagesComeBackInTheOrderOfTime) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto messages = tests::random_messages(&stream, 60, 3000);
    const std::size_t chunk_bytes = stream.uniform_below(20000);
    for (const McapCompression compression : kCompressions) {
      const auto bytes =
          tests::record(messages, {.compression = compression, .chunk_bytes = chunk_bytes, .chunk_ns = 500});
      auto reader = McapReader::open_bytes(bytes);
      RC_ASSERT(reader.ok());
      RC_ASSERT((*reader)->message_count() == messages.size());
      RC_ASSERT(tests::read_all(reader->get()) == by_time(messages));
      RC_ASSERT((*reader)->loss().nothing());
      for (const McapChannel& channel : (*reader)->channels()) RC_ASSERT(channel == tests::channel_of(channel.topic));
    }
  }));
}

TEST(McapLaws, AFilterGivesWhatFilteringAllGives) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto messages = tests::random_messages(&stream, 80, 300);
    auto bytes = tests::record(messages, {.chunk_bytes = 1000, .chunk_ns = 200});
    McapReaderOptions options;
    options.begin_ns = static_cast<std::int64_t>(stream.uniform_below(2000));
    options.end_ns = *options.begin_ns + static_cast<std::int64_t>(stream.uniform_below(2000));
    options.topics = {"/1", "/2", "/none"};
    const auto keep = [&](const TopicMessage& m) {
      return options.topics.contains(m.topic) && m.log_time_ns >= *options.begin_ns && m.log_time_ns < *options.end_ns;
    };
    std::vector<TopicMessage> expected;
    std::copy_if(messages.begin(), messages.end(), std::back_inserter(expected), keep);
    RC_ASSERT(tests::read_all(bytes, options) == by_time(expected));
    bytes.resize(bytes.size() - 9);  // Without the footer: front to back.
    RC_ASSERT(tests::read_all(bytes, options) == expected);
  }));
}

TEST(McapLaws, LittleMemoryCostsTheOrderNotTheMessages) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    auto messages = tests::random_messages(&stream, 60, 300);
    for (auto& message : messages) message.log_time_ns = static_cast<std::int64_t>(stream.uniform_below(100));
    const auto bytes = tests::record(messages, {.chunk_bytes = 500});
    // 1200 holds any chunk with the message that made it full, but seldom two.
    auto read = tests::read_all(bytes, {.max_chunk_bytes = 1200});
    RC_ASSERT(read.size() == messages.size());
    RC_ASSERT(by_time(read).size() == messages.size());
    RC_ASSERT(std::is_permutation(read.begin(), read.end(), messages.begin()));
  }));
}

/// Stretches of noise and of a pattern, as the images of a camera are.
tests::Bytes noise_and_pattern(core::RandomStream* stream, std::size_t size) {
  tests::Bytes bytes;
  while (bytes.size() < size) {
    const bool is_noise = stream->uniform_below(2) == 0;
    const std::size_t end = std::min(size, bytes.size() + 1 + stream->uniform_below(300'000));
    while (bytes.size() < end)
      bytes.push_back(static_cast<std::uint8_t>(is_noise ? stream->uniform_below(256) : bytes.size() / 7 % 31));
  }
  return bytes;
}

TEST(McapLaws, LargeMessagesComeBackWhateverOfThemShrinks) {
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int round = 0; round < 5; ++round) {
    std::vector<TopicMessage> messages;
    std::size_t sum = 0;
    for (int i = 0; i < 4; ++i) {
      messages.push_back({"/1", 0, 10 * i, 10 * i, noise_and_pattern(&stream, stream.uniform_below(900'000))});
      sum += messages.back().data.size();
    }
    // Half is noise, and nothing of it may grow.
    messages.push_back({"/2", 0, 50, 50, tests::Bytes(1 << 20, 7)});
    const auto bytes = tests::record(messages, {.compression = McapCompression::kZstd});
    EXPECT_LT(bytes.size(), sum + 20'000);
    auto reader = McapReader::open_bytes(bytes);
    ASSERT_TRUE(reader.ok());
    EXPECT_EQ(tests::read_all(reader->get()), messages) << round;
    EXPECT_TRUE((*reader)->loss().nothing());
  }
}

}  // namespace
}  // namespace prescene::interfaces::mcap_laws_test
