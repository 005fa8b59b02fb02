// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mcap/mcap_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <new>
#include <thread>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "recordings.h"
#include "tests/support/allocations.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::HasSubstr;
using tests::Bytes;

TEST(McapWriter, GivesEqualChannelsTheSameNumber) {
  const tests::ScratchDir scratch;
  auto writer = McapWriter::create(scratch.path() / "a.mcap", {});
  ASSERT_TRUE(writer.ok());
  const auto a = (*writer)->add_channel(tests::channel_of("/1"));
  const auto b = (*writer)->add_channel(tests::channel_of("/2"));
  EXPECT_NE(*a, *b);
  EXPECT_EQ(*(*writer)->add_channel(tests::channel_of("/1")), *a);
  EXPECT_THAT((*writer)->write({*a, 0, -1, 0, {}}).message(), HasSubstr("a message on /1 has the time -1 ns"));
}

TEST(McapWriter, ReportsAFullDiskAndKeepsSayingSo) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const auto writer = McapWriter::create("/dev/full", {});
  EXPECT_EQ(writer.status().code(), StatusCode::kUnavailable) << "the header does not fit already";
  EXPECT_THAT(writer.status().message(), HasSubstr("/dev/full: cannot be written"));
}

TEST(McapWriter, WhatWasFlushedIsReadableWithoutClosing) {
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  auto writer = McapWriter::create(path, {});
  ASSERT_TRUE(writer.ok());
  const int channel = *(*writer)->add_channel(tests::channel_of("/1"));
  ASSERT_TRUE((*writer)->write({channel, 0, 5, 5, {1, 2, 3}}).ok());
  ASSERT_TRUE((*writer)->flush().ok());
  ASSERT_TRUE((*writer)->write({channel, 0, 6, 6, {4}}).ok());
  auto reader = McapReader::open(path);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(tests::read_all(reader->get()).size(), 1U);
  EXPECT_TRUE((*reader)->loss().truncated);
  EXPECT_EQ((*reader)->loss().lost_bytes, 0U);
  ASSERT_TRUE((*writer)->close().ok());
  EXPECT_EQ(tests::read_all(*read_file(path, 100000)).size(), 2U);
}

// What came last is kept back for no longer than a chunk's span, whether anything comes after it or not.
TEST(McapWriter, AChunkThatIsOldEnoughIsWrittenThoughNothingComes) {
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  auto writer = McapWriter::create(path, {.chunk_ns = 100, .sync_interval = std::chrono::milliseconds(1)});
  ASSERT_TRUE(writer.ok());
  const auto on_disk = [&] {
    const auto reader = McapReader::open(path);
    return reader ? tests::read_all(reader->get()).size() : 0;
  };
  const int channel = *(*writer)->add_channel(tests::channel_of("/1"));
  ASSERT_TRUE((*writer)->flush_by(50).ok()) << "nothing is kept back";
  ASSERT_TRUE((*writer)->write({channel, 0, 1000, 5, {1, 2, 3}}).ok());
  ASSERT_TRUE((*writer)->write({channel, 0, 1050, 5, {4}}).ok());
  ASSERT_TRUE((*writer)->flush_by(1099).ok());
  EXPECT_EQ(on_disk(), 0U);
  ASSERT_TRUE((*writer)->flush_by(1100).ok());
  EXPECT_EQ(on_disk(), 2U);
  while ((*writer)->seconds_at_risk() > 0.0) std::this_thread::yield();
  ASSERT_TRUE((*writer)->write({channel, 0, 1100, 5, {5}}).ok());
  ASSERT_TRUE((*writer)->flush_by(-1).ok()) << "a clock that went back";
  EXPECT_EQ(on_disk(), 2U);
  ASSERT_TRUE((*writer)->close().ok());
  EXPECT_EQ(on_disk(), 3U);
}

// Of a long recording the index is not kept in memory; it reads as that of a short one does.
TEST(McapWriter, AnIndexOfManyChunksIsWholeAndLeavesNoFileBehind) {
  constexpr std::uint32_t kMessages = 6000;  // some 150 bytes each, which is more than is kept in memory
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  auto writer = McapWriter::create(path, {.chunk_bytes = 1});
  ASSERT_TRUE(writer.ok());
  const int channel = *(*writer)->add_channel(tests::channel_of("/1"));
  for (std::uint32_t i = 0; i < kMessages; ++i) ASSERT_TRUE((*writer)->write({channel, i, i, i, {1}}).ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
  ASSERT_TRUE((*writer)->close().ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
  const auto reader = McapReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->message_count(), kMessages);
  const auto messages = tests::read_all(reader->get());
  ASSERT_EQ(messages.size(), kMessages);
  EXPECT_TRUE((*reader)->loss().nothing()) << (*reader)->loss().text();
  // By the index: only the chunks of these times are read.
  const auto some = McapReader::open(path, {.begin_ns = 5000, .end_ns = 5010});
  ASSERT_TRUE(some.ok());
  EXPECT_EQ(tests::read_all(some->get()).size(), 10U);
}

TEST(McapWriter, EndsChunksByTheirTimeSpan) {
  std::vector<tests::TopicMessage> messages;
  for (int i = 0; i < 10; ++i) messages.push_back({"/1", 0, i * 400'000'000LL, 0, {}});
  const auto chunks = [&](std::int64_t chunk_ns) {
    const Bytes bytes = tests::record(messages, {.chunk_ns = chunk_ns});
    // The statistics record: opcode 0x0b, its length, then counts; the chunks are counted at byte 22 of its content.
    for (std::size_t i = bytes.size() - 40; i > 9; --i) {
      if (bytes[i] == 0x0b && bytes[i + 1] == 46 + 10 && bytes[i + 2] == 0) return static_cast<int>(bytes[i + 9 + 22]);
    }
    return -1;
  };
  EXPECT_EQ(chunks(1'000'000'000), 4) << "0 to 0.8 s, 1.2 to 2.0, 2.4 to 3.2, 3.6";
  EXPECT_EQ(chunks(100'000'000'000), 1);
}

// Wherever memory ends while a message is written, the recording holds the others and is sound.
TEST(McapWriter, AMessageThatMemoryEndsInLeavesNothingBehind) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "a sanitizer has an allocator of its own";
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  int failed = 0;
  for (const std::size_t chunk_bytes : {std::size_t{1} << 20, std::size_t{300}}) {
    bool went_through = false;
    for (std::uint64_t after = 0; !went_through; ++after) {
      auto writer = McapWriter::create(path, {.chunk_bytes = chunk_bytes});
      ASSERT_TRUE(writer.ok());
      const int first = *(*writer)->add_channel(tests::channel_of("/1"));
      const int second = *(*writer)->add_channel(tests::channel_of("/2"));
      ASSERT_TRUE((*writer)->write({first, 0, 5, 5, {1, 2, 3}}).ok());
      const McapMessage message{second, 0, 6, 6, Bytes(500, 7)};
      core::Status written;
      bool threw = false;
      tests::fail_allocation_after(after);
      try {
        written = (*writer)->write(message);
      } catch (const std::bad_alloc&) {
        threw = true;
      }
      went_through = tests::stop_failing_allocations();
      failed += threw ? 1 : 0;
      ASSERT_TRUE(threw || written.ok()) << after << ": " << written.message();
      ASSERT_TRUE((*writer)->write({first, 1, 7, 7, {4}}).ok()) << after;
      ASSERT_TRUE((*writer)->write({second, 1, 8, 8, {5}}).ok()) << after;
      ASSERT_TRUE((*writer)->close().ok()) << after;
      auto reader = McapReader::open(path);
      ASSERT_TRUE(reader.ok()) << after << ": " << reader.status().message();
      EXPECT_EQ(tests::read_all(reader->get()).size(), threw ? 3U : 4U) << after;
      EXPECT_EQ((*reader)->message_count(), threw ? 3U : 4U) << after;
      EXPECT_TRUE((*reader)->loss().nothing()) << after << ": " << (*reader)->loss().text();
    }
  }
  EXPECT_GT(failed, 5);
}

TEST(McapWriter, RosChannelsCarrySchemaHashAndQos) {
  const McapChannel channel = ros_channel("/camera/depth", "sensor_msgs/msg/Image");
  EXPECT_EQ(channel.message_encoding, "cdr");
  EXPECT_EQ(channel.schema.name, "sensor_msgs/msg/Image");
  EXPECT_EQ(channel.schema.encoding, "ros2msg");
  EXPECT_EQ(channel.schema.data, ros2msg_schema(ros_type<RosImage>()));
  EXPECT_EQ(channel.metadata.at("topic_type_hash"), ros_type<RosImage>().type_hash);
  EXPECT_EQ(channel.metadata.at("offered_qos_profiles"), offered_qos_profiles(false));
  EXPECT_EQ(ros_channel("/tf_static", "tf2_msgs/msg/TFMessage", true).metadata.at("offered_qos_profiles"),
            offered_qos_profiles(true));
}

TEST(McapWriter, RosMessagesGoThroughARecording) {
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "a.mcap";
  RosTfMessage message;
  message.transforms = {{{{7, 9}, "world"}, "camera", {{1, 2, 3}, {0, 0, 0, 1}}}};
  {
    auto writer = McapWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    const int tf = *(*writer)->add_channel(ros_channel("/tf", "tf2_msgs/msg/TFMessage"));
    ASSERT_TRUE((*writer)->write({tf, 0, 1, 1, encode_cdr(message)}).ok());
  }  // The destructor closes.
  auto reader = McapReader::open(path);
  ASSERT_TRUE(reader.ok());
  const auto read = (*reader)->next();
  ASSERT_TRUE(read.ok() && *read);
  EXPECT_EQ(*decode_cdr<RosTfMessage>((*read)->data), message);
  EXPECT_TRUE((*reader)->loss().nothing());
}

}  // namespace
}  // namespace prescene::interfaces
