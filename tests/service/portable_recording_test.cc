// SPDX-License-Identifier: Apache-2.0
// Recordings on another machine, in another program, from another program, and a part of one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/recording/recording_overview.h"
#include "prescene/service/recording/replay_input.h"
#include "tests/interfaces/bags/db3_files.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::portable_recording_test {
namespace {

using testing::HasSubstr;

struct Replayed {
  std::vector<std::string> hashes;  ///< Of the belief after each step.
  std::vector<core::TimeNs> stamps;
  ReplaySummary summary;
};

core::Result<Replayed> replayed(const ReplayInputOptions& options) {
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(options, {}));
  core::ThreadPool pool(1);
  Backends backends(pool);
  PRESCENE_TRY(const auto tracker, Tracker::create(input.scene(), {}, input.seed_or(1), backends));
  Replayed out;
  const StepSink on_step = [&out](const TrackerStep& step, const Tracker&) {
    out.hashes.push_back(step.record.belief_hash);
    out.stamps.push_back(step.record.stamp_ns);
    return core::ok_status();
  };
  PRESCENE_TRY(out.summary, input.replay(*tracker, {}, {}, on_step, {}));
  return out;
}

/// As a robot with 10 frames a second sees it; `duration` s.
void record_box(const std::filesystem::path& path, const std::string& duration = "0.5") {
  const std::string yaml = tests::box_on_table(duration);
  const core::Status recorded = tests::record_scene(yaml, {"box.yaml", yaml, 1, ""}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
}

/// What the robot sent, as rosbag2 keeps it.
void copy_to_db3(const std::filesystem::path& recording, const std::filesystem::path& db3) {
  const auto reader = RecordingReader::open(recording);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::vector<tests::Db3Topic> topics;
  std::vector<tests::Db3Message> messages;
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok()) << entry.status().message();
    if (!*entry) break;
    if ((*entry)->is_json) continue;
    const interfaces::ReceivedMessage& message = (*entry)->message;
    auto topic = std::find_if(topics.begin(), topics.end(), [&](const auto& t) { return t.name == message.topic; });
    if (topic == topics.end()) topic = topics.insert(topic, {message.topic, message.type});
    messages.push_back({topic - topics.begin() + 1, message.received_ns, message.cdr});
  }
  tests::write_db3(db3, topics, messages);
}

class PortableRecording : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  tests::ScratchDir folder_;
};

TEST_F(PortableRecording, EveryTopicIsAMessageOfRos2) {
  {
    const auto writer = RecordingWriter::create(path("run.mcap"), {"box.yaml", "name: box\n", 1, "{}"});
    ASSERT_TRUE(writer.ok());
    const auto tf = interfaces::encode_cdr(interfaces::RosTfMessage{});
    ASSERT_TRUE((*writer)->write({"/tf", "tf2_msgs/msg/TFMessage", tf, 1, 1}).ok());
    ASSERT_TRUE((*writer)->write_output("/tf", "tf2_msgs/msg/TFMessage", tf, 2, 2).ok());
    ASSERT_TRUE((*writer)->write_json(kBeliefTopic, R"({"step": 1})", 2).ok());
    ASSERT_TRUE((*writer)->write({"/tf", "tf2_msgs/msg/TFMessage", tf, 3, 3}).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto reader = interfaces::McapReader::open(path("run.mcap"));
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->profile(), "ros2");
  for (const interfaces::McapChannel& channel : (*reader)->channels()) {
    EXPECT_EQ(channel.message_encoding, "cdr") << channel.topic;
    EXPECT_EQ(channel.schema.encoding, "ros2msg") << channel.topic;
    EXPECT_NE(channel.schema.data, "") << channel.topic;
  }
  // As another program reads it.
  std::string belief;
  int transforms = 0;
  for (;;) {
    const auto message = (*reader)->next();
    ASSERT_TRUE(message.ok());
    if (!*message) break;
    const interfaces::McapChannel& channel = (*reader)->channels()[static_cast<std::size_t>((*message)->channel)];
    transforms += channel.topic == "/tf" ? 1 : 0;
    if (channel.topic == kBeliefTopic) belief = interfaces::decode_cdr<interfaces::RosString>((*message)->data)->data;
  }
  EXPECT_EQ(belief, R"({"step": 1})");
  EXPECT_EQ(transforms, 3);
  // As we do: our own transforms are not the robot's.
  const auto ours = RecordingReader::open(path("run.mcap"));
  ASSERT_TRUE(ours.ok());
  std::vector<std::pair<bool, MessageIndex>> entries;
  for (auto entry = (*ours)->next(); entry.ok() && *entry; entry = (*ours)->next())
    entries.emplace_back((*entry)->is_json, (*entry)->index);
  EXPECT_EQ(entries, (std::vector<std::pair<bool, MessageIndex>>{{false, 0}, {true, 0}, {false, 1}}));
}

TEST_F(PortableRecording, AloneInAnotherFolderItReplaysToTheSameBits) {
  // A model file in a folder of its own, with a mesh beside it.
  std::filesystem::create_directories(path("home/models"));
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.12, 0.08, 0.1}});
  ASSERT_TRUE(interfaces::write_obj(path("home/models/box.obj"), box).ok());
  ASSERT_TRUE(
      interfaces::write_file(path("home/models/box.yaml"),
                             std::string_view("model:\n  mesh: {file: box.obj, use: convex_hull}\n  mass: 0.4\n"))
          .ok());
  std::string yaml = tests::box_on_table("0.5");
  const std::string model = "box: {box: [0.12, 0.08, 0.1], mass: 0.4}";
  ASSERT_NE(yaml.find(model), std::string::npos);
  yaml.replace(yaml.find(model), model.size(), "box: {file: models/box.yaml}");
  ASSERT_TRUE(interfaces::write_file(path("home/scene.yaml"), std::string_view(yaml)).ok());

  FilesOfScene files;
  const auto scene = load_scene_text(yaml, path("home/scene.yaml"), {}, &files);
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_EQ(files.size(), 2u);
  EXPECT_TRUE(files.contains("models/box.yaml") && files.contains("models/box.obj"));
  core::ThreadPool pool(1);
  Backends backends(pool);
  {
    const auto writer =
        RecordingWriter::create(path("home/run.mcap"), {path("home/scene.yaml").string(), yaml, 3, "", files});
    ASSERT_TRUE(writer.ok());
    SimulatedRecordingOptions options;
    options.rate = 10.0;
    const core::Status simulated = simulate_recording(**scene, options, 3, backends, {}, {}, **writer);
    ASSERT_TRUE(simulated.ok()) << simulated.message();
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto there = replayed({.path = path("home/run.mcap"), .scene_file = path("home/scene.yaml")});
  ASSERT_TRUE(there.ok()) << there.status().message();
  ASSERT_GE(there->hashes.size(), 4u);

  std::filesystem::create_directory(path("elsewhere"));
  std::filesystem::rename(path("home/run.mcap"), path("elsewhere/run.mcap"));
  std::filesystem::remove_all(path("home"));
  const auto here = replayed({.path = path("elsewhere/run.mcap"), .scene_file = {}});
  ASSERT_TRUE(here.ok()) << here.status().message();
  EXPECT_EQ(here->hashes, there->hashes);
}

TEST_F(PortableRecording, WhatANewRecordingDoesNotCarryIsNotLookedForOnTheDisk) {
  ASSERT_TRUE(interfaces::write_obj(path("box.obj"), geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.1}})).ok());
  const std::string yaml =
      "models:\n  m: {mesh: {file: box.obj, use: convex_hull}, mass: 1}\nsupports:\n  s: {box: [1, 1, 0.1], "
      "pose: {}}\nobjects:\n  o: {model: m, pose: {position: [0, 0, 0.2]}}\n";
  const auto writer =
      RecordingWriter::create(path("run.mcap"), {path("scene.yaml").string(), yaml, 1, "", FilesOfScene{}});
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->close().ok());
  const auto input = ReplayInput::open({.path = path("run.mcap"), .scene_file = {}}, {});
  EXPECT_THAT(input.status().message(), HasSubstr("has no attachment 'box.obj'"));
}

TEST_F(PortableRecording, TheSameMessagesInADb3OfRosbag2GiveTheSameBits) {
  ASSERT_NO_FATAL_FAILURE(record_box(path("run.mcap")));
  ASSERT_TRUE(interfaces::write_file(path("box.yaml"), std::string_view(tests::box_on_table("0.5"))).ok());
  std::filesystem::create_directory(path("bag"));
  ASSERT_NO_FATAL_FAILURE(copy_to_db3(path("run.mcap"), path("bag/bag_0.db3")));
  ASSERT_TRUE(interfaces::write_file(path("bag/metadata.yaml"), tests::bag_metadata("sqlite3", {"bag_0.db3"}, 0)).ok());
  const auto mcap = replayed({.path = path("run.mcap"), .scene_file = {}});
  ASSERT_TRUE(mcap.ok()) << mcap.status().message();
  ASSERT_GE(mcap->hashes.size(), 4u);
  for (const char* bag : {"bag", "bag/bag_0.db3"}) {
    const auto found = replayed({.path = path(bag), .scene_file = path("box.yaml")});
    ASSERT_TRUE(found.ok()) << found.status().message();
    EXPECT_EQ(found->hashes, mcap->hashes) << bag;
  }
  EXPECT_THAT(replayed({.path = path("bag"), .scene_file = {}}).status().message(), HasSubstr("--scene"));
}

TEST_F(PortableRecording, APartHasTheFramesOfItsWindow) {
  ASSERT_NO_FATAL_FAILURE(record_box(path("run.mcap"), "1.0"));
  const auto whole = replayed({.path = path("run.mcap"), .scene_file = {}});
  ASSERT_TRUE(whole.ok());
  ReplayInputOptions options{.path = path("run.mcap"), .scene_file = {}};
  options.read.from = 0.35;
  options.read.to = 0.75;
  const auto part = replayed(options);
  ASSERT_TRUE(part.ok()) << part.status().message();
  // The camera's static transform came at the very begin.
  std::vector<core::TimeNs> expected;
  for (const core::TimeNs stamp : whole->stamps) {
    const double at = core::seconds_of(stamp - whole->stamps.front());
    if (at >= 0.35 && at <= 0.75) expected.push_back(stamp);
  }
  EXPECT_EQ(part->stamps, expected);
  options.read.from = 0.0;
  const auto first = replayed(options);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->hashes,
            std::vector<std::string>(whole->hashes.begin(),
                                     whole->hashes.begin() + static_cast<std::ptrdiff_t>(first->hashes.size())));
  EXPECT_LT(first->hashes.size(), whole->hashes.size());
  options.read = {};
  options.read.from = 99.0;
  EXPECT_THAT(replayed(options).status().message(), HasSubstr("the recording ends at 1.0"));
}

TEST_F(PortableRecording, TheOverviewSaysWhatIsThereAndWhatIsWrong) {
  ASSERT_NO_FATAL_FAILURE(record_box(path("run.mcap"), "2.0"));
  const auto whole = overview_of(path("run.mcap"), {}, {});
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  EXPECT_EQ(whole->storage, "mcap");
  EXPECT_TRUE(whole->has_scene);
  EXPECT_NEAR(whole->seconds, 2.0, 0.11);
  ASSERT_EQ(whole->cameras.size(), 1u);
  EXPECT_EQ(whole->cameras[0].width, 80u);
  ASSERT_EQ(whole->images.size(), 2u);
  EXPECT_EQ(whole->images[0].encoding, "16UC1");
  for (const RecordedTopic& topic : whole->topics) {
    if (topic.type != "sensor_msgs/msg/Image") continue;
    EXPECT_NEAR(topic.rate().value_or(0.0), 10.0, 0.1) << topic.name;
    EXPECT_NEAR(topic.longest_gap, 0.1, 0.01) << topic.name;
  }
  EXPECT_TRUE(whole->problems.empty()) << whole->problems.front();

  // Without tf and the frames of a second, with an image that is none.
  {
    const auto writer = RecordingWriter::create(path("bad.mcap"), {});
    const auto reader = RecordingReader::open(path("run.mcap"));
    ASSERT_TRUE(writer.ok() && reader.ok());
    for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next()) {
      interfaces::ReceivedMessage message = (*entry)->message;
      const double at = (*reader)->seconds_into(**entry);
      if ((*entry)->is_json || message.type == "tf2_msgs/msg/TFMessage" || (at > 0.95 && at < 1.95)) continue;
      if (message.type == "sensor_msgs/msg/Image" && at > 1.95) message.cdr.resize(30);
      ASSERT_TRUE((*writer)->write(message).ok());
    }
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto bad = overview_of(path("bad.mcap"), {}, {});
  ASSERT_TRUE(bad.ok()) << bad.status().message();
  EXPECT_THAT(bad->problems, testing::Contains(HasSubstr("nothing came for 1.")));
  EXPECT_THAT(bad->problems, testing::Contains(HasSubstr("can't be decoded")));
  EXPECT_THAT(bad->problems, testing::Contains(HasSubstr("no transform leads to its frame")));
}

}  // namespace
}  // namespace prescene::service::portable_recording_test
