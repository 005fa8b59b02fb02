// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/tests/support/paths.h"

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

}  // namespace
}  // namespace prescene::service
