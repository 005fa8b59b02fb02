// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/recording/recording_overview.h"
#include "prescene/service/tracking/topics.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

TEST(StepRecord, ReadsBackWhatWasWritten) {
  StepRecord record;
  record.step = 7;
  record.after = 41;
  record.now_ns = 1'000'000'123;
  record.stamp_ns = 999'999'999;
  record.depth = 39;
  record.color = 40;
  record.camera_info = 2;
  record.tf_until = 38;
  record.skipped = {{12, 5, "a newer frame was ready"}};
  record.belief_hash = "0123456789abcdef";
  record.degraded = {"few pixels"};
  record.seconds = 0.125;
  const auto read = step_record_from_json(to_json(record).dump());
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->step, record.step);
  EXPECT_EQ(read->after, record.after);
  EXPECT_EQ(read->now_ns, record.now_ns);
  EXPECT_EQ(read->stamp_ns, record.stamp_ns);
  EXPECT_EQ(read->depth, record.depth);
  EXPECT_EQ(read->color, record.color);
  EXPECT_EQ(read->tf_until, record.tf_until);
  EXPECT_EQ(read->belief_hash, record.belief_hash);
  ASSERT_EQ(read->skipped.size(), 1u);
  EXPECT_EQ(read->skipped[0].depth, 12u);
  EXPECT_EQ(read->skipped[0].stamp_ns, 5);
  EXPECT_EQ(read->skipped[0].reason, "a newer frame was ready");
  EXPECT_EQ(read->degraded, record.degraded);
  EXPECT_EQ(read->seconds, 0.125);
  record.color.reset();
  EXPECT_EQ(step_record_from_json(to_json(record).dump())->color, std::nullopt);
}

// Reasons repeat what others sent.
TEST(StepRecord, IsWrittenWhateverBytesItsReasonsHold) {
  StepRecord record;
  record.skipped = {{12, 5, "tf does not connect world to \xff"}};
  record.degraded = {"\xc3"};
  record.belief_hash = "0123456789abcdef";
  const std::string text = belief::json_text(to_json(record));
  EXPECT_TRUE(core::is_utf8(text)) << text;
  EXPECT_TRUE(step_record_from_json(text).ok());
}

TEST(StepRecord, RefusesWhatIsNotOne) {
  const nlohmann::ordered_json whole = to_json(StepRecord{});
  for (const char* key : {"step", "after", "now_ns", "stamp_ns", "depth", "camera_info", "tf_until", "belief_hash"}) {
    nlohmann::ordered_json without = whole;
    without.erase(key);
    EXPECT_EQ(step_record_from_json(without.dump()).status().code(), core::StatusCode::kInvalidInput) << key;
  }
  for (const auto& [key, wrong] : std::map<std::string, const char*>{
           {"color", "-3"}, {"skipped", R"([{"depth": 1}])"}, {"degraded", "[7]"}, {"seconds", "\"long\""}}) {
    nlohmann::ordered_json other = whole;
    other[key] = nlohmann::ordered_json::parse(wrong);
    const auto read = step_record_from_json(other.dump());
    EXPECT_EQ(read.status().code(), core::StatusCode::kInvalidInput) << key;
    EXPECT_NE(read.status().message().find("'" + key + "'"), std::string::npos) << read.status().message();
  }
  EXPECT_FALSE(step_record_from_json("{").ok());
  EXPECT_FALSE(step_record_from_json("[1]").ok());
}

TEST(Recording, IsNeverWrittenOverALiveOne) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  EXPECT_EQ(unused_recording_path(path), path);
  for (const char* name : {"run.mcap", "run-2.mcap"}) {
    const auto recording = RecordingWriter::create(unused_recording_path(path), {});
    ASSERT_TRUE(recording.ok()) << recording.status().message();
    EXPECT_TRUE(std::filesystem::exists(folder.path() / name)) << name;
  }
  EXPECT_EQ(unused_recording_path(path), folder.path() / "run-3.mcap");
  EXPECT_EQ(unused_recording_path("/dev/null"), "/dev/null") << "no file that holds anything";
}

TEST(Recording, OffersTheStaticTransformsToWhoComesLater) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  RecordingInfo info;
  info.tf_static = "/robot/fixed";
  {
    auto writer = RecordingWriter::create(path, info);
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    for (const char* topic : {"/robot/fixed", "/tf_static", "/tf"})
      ASSERT_TRUE((*writer)->write(
          {topic, "tf2_msgs/msg/TFMessage", interfaces::encode_cdr(interfaces::RosTfMessage{}), 1, 1}));
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto reader = interfaces::McapReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  while (const auto message = *(*reader)->next()) {
    const interfaces::McapChannel& channel = (*reader)->channels()[static_cast<std::size_t>(message->channel)];
    EXPECT_EQ(channel.metadata.at(interfaces::kOfferedQosKey),
              interfaces::offered_qos_profiles(channel.topic == "/robot/fixed"))
        << channel.topic;
  }
  EXPECT_EQ((*reader)->channels().size(), 3u);
}

TEST(Recording, KeepsMessagesInOrderWithTheirNumbers) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  const interfaces::ReceivedMessage first{"/a", "std_msgs/msg/String",
                                          interfaces::encode_cdr(interfaces::RosString{"one"}), 10, 11};
  const interfaces::ReceivedMessage second{"/b", "rosgraph_msgs/msg/Clock",
                                           interfaces::encode_cdr(interfaces::RosClock{}), 12, 13};
  {
    auto writer = RecordingWriter::create(path, {"scene.yaml", "name: x\n", 77, "{}"});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    EXPECT_EQ(*(*writer)->write(first), 0u);
    ASSERT_TRUE((*writer)->write_json("/prescene/truth", R"({"stamp_ns": 1})", 12).ok());
    EXPECT_EQ(*(*writer)->write(second), 1u);
    ASSERT_TRUE((*writer)->close().ok());
  }
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->info().scene_file, "scene.yaml");
  EXPECT_EQ((*reader)->info().scene_text, "name: x\n");
  EXPECT_EQ((*reader)->info().seed, 77u);
  const auto a = (*reader)->next();
  ASSERT_TRUE(a.ok() && a->has_value());
  EXPECT_EQ((*a)->message.topic, "/a");
  EXPECT_EQ((*a)->message.type, "std_msgs/msg/String");
  EXPECT_EQ((*a)->message.cdr, first.cdr);
  EXPECT_EQ((*a)->message.source_ns, 10);
  EXPECT_EQ((*a)->message.received_ns, 11);
  EXPECT_EQ((*a)->index, 0u);
  const auto json = (*reader)->next();
  ASSERT_TRUE(json.ok() && json->has_value());
  EXPECT_TRUE((*json)->is_json);
  const auto b = (*reader)->next();
  ASSERT_TRUE(b.ok() && b->has_value());
  EXPECT_EQ((*b)->index, 1u);
  const auto end = (*reader)->next();
  ASSERT_TRUE(end.ok());
  EXPECT_FALSE(end->has_value());
  EXPECT_EQ((*reader)->loss_text(), "");
  EXPECT_EQ((*reader)->unchecked_text(), "");
}

/// The entries of a recording.
std::vector<RecordedEntry> entries_of(const std::filesystem::path& path, const RecordingReadOptions& options = {}) {
  std::vector<RecordedEntry> entries;
  const auto reader = RecordingReader::open(path, options);
  EXPECT_TRUE(reader.ok()) << reader.status().message();
  while (reader) {
    auto entry = (*reader)->next();
    EXPECT_TRUE(entry.ok()) << entry.status().message();
    if (!entry || !*entry) break;
    entries.push_back(**std::move(entry));
  }
  return entries;
}

interfaces::ReceivedMessage text_message(const std::string& text, core::TimeNs source_ns, core::TimeNs received_ns) {
  return {"/a", "std_msgs/msg/String", interfaces::encode_cdr(interfaces::RosString{text}), source_ns, received_ns};
}

// A clock that was never set, or a sender that makes its stamps up.
TEST(Recording, KeepsMessagesOfImpossibleTimes) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  {
    const auto writer = RecordingWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    EXPECT_TRUE((*writer)->write(text_message("before 1970", -5, 10)).ok());
    EXPECT_TRUE((*writer)->write(text_message("the end", std::numeric_limits<core::TimeNs>::max(), 11)).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto entries = entries_of(path);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].message.source_ns, 0);
  EXPECT_EQ(entries[1].message.source_ns, kLatestRecordedNs);
}

TEST(Recording, ALargeAnswerIsReadAgain) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  const std::string answer = R"({"view": ")" + std::string(most_json_bytes(kAnswerTopic) - 12, 'x') + "\"}";
  {
    const auto writer = RecordingWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE((*writer)->write_json(kAnswerTopic, answer, 10).ok());
    EXPECT_EQ((*writer)->write_json(kAnswerTopic, answer + "   ", 11).code(), core::StatusCode::kResourceExhausted);
    EXPECT_EQ((*writer)->write_json(kStepTopic, answer, 12).code(), core::StatusCode::kResourceExhausted)
        << "what is parsed is bounded more closely";
    ASSERT_TRUE((*writer)->write(text_message("after it", 13, 13)).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto entries = entries_of(path);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].message.cdr.size(), answer.size());
  EXPECT_EQ(entries[1].index, 0u);
}

TEST(Recording, SalvageLeavesOutTruthThatWouldUnfold) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  {
    const auto writer = interfaces::McapWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    interfaces::McapChannel truth = interfaces::ros_channel(kTruthTopic, "std_msgs/msg/String");
    truth.metadata["prescene"] = "json";
    const auto channel = (*writer)->add_channel(truth);
    ASSERT_TRUE(channel.ok());
    const auto text = [](const std::string& json) { return interfaces::encode_cdr(interfaces::RosString{json}); };
    ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, text(std::string(kMostParsedJsonBytes + 1, ' '))}).ok());
    ASSERT_TRUE((*writer)->write({*channel, 1, 2, 2, text("{}")}).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->next().status().code(), core::StatusCode::kResourceExhausted);
  const auto salvaging = RecordingReader::open(path, {.salvage = true});
  ASSERT_TRUE(salvaging.ok());
  const auto entry = (*salvaging)->next();
  ASSERT_TRUE(entry.ok() && entry->has_value());
  EXPECT_EQ((*entry)->message.received_ns, 2);
  EXPECT_NE((*salvaging)->loss_text().find("1 JSON documents above the size limit"), std::string::npos);
}

TEST(Recording, JsonOfOtherProgramsIsNotTakenForOurs) {
  EXPECT_FALSE(holds_own_json({kStepTopic, "json", {"step", "jsonschema", "{}"}, {}}));
  EXPECT_FALSE(holds_own_json(interfaces::ros_channel(kStepTopic, "std_msgs/msg/String")));
}

TEST(Recording, WhatIsNotInCdrIsLeftOutAndSaid) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  {
    const auto writer = interfaces::McapWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    for (const auto& [encoding, type] :
         {std::pair("ros1", "sensor_msgs/Image"), std::pair("json", "x"), std::pair("cdr", "std_msgs/msg/String")}) {
      const auto channel = (*writer)->add_channel({std::string("/") + encoding, encoding, {type, "x", ""}, {}});
      ASSERT_TRUE(channel.ok());
      for (int i = 0; i < 2; ++i)
        ASSERT_TRUE((*writer)->write({*channel, 0, 10, 10, interfaces::encode_cdr(interfaces::RosString{"a"})}).ok());
    }
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok());
  for (int i = 0; i < 2; ++i) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok() && entry->has_value());
    EXPECT_EQ((*entry)->message.topic, "/cdr");
    EXPECT_EQ((*entry)->index, static_cast<MessageIndex>(i));
  }
  const auto end = (*reader)->next();
  ASSERT_TRUE(end.ok() && !end->has_value());
  const std::string said = "4 messages that are not in CDR were left out: '/json' ('json'), '/ros1' ('ros1')";
  EXPECT_EQ((*reader)->loss_text(), said);
  const auto overview = overview_of(path, {}, {});
  ASSERT_TRUE(overview.ok());
  EXPECT_EQ(overview->messages, 6u);
  EXPECT_EQ(std::count(overview->problems.begin(), overview->problems.end(), said), 1);
}

TEST(Recording, NumbersStandBehindAGapThatSalvageLeft) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  const std::string landmark = "the chunk to be damaged";
  {
    const auto writer = RecordingWriter::create(path, {});
    ASSERT_TRUE(writer.ok());
    for (int i = 0; i < 9; ++i) {  // three chunks of three
      ASSERT_TRUE((*writer)->write(text_message(i == 4 ? landmark : "n" + std::to_string(i), 10 + i, 10 + i)).ok());
      if (i % 3 == 2) {
        ASSERT_TRUE((*writer)->flush().ok());
      }
    }
    ASSERT_TRUE((*writer)->close().ok());
  }
  auto bytes = *interfaces::read_file(path, std::size_t{1} << 20);
  const auto found = std::search(bytes.begin(), bytes.end(), landmark.begin(), landmark.end());
  ASSERT_NE(found, bytes.end()) << "the text is not compressed";
  *found ^= 1U;
  ASSERT_TRUE(interfaces::write_file(path, bytes).ok());
  const auto entries = entries_of(path, {.salvage = true});
  std::vector<MessageIndex> numbers;
  for (const RecordedEntry& entry : entries) numbers.push_back(entry.index);
  EXPECT_EQ(numbers, (std::vector<MessageIndex>{0, 1, 2, 6, 7, 8}));
}

}  // namespace
}  // namespace prescene::service
