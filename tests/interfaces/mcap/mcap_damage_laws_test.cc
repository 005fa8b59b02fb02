// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "recordings.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using tests::Bytes;
using tests::TopicMessage;

constexpr McapCompression kCompressions[] = {McapCompression::kNone, McapCompression::kLz4, McapCompression::kZstd};

std::vector<TopicMessage> some_messages(std::uint64_t seed, std::size_t count, std::size_t max_data) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<TopicMessage> messages;
  while (messages.size() < count) messages = tests::random_messages(&stream, 2 * count, max_data);
  messages.resize(count);
  return messages;
}

TEST(McapDamageLaws, EveryCutGivesTheMessagesBeforeIt) {
  for (const McapCompression compression : kCompressions) {
    const auto messages = some_messages(3, 40, 400);
    const Bytes whole =
        tests::record(messages, {.compression = compression, .chunk_bytes = 2500}, {{"note", {{"a", "b"}}}});
    std::size_t before = 0;
    for (std::size_t length = 0; length < whole.size(); ++length) {
      auto reader = McapReader::open_bytes({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)});
      if (!reader) {
        ASSERT_EQ(reader.status().code(), StatusCode::kDataLoss) << length;
        ASSERT_LT(length, 100U) << "only a file cut within its header is of no use";
        continue;
      }
      const auto read = tests::read_all(reader->get());
      ASSERT_LE(read.size(), messages.size());
      ASSERT_TRUE(std::equal(read.begin(), read.end(), messages.begin())) << length << ": no prefix";
      ASSERT_GE(read.size(), before) << length << ": a longer file gives fewer messages";
      before = read.size();
      ASSERT_TRUE((*reader)->loss().truncated) << length;
      ASSERT_FALSE((*reader)->loss().text().empty());
      ASSERT_EQ((*reader)->loss().damaged_chunks, 0U) << length;
    }
    EXPECT_EQ(before, messages.size()) << "without its index nothing is lost";
  }
}

TEST(McapDamageLaws, ACutUncompressedChunkGivesItsWholeMessages) {
  const auto messages = some_messages(5, 10, 0);
  const Bytes whole = tests::record(messages, {.compression = McapCompression::kNone});
  std::vector<bool> seen(messages.size() + 1);
  std::size_t most_lost = 0;
  for (std::size_t length = 50; length < whole.size(); ++length) {
    auto reader = McapReader::open_bytes({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)});
    ASSERT_TRUE(reader.ok());
    seen[tests::read_all(reader->get()).size()] = true;
    most_lost = std::max(most_lost, static_cast<std::size_t>((*reader)->loss().lost_bytes));
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 11) << "each number of messages from 0 to 10";
  EXPECT_LT(most_lost, 150U) << "never more than the record that was cut";
}

Bytes with_one_wrong_byte(const std::vector<TopicMessage>& messages, core::RandomStream* stream) {
  const McapCompression compression = kCompressions[stream->uniform_below(3)];
  Bytes bytes = tests::record(messages, {.compression = compression, .chunk_bytes = 800}, {{"note", {{"a", "b"}}}});
  bytes[stream->uniform_below(bytes.size())] ^= static_cast<std::uint8_t>(1 + stream->uniform_below(255));
  return bytes;
}

/// By log time, in which files are read by their index; without one it is the order of the file.
std::vector<TopicMessage> in_time_order(std::vector<TopicMessage> messages) {
  std::stable_sort(messages.begin(), messages.end(),
                   [](const TopicMessage& a, const TopicMessage& b) { return a.log_time_ns < b.log_time_ns; });
  return messages;
}

TEST(McapDamageLaws, ADamagedFileIsRefusedOrReadAsItWasWritten) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto messages = tests::random_messages(&stream, 30, 200);
    const Bytes bytes = with_one_wrong_byte(messages, &stream);
    auto reader = McapReader::open_bytes(bytes);
    if (!reader) return;
    RC_ASSERT((*reader)->metadata() == (std::vector<McapMetadata>{{"note", {{"a", "b"}}}}));
    std::vector<TopicMessage> read;
    for (;;) {
      auto message = (*reader)->next();
      if (!message) return;
      if (!*message) break;
      const auto& channel = (*reader)->channels().at(static_cast<std::size_t>((*message)->channel));
      RC_ASSERT(channel == tests::channel_of(channel.topic));
      read.push_back({channel.topic, (*message)->sequence, (*message)->log_time_ns, (*message)->publish_time_ns,
                      (*message)->data});
    }
    // What is left is damage to the record that ends the data, or behind it, which looks like a cut.
    RC_ASSERT((*reader)->loss().truncated || (*reader)->unchecked().data);
    RC_ASSERT(in_time_order(read) == in_time_order(messages));
  }));
}

TEST(McapDamageLaws, WhatIsSalvagedFromADamagedFileWasWritten) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto messages = tests::random_messages(&stream, 30, 200);
    auto reader = McapReader::open_bytes(with_one_wrong_byte(messages, &stream), {.salvage = true});
    if (!reader) return;
    const auto read = tests::read_all(reader->get());
    for (const TopicMessage& message : read) {
      RC_ASSERT(std::find(messages.begin(), messages.end(), message) != messages.end());
    }
    RC_ASSERT(!(*reader)->loss().nothing() || (*reader)->unchecked().data);
  }));
}

TEST(McapDamageLaws, AnyDamageIsSurvived) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto messages = tests::random_messages(&stream, 20, 100);
    Bytes bytes = tests::record(messages, {.compression = kCompressions[stream.uniform_below(3)], .chunk_bytes = 400},
                                {{"note", {{"a", "b"}}}});
    for (int i = 0; i < 8; ++i)
      bytes[stream.uniform_below(bytes.size())] = static_cast<std::uint8_t>(stream.next_u32());
    for (int i = 0; i < 2; ++i) {  // Lengths are where it hurts.
      const std::size_t at = stream.uniform_below(bytes.size() - 8);
      for (std::size_t k = 0; k < 8; ++k) bytes[at + k] = stream.uniform() < 0.5 ? 0xff : 0x00;
    }
    for (const bool salvage : {false, true}) {
      auto reader = McapReader::open_bytes(bytes, {.max_chunk_bytes = std::size_t{1} << 20, .salvage = salvage});
      if (!reader) continue;
      if (salvage) tests::read_all(reader->get());
      for (auto message = (*reader)->next(); message && *message;) message = (*reader)->next();
    }
  }));
}

}  // namespace
}  // namespace prescene::interfaces
