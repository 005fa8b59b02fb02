// SPDX-License-Identifier: Apache-2.0
// Against recordings laid out by hand from the specification.
#include <gtest/gtest.h>

#include "prescene/interfaces/bytes/file.h"
#include "recordings.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): the hand's helpers are all over this file.

/// What the writer must give for one message on "/t", uncompressed, byte for byte.
Bytes whole_file() {
  const Bytes head = joined({magic(), hand_header("ros2", "prescene")});
  const Bytes schema = hand_schema(1, "pkg/msg/T", "ros2msg", "uint8 x\n");
  Bytes channel_content;
  put_u16(1, &channel_content);
  put_u16(1, &channel_content);
  put_text("/t", &channel_content);
  put_text("cdr", &channel_content);
  Bytes map;
  put_text("k", &map);
  put_text("v", &map);
  put_u32(static_cast<std::uint32_t>(map.size()), &channel_content);
  const Bytes channel = hand_record(0x04, joined({channel_content, map}));
  Bytes message_content;
  put_u16(1, &message_content);
  put_u32(7, &message_content);
  put_u64(1000, &message_content);
  put_u64(900, &message_content);
  const Bytes message = hand_record(0x05, joined({message_content, {0xca, 0xfe}}));

  const Bytes records = joined({schema, channel, message});
  const Bytes chunk = hand_chunk(1000, 1000, records, bitwise_crc(records));
  Bytes index_content;
  put_u16(1, &index_content);
  put_u32(16, &index_content);
  put_u64(1000, &index_content);
  put_u64(schema.size() + channel.size(), &index_content);
  const Bytes message_index = hand_record(0x07, index_content);
  const Bytes data = joined({head, chunk, message_index});
  Bytes data_end_content;
  put_u32(bitwise_crc(data), &data_end_content);
  const Bytes data_end = hand_record(0x0f, data_end_content);

  Bytes statistics_content;
  put_u64(1, &statistics_content);
  put_u16(1, &statistics_content);
  for (const std::uint32_t count : {1U, 0U, 0U, 1U}) put_u32(count, &statistics_content);
  put_u64(1000, &statistics_content);
  put_u64(1000, &statistics_content);
  put_u32(10, &statistics_content);
  put_u16(1, &statistics_content);
  put_u64(1, &statistics_content);
  const Bytes statistics = hand_record(0x0b, statistics_content);
  Bytes chunk_index_content;
  put_u64(1000, &chunk_index_content);
  put_u64(1000, &chunk_index_content);
  put_u64(head.size(), &chunk_index_content);
  put_u64(chunk.size(), &chunk_index_content);
  put_u32(10, &chunk_index_content);
  put_u16(1, &chunk_index_content);
  put_u64(head.size() + chunk.size(), &chunk_index_content);
  put_u64(message_index.size(), &chunk_index_content);
  put_text("", &chunk_index_content);
  put_u64(records.size(), &chunk_index_content);
  put_u64(records.size(), &chunk_index_content);
  const Bytes chunk_index = hand_record(0x08, chunk_index_content);

  const std::uint64_t summary_start = data.size() + data_end.size();
  Bytes offsets;
  std::uint64_t place = summary_start;
  for (const auto& [op, group] :
       {std::pair(0x03, schema), std::pair(0x04, channel), std::pair(0x0b, statistics), std::pair(0x08, chunk_index)}) {
    Bytes content;
    content.push_back(static_cast<std::uint8_t>(op));
    put_u64(place, &content);
    put_u64(group.size(), &content);
    offsets = joined({offsets, hand_record(0x0e, content)});
    place += group.size();
  }
  Bytes footer = {0x02};
  put_u64(20, &footer);
  put_u64(summary_start, &footer);
  put_u64(place, &footer);
  const Bytes covered = joined({schema, channel, statistics, chunk_index, offsets, footer});
  put_u32(bitwise_crc(covered), &footer);
  return joined({data, data_end, schema, channel, statistics, chunk_index, offsets, footer, magic()});
}

const TopicMessage kMessage = {"/t", 7, 1000, 900, {0xca, 0xfe}};

TEST(McapReference, TheReaderReadsTheFileLaidOutByHand) {
  auto reader = McapReader::open_bytes(whole_file());
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->profile(), "ros2");
  EXPECT_EQ((*reader)->message_count(), 1U);
  const std::vector<TopicMessage> messages = read_all(reader->get());
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0], kMessage);
  EXPECT_EQ((*reader)->channels(),
            (std::vector<McapChannel>{{"/t", "cdr", {"pkg/msg/T", "ros2msg", "uint8 x\n"}, {{"k", "v"}}}}));
  EXPECT_TRUE((*reader)->loss().nothing()) << (*reader)->loss().text();
}

TEST(McapReference, TheWriterWritesTheSameBytes) {
  const ScratchDir scratch;
  auto writer = McapWriter::create(scratch.path() / "a.mcap", {.compression = McapCompression::kNone});
  ASSERT_TRUE(writer.ok());
  const auto channel = (*writer)->add_channel({"/t", "cdr", {"pkg/msg/T", "ros2msg", "uint8 x\n"}, {{"k", "v"}}});
  ASSERT_TRUE((*writer)->write({*channel, 7, 1000, 900, {0xca, 0xfe}}).ok());
  ASSERT_TRUE((*writer)->close().ok());
  EXPECT_EQ(*read_file(scratch.path() / "a.mcap", 10000), whole_file());
}

TEST(McapReference, AWrongIndexIsRefusedAndCostsNothingWhenSalvaged) {
  const Bytes good = whole_file();
  for (std::size_t i = good.size() - 36; i < good.size() - 8; ++i) {  // The footer.
    Bytes bytes = good;
    bytes[i] ^= 0x55;
    auto reader = McapReader::open_bytes(bytes, {.salvage = true});
    ASSERT_TRUE(reader.ok()) << i;
    EXPECT_EQ(read_all(reader->get()), std::vector<TopicMessage>{kMessage}) << i;
    EXPECT_TRUE((*reader)->loss().bad_index || (*reader)->loss().truncated) << i;
    EXPECT_EQ(McapReader::open_bytes(bytes).ok(), (*reader)->loss().truncated) << i;
  }
}

TEST(McapReference, FilesWithoutSummaryChunksOrDataEndAreReadInTheirOrder) {
  Bytes empty_footer;
  put_u64(0, &empty_footer);
  put_u64(0, &empty_footer);
  put_u32(0, &empty_footer);
  const Bytes definitions =
      joined({hand_schema(9, "T", "jsonschema", "{}"), hand_channel(0, 9, "/a", "json"), hand_channel(5, 0, "/b", "")});
  const Bytes file = joined({magic(), hand_header("", "hand"), definitions, hand_message(5, 30, "x"),
                             hand_message(0, 20, "yy"), hand_record(0x7f, {1, 2, 3}), hand_record(0x09, Bytes(40)),
                             hand_message(5, 10, ""), hand_record(0x02, empty_footer), magic()});
  auto reader = McapReader::open_bytes(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->message_count(), std::nullopt);
  const auto messages = read_all(reader->get());
  ASSERT_EQ(messages.size(), 3U);
  EXPECT_EQ(messages[0], (TopicMessage{"/b", 0, 30, 30, {'x'}}));
  EXPECT_EQ(messages[1], (TopicMessage{"/a", 0, 20, 20, {'y', 'y'}}));
  EXPECT_EQ(messages[2], (TopicMessage{"/b", 0, 10, 10, {}}));
  EXPECT_EQ((*reader)->channels().at(0).schema.name, "T");
  EXPECT_EQ((*reader)->channels().at(1).schema.name, "");
  EXPECT_TRUE((*reader)->loss().nothing()) << (*reader)->loss().text();
  EXPECT_EQ((*reader)->unchecked(), (McapUnchecked{.data = true}));
}

}  // namespace
}  // namespace prescene::interfaces
