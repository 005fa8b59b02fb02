// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mcap/mcap_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/interfaces/bytes/file.h"
#include "recordings.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::HasSubstr;
using namespace tests;  // NOLINT(google-build-using-namespace): the hand's helpers are all over this file.

const Bytes kStart = joined({magic(), hand_header("", "hand")});
const Bytes kDefinitions = joined({hand_schema(1, "T", "ros2msg", ""), hand_channel(1, 1, "/a", "cdr")});

/// With no checksums unless they are given.
Bytes with_summary(const Bytes& data, const Bytes& summary, std::uint32_t data_crc = 0, std::uint32_t summary_crc = 0) {
  Bytes footer;
  put_u64(data.size() + 13, &footer);
  put_u64(0, &footer);
  put_u32(summary_crc, &footer);
  Bytes data_end;
  put_u32(data_crc, &data_end);
  return joined({data, hand_record(0x0f, data_end), summary, hand_record(0x02, footer), magic()});
}

/// The status of the first failure on the way from opening to the end; ok if there is none.
core::Status failure_of(const Bytes& bytes, const McapReaderOptions& options = {}) {
  auto reader = McapReader::open_bytes(bytes, options);
  if (!reader) return reader.status();
  for (;;) {
    const auto message = (*reader)->next();
    if (!message) return message.status();
    if (!*message) return core::ok_status();
  }
}

/// A frame of zstd by hand (RFC 8878): the bytes, then zeros in blocks that repeat one byte.
Bytes hand_zstd(const Bytes& bytes, std::uint64_t zeros) {
  Bytes out = {0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x38};  // No size, no checksum, a window of 128 KiB.
  const auto block = [&out](bool last, std::uint32_t type, std::uint64_t size) {
    const std::uint32_t header = (last ? 1U : 0U) | type << 1 | static_cast<std::uint32_t>(size) << 3;
    for (int shift = 0; shift < 24; shift += 8) out.push_back(static_cast<std::uint8_t>(header >> shift));
  };
  block(zeros == 0, 0, bytes.size());
  out.insert(out.end(), bytes.begin(), bytes.end());
  while (zeros > 0) {
    const std::uint64_t size = std::min<std::uint64_t>(zeros, 128 << 10);
    zeros -= size;
    block(zeros == 0, 1, size);
    out.push_back(0);
  }
  return out;
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
  EXPECT_THAT(other.message(), HasSubstr("a.mcap: not an MCAP file"));
  ASSERT_TRUE(write_file(scratch.path() / "a.mcap", "").ok());
  EXPECT_THAT(McapReader::open(scratch.path() / "a.mcap").status().message(),
              HasSubstr("ends before the first message"));
}

TEST(McapReader, SalvageLeavesOutAChunkWithAWrongChecksumAndReadsTheOthers) {
  const Bytes first = joined({kDefinitions, hand_message(1, 1, "one")});
  const Bytes second = joined({kDefinitions, hand_message(1, 2, "two")});
  const Bytes third = joined({kDefinitions, hand_message(1, 3, "three")});
  const auto reader =
      opened(joined({kStart, hand_chunk(1, 1, first, bitwise_crc(first)),
                     hand_chunk(2, 2, second, bitwise_crc(second) ^ 1), hand_chunk(3, 3, third, bitwise_crc(third))}),
             {.salvage = true});
  EXPECT_THAT(times(read_all(reader.get())), testing::ElementsAre(1, 3));
  EXPECT_EQ(reader->loss().damaged_chunks, 1U);
  EXPECT_THAT(reader->loss().text(), HasSubstr("1 damaged chunks were left out"));
}

TEST(McapReader, RefusesADamagedChunkAndSaysWhere) {
  const Bytes records = joined({kDefinitions, hand_message(1, 1, "one")});
  const core::Status status = failure_of(joined({kStart, hand_chunk(1, 1, records, bitwise_crc(records) ^ 1)}));
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("chunk at byte 78 is damaged"));
  EXPECT_THAT(status.message(), HasSubstr("salvage"));
}

TEST(McapReader, RefusesADataSectionWithAWrongChecksum) {
  // Metadata, header and loose messages have no checksum of their own.
  const Bytes data = joined({kStart, kDefinitions, hand_message(1, 1, "one")});
  const Bytes end = hand_record(0x0f, Bytes(4));
  EXPECT_TRUE(failure_of(with_summary(data, kDefinitions, bitwise_crc(data))).ok());
  const Bytes damaged = with_summary(data, kDefinitions, bitwise_crc(data) ^ 1);
  EXPECT_EQ(failure_of(damaged).code(), StatusCode::kDataLoss);
  EXPECT_TRUE(failure_of(damaged, {.check_data = false}).ok());
  const auto salvaged = opened(damaged, {.salvage = true});
  EXPECT_EQ(read_all(salvaged.get()).size(), 1U);
  EXPECT_THAT(salvaged->loss().text(), HasSubstr("the checksum of its data section is wrong"));
  // Cut behind the data section, too.
  Bytes cut = with_summary(data, {}, bitwise_crc(data));
  cut.resize(data.size() + end.size());
  EXPECT_TRUE(failure_of(cut).ok());
  cut[data.size() - 1] ^= 1;
  EXPECT_EQ(failure_of(cut).code(), StatusCode::kDataLoss);
}

TEST(McapReader, RefusesAnIndexWithAWrongChecksum) {
  const Bytes data = joined({kStart, kDefinitions, hand_message(1, 1, "one")});
  Bytes covered = kDefinitions;
  Bytes footer_head = with_summary(data, {});
  footer_head.erase(footer_head.begin(), footer_head.begin() + static_cast<std::ptrdiff_t>(data.size() + 13));
  covered.insert(covered.end(), footer_head.begin(), footer_head.end() - 8 - 4);
  EXPECT_TRUE(failure_of(with_summary(data, kDefinitions, 0, bitwise_crc(covered))).ok());
  const Bytes damaged = with_summary(data, kDefinitions, 0, bitwise_crc(covered) ^ 1);
  EXPECT_EQ(failure_of(damaged).code(), StatusCode::kDataLoss);
  const auto salvaged = opened(damaged, {.salvage = true});
  EXPECT_EQ(read_all(salvaged.get()).size(), 1U);
  EXPECT_TRUE(salvaged->loss().bad_index);
}

TEST(McapReader, WithoutTheRecordThatEndsItTheDataSectionIsUnchecked) {
  const Bytes data = joined({kStart, kDefinitions, hand_message(1, 1, "one")});
  Bytes bytes = with_summary(data, kDefinitions, bitwise_crc(data));
  bytes[data.size()] = 0x81;  // Another opcode.
  const auto reader = opened(bytes);
  EXPECT_EQ(read_all(reader.get()).size(), 1U);
  EXPECT_TRUE(reader->unchecked().data);
}

TEST(McapReader, SaysWhatHasNoChecksum) {
  const Bytes records = hand_message(1, 1, "one");
  const auto bare =
      opened(with_summary(joined({kStart, hand_chunk(1, 1, records), hand_chunk(2, 2, records)}), kDefinitions));
  EXPECT_EQ(read_all(bare.get()).size(), 2U);
  EXPECT_EQ(bare->unchecked(), (McapUnchecked{true, true, 2}));
  EXPECT_THAT(bare->unchecked().text(), HasSubstr("no checksum of its data section, 2 chunks, its index"));
  EXPECT_TRUE(bare->loss().nothing());
  const auto ours = opened(record({{"/1", 0, 1, 1, {}}}, {}));
  EXPECT_EQ(read_all(ours.get()).size(), 1U);
  EXPECT_TRUE(ours->unchecked().nothing()) << ours->unchecked().text();
}

TEST(McapReader, AMessageOfAGigabyteInAFileOfKilobytesIsRefused) {
  constexpr std::uint64_t kZeros = (std::uint64_t{1} << 30) - 1000;
  Bytes message;
  put_u16(1, &message);
  put_u32(0, &message);
  put_u64(1, &message);
  put_u64(1, &message);
  Bytes frame = {0x05};
  put_u64(message.size() + kZeros, &frame);
  const Bytes records = joined({kDefinitions, frame, message});
  const Bytes stored = hand_zstd(records, kZeros);
  Bytes chunk;
  put_u64(1, &chunk);
  put_u64(1, &chunk);
  put_u64(records.size() + kZeros, &chunk);
  put_u32(0, &chunk);
  put_text("zstd", &chunk);
  put_u64(stored.size(), &chunk);
  const Bytes bytes = joined({kStart, hand_record(0x06, joined({chunk, stored}))});
  EXPECT_LT(bytes.size(), 50'000U);
  const core::Status status = failure_of(bytes);
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), HasSubstr("claims 1024.0 MiB; up to 128.0 MiB are read"));
}

TEST(McapReader, DefinitionsAreBounded) {
  // Each channel holds a copy of its schema: 4000 of them with one of 100 kB would take 400 MB.
  const std::string text(100'000, ' ');
  Bytes bytes = joined({kStart, hand_schema(1, "T", "ros2msg", text)});
  for (std::uint16_t id = 1; id <= 4000; ++id) {
    const Bytes channel = hand_channel(id, 1, "/" + std::to_string(id), "cdr");
    bytes.insert(bytes.end(), channel.begin(), channel.end());
  }
  EXPECT_EQ(failure_of(bytes).code(), StatusCode::kResourceExhausted);
  // So would one that is defined anew and anew.
  bytes = joined({kStart, hand_schema(1, "T", "ros2msg", text)});
  for (int i = 0; i < 4000; ++i) {
    const Bytes channel = hand_channel(1, 1, i % 2 == 0 ? "/a" : "/b", "cdr");
    bytes.insert(bytes.end(), channel.begin(), channel.end());
  }
  EXPECT_EQ(failure_of(bytes).code(), StatusCode::kResourceExhausted);
}

TEST(McapReader, MetadataIsBounded) {
  Bytes texts;
  put_text("k", &texts);
  put_text(std::string(1 << 20, 'x'), &texts);
  Bytes content;
  put_text("m", &content);
  put_u32(static_cast<std::uint32_t>(texts.size()), &content);
  const Bytes metadata = hand_record(0x0c, joined({content, texts}));
  Bytes bytes = kStart;
  for (int i = 0; i < 21; ++i) bytes.insert(bytes.end(), metadata.begin(), metadata.end());
  EXPECT_EQ(failure_of(bytes).code(), StatusCode::kResourceExhausted);
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
  const auto reader =
      opened(joined({kStart, hand_chunk(1, 2, records), hand_chunk(1, 2, records, 0, "brotli")}), {.salvage = true});
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
  const auto reader =
      opened(joined({kStart, hand_record(0x06, bomb), kDefinitions, hand_message(1, 5, "")}), {.salvage = true});
  EXPECT_EQ(read_all(reader.get()).size(), 1U);
  EXPECT_EQ(reader->loss().refused_chunks, 1U);
}

TEST(McapReader, ARealBombStopsAtItsClaim) {
  // Zeros compress a thousandfold; the chunk claims only what comes before its 100 kB.
  std::vector<TopicMessage> messages = {{"/1", 0, 1, 1, Bytes(1 << 20)}};
  const Bytes bytes = record(messages, {});
  const auto reader = opened(bytes, {.max_chunk_bytes = 100'000, .salvage = true});
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
  const auto reader = opened(bytes, {.salvage = true});
  const auto read = read_all(reader.get());
  EXPECT_GE(read.size(), 5U);
  EXPECT_EQ(read.back(), messages.back());
}

TEST(McapReader, GoesOnBehindDamageInACutRecording) {
  const auto chunk = [](std::uint64_t time, const char* text) {
    const Bytes records = joined({kDefinitions, hand_message(1, time, text)});
    return hand_chunk(time, time, records, bitwise_crc(records));
  };
  const Bytes first = joined({kStart, chunk(1, "one")});
  for (const std::size_t at : {0U, 1U, 8U, 9U + 32U}) {  // opcode, its length, the length of what it holds
    Bytes second = chunk(2, "two");
    second[at] ^= 0x55;
    const Bytes cut = joined({first, second, chunk(3, "three"), Bytes(5, 0x06)});
    const auto reader = opened(cut, {.salvage = true});
    const std::vector<std::int64_t> read = times(read_all(reader.get()));
    EXPECT_EQ(read.front(), 1) << at;
    EXPECT_EQ(read.back(), 3) << at;
    EXPECT_TRUE(reader->loss().truncated) << at;
  }
}

TEST(McapReader, SalvageGoesOnBehindADamagedHeader) {
  const Bytes records = joined({kDefinitions, hand_message(1, 1, "one")});
  Bytes bytes = joined({kStart, hand_chunk(1, 1, records, bitwise_crc(records))});
  for (const std::size_t at : {0U, 5U, 8U, 9U, 16U}) {
    Bytes damaged = bytes;
    damaged[magic().size() + at] ^= 0x7f;
    EXPECT_EQ(failure_of(damaged).code(), StatusCode::kDataLoss) << at;
    const auto reader = opened(damaged, {.salvage = true});
    EXPECT_EQ(read_all(reader.get()).size(), 1U) << at;
    EXPECT_THAT(reader->loss().text(), HasSubstr("its header is damaged")) << at;
  }
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
