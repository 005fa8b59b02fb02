// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mcap/mcap_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/tests/support/paths.h"
#include "recordings.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::HasSubstr;
using namespace tests;  // NOLINT(google-build-using-namespace): the hand's helpers are all over this file.

const Bytes kStart = joined({magic(), hand_header("", "hand")});
const Bytes kDefinitions = joined({hand_schema(1, "T", "ros2msg", ""), hand_channel(1, 1, "/a", "cdr")});

Bytes with_summary(const Bytes& data, const Bytes& summary) {
  Bytes footer;
  put_u64(data.size() + 13, &footer);
  put_u64(0, &footer);
  put_u32(0, &footer);
  return joined({data, hand_record(0x0f, Bytes(4)), summary, hand_record(0x02, footer), magic()});
}

std::unique_ptr<McapReader> opened(const Bytes& bytes, const McapReaderOptions& options = {}) {
  auto reader = McapReader::open_bytes(bytes, options);
  EXPECT_TRUE(reader.ok()) << reader.status().message();
  return *std::move(reader);
}

std::vector<std::int64_t> times(const std::vector<TopicMessage>& messages) {
  std::vector<std::int64_t> out;
  for (const auto& message : messages) out.push_back(message.log_time_ns);
  return out;
}

TEST(McapReader, SaysWhatCannotBeOpened) {
  const ScratchDir scratch;
  EXPECT_EQ(McapReader::open(scratch.path() / "none.mcap").status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(write_file(scratch.path() / "a.mcap", "not a recording").ok());
  const auto other = McapReader::open(scratch.path() / "a.mcap").status();
  EXPECT_EQ(other.code(), StatusCode::kInvalidInput);
  EXPECT_THAT(other.message(), HasSubstr("a.mcap: is no MCAP file"));
  ASSERT_TRUE(write_file(scratch.path() / "a.mcap", "").ok());
  EXPECT_THAT(McapReader::open(scratch.path() / "a.mcap").status().message(),
              HasSubstr("ends before the first message"));
}

TEST(McapReader, LeavesOutAChunkWithAWrongChecksumAndReadsTheOthers) {
  const Bytes first = joined({kDefinitions, hand_message(1, 1, "one")});
  const Bytes second = joined({kDefinitions, hand_message(1, 2, "two")});
  const Bytes third = joined({kDefinitions, hand_message(1, 3, "three")});
  const auto reader =
      opened(joined({kStart, hand_chunk(1, 1, first, bitwise_crc(first)),
                     hand_chunk(2, 2, second, bitwise_crc(second) ^ 1), hand_chunk(3, 3, third, bitwise_crc(third))}));
  EXPECT_THAT(times(read_all(reader.get())), testing::ElementsAre(1, 3));
  EXPECT_EQ(reader->loss().damaged_chunks, 1U);
  EXPECT_THAT(reader->loss().text(), HasSubstr("1 damaged chunks were left out"));
}

TEST(McapReader, MergesOverlappingChunksAndLooseMessagesByTime) {
  const Bytes chunk_a = hand_chunk(10, 40, joined({hand_message(1, 10, ""), hand_message(1, 40, "")}));
  const Bytes chunk_b =
      hand_chunk(5, 30, joined({hand_message(1, 30, ""), hand_message(1, 5, ""), hand_message(1, 10, "b")}));
  const auto reader = opened(with_summary(joined({kStart, hand_message(1, 20, ""), chunk_a, chunk_b}), kDefinitions));
  const auto messages = read_all(reader.get());
  EXPECT_THAT(times(messages), testing::ElementsAre(5, 10, 10, 20, 30, 40));
  EXPECT_EQ(messages[2].data, Bytes{'b'}) << "among equals, the earlier in the file comes first";
}

TEST(McapReader, TellsAboutMessagesOfUnknownChannelsAndUnknownCompressions) {
  const Bytes records = joined({kDefinitions, hand_message(2, 1, "?"), hand_message(1, 2, "!")});
  const auto reader = opened(joined({kStart, hand_chunk(1, 2, records), hand_chunk(1, 2, records, 0, "brotli")}));
  EXPECT_EQ(read_all(reader.get()).size(), 1U);
  EXPECT_EQ(reader->loss().stray_messages, 1U);
  EXPECT_THAT(reader->loss().text(), HasSubstr("the compression 'brotli' is unknown"));
}

TEST(McapReader, RefusesChunksThatClaimTooMuch) {
  Bytes bomb;
  put_u64(0, &bomb);
  put_u64(0, &bomb);
  put_u64(std::uint64_t{1} << 62, &bomb);
  put_u32(0, &bomb);
  put_text("zstd", &bomb);
  put_u64(0, &bomb);
  const auto reader = opened(joined({kStart, hand_record(0x06, bomb), kDefinitions, hand_message(1, 5, "")}));
  EXPECT_EQ(read_all(reader.get()).size(), 1U);
  EXPECT_EQ(reader->loss().refused_chunks, 1U);
}

TEST(McapReader, ARealBombStopsAtItsClaim) {
  // Zeros compress a thousandfold; the chunk claims only what comes before its 100 kB.
  std::vector<TopicMessage> messages = {{"/1", 0, 1, 1, Bytes(1 << 20)}};
  const Bytes bytes = record(messages, {});
  const auto reader = opened(bytes, {.max_chunk_bytes = 100'000});
  EXPECT_TRUE(read_all(reader.get()).empty());
  EXPECT_EQ(reader->loss().refused_chunks, 1U);
  EXPECT_EQ(read_all(bytes, {.max_chunk_bytes = 2 << 20}), messages);
}

TEST(McapReader, GoesOnBehindADamagedRecordWhereTheIndexKnowsAChunk) {
  std::vector<TopicMessage> messages;
  for (int i = 0; i < 6; ++i) messages.push_back({"/1", 0, i, i, Bytes(100)});
  Bytes bytes = record(messages, {.compression = McapCompression::kNone, .chunk_bytes = 100});
  const auto second_chunk = std::find(bytes.begin() + 200, bytes.end(), 0x06);  // Opcode, then a length of 8 bytes.
  for (int i = 1; i <= 8; ++i) second_chunk[i] = 0xff;
  const auto reader = opened(bytes);
  const auto read = read_all(reader.get());
  EXPECT_GE(read.size(), 5U);
  EXPECT_EQ(read.back(), messages.back());
}

TEST(McapReader, KeepsMetadataAndSkipsAttachments) {
  const Bytes bytes = record({{"/1", 0, 1, 1, {}}}, {}, {{"settings", {{"seed", "1"}}}, {"settings", {{"seed", "2"}}}});
  const auto reader = opened(bytes);
  ASSERT_EQ(reader->metadata().size(), 2U);
  EXPECT_EQ(reader->metadata()[1], (McapMetadata{"settings", {{"seed", "2"}}}));
}

TEST(McapReader, TimesBeyondSignedNanosecondsSaturate) {
  const auto reader = opened(joined({kStart, kDefinitions, hand_message(1, ~std::uint64_t{0}, "")}));
  EXPECT_EQ(read_all(reader.get()).at(0).log_time_ns, INT64_MAX);
}

TEST(McapReader, ReadsLargeFilesOnDisk) {
  const ScratchDir scratch;
  std::vector<TopicMessage> messages;
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    Bytes data(20'000);
    for (auto& byte : data) byte = static_cast<std::uint8_t>(stream.uniform_below(256));
    messages.push_back({"/" + std::to_string(1 + i % 3), 0, i * 1'000'000, i, std::move(data)});
  }
  ASSERT_TRUE(write_file(scratch.path() / "a.mcap", record(messages, {})).ok());
  auto reader = McapReader::open(scratch.path() / "a.mcap");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(read_all(reader->get()), messages);
}

}  // namespace
}  // namespace prescene::interfaces
