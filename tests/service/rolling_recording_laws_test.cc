// SPDX-License-Identifier: Apache-2.0
// Recordings that go on in file after file: whatever the moments of the changes, all files together hold each message
// once, and each replays to the recorded bits, alone or after those before it.
#include "prescene/service/recording/rolling_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "prescene/belief/json.h"
#include "prescene/core/random.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/service/recording/recording_overview.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/tracking/topics.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::rolling_recording_test {
namespace {

using std::filesystem::path;
using ::testing::HasSubstr;
using ::testing::Not;

/// A box in a hand that moves, over a table, on which another box stands.
constexpr const char* kScene = R"(name: held
duration: 2.0
models:
  box: {box: [0.08, 0.06, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
robot:
  hand:
    parts: [{box: [0.05, 0.05, 0.04], position: [0, 0, 0.02]}]
    timeline:
      - {time: 0.0, position: [-0.1, 0.0, 0.2]}
      - {time: 2.0, position: [0.1, 0.0, 0.2]}
objects:
  held: {model: box, held_by: hand, pose: {position: [-0.1, 0, 0.15], normal: {position: [0.01, 0.01, 0]}}}
  other: {model: box, pose: {position: [0.05, 0.15, 0.05], normal: {position: [0.01, 0.01, 0]}}}
camera:
  width: 80
  height: 60
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.08]}
)";

/// What was recorded of a robot, as the messages come.
std::vector<interfaces::ReceivedMessage> messages_of(const path& robot) {
  std::vector<interfaces::ReceivedMessage> messages;
  const auto reader = RecordingReader::open(robot);
  EXPECT_TRUE(reader.ok());
  for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next())
    if (!(*entry)->is_json) messages.push_back((*entry)->message);
  return messages;
}

class RollingRecordingLaws : public ::testing::Test {
 protected:
  void SetUp() override {
    set_up(kScene, kScene);
    ASSERT_GT(messages_.size(), 100u);
    // It waits over several changes, and acts in the end.
    interfaces::ReceivedMessage control = messages_[20];
    control.topic = kControlTopic;
    control.type = "std_msgs/msg/String";
    control.cdr =
        interfaces::encode_cdr(interfaces::RosString{R"({"actions": [{"time": 1.2, "release": {"object": "held"}}]})"});
    messages_.insert(messages_.begin() + 20, control);
  }
  /// What a robot sees of `world`, for who tracks `scene`.
  void set_up(const std::string& world, const std::string& scene) {
    ASSERT_TRUE(tests::record_scene(world, {"world.yaml", world, 1, ""}, 15.0, file("robot.mcap")).ok());
    messages_ = messages_of(file("robot.mcap"));
    scene_text_ = scene;
    const auto read = load_scene_text(scene, "scene.yaml", {});
    ASSERT_TRUE(read.ok()) << read.status().message();
    scene_ = *read;
  }
  path file(const std::string& name) const { return folder_.path() / name; }
  path part(std::uint64_t number) const { return part_path(file("run.mcap"), number); }

  std::unique_ptr<RollingRecording> begin(const RollingOptions& options = {}) {
    auto recording =
        RollingRecording::create(file("run.mcap"), {"scene.yaml", scene_text_, 1, "", FilesOfScene{}}, options);
    EXPECT_TRUE(recording.ok()) << recording.status().message();
    return *std::move(recording);
  }
  std::unique_ptr<Tracker> tracker() {
    auto made = Tracker::create(scene_, {}, 1, backends_);
    EXPECT_TRUE(made.ok());
    return *std::move(made);
  }
  static void go_on_in_next_file(RollingRecording& recording, Tracker& tracker) {
    while (!recording.is_change_due()) std::this_thread::yield();
    tracker.measure_cameras_anew();
    recording.change(
        [snapshot = tracker.snapshot(), scene = tracker.scene()] { return snapshot_text(snapshot, scene); });
  }
  /// Tracks and records as the live service does, but for its threads; `before` is called with the number of each
  /// message before it comes.
  void serve(RollingRecording& recording, const std::function<void(std::size_t number, Tracker&)>& before) {
    const auto tracks = tracker();
    for (std::size_t i = 0; i < messages_.size(); ++i) {
      before(i, *tracks);
      const MessageIndex index = recording.write(messages_[i]);
      EXPECT_EQ(index, i);
      EXPECT_TRUE(tracks->take_in(messages_[i], index).ok());
      while (const auto step = tracks->step(messages_[i].received_ns)) {
        steps_.push_back(step->record.belief_hash);
        if (recording.is_on()) ++recorded_steps_;
        recording.write_json(kStepTopic, belief::json_text(to_json(step->record)), messages_[i].received_ns);
      }
      if (const auto oldest = tracks->oldest_needed()) recording.need_images_from(*oldest);
      recording.write_due(messages_[i].received_ns);
    }
  }
  /// The same with changes before the messages of these numbers.
  void serve_with_changes(const std::set<std::size_t>& changes, const RollingOptions& options = {}) {
    const auto recording = begin(options);
    serve(*recording, [&](std::size_t number, Tracker& tracks) {
      if (!changes.contains(number)) return;
      recording->ask_for_change();
      go_on_in_next_file(*recording, tracks);
    });
    EXPECT_TRUE(recording->close().ok());
    EXPECT_EQ(recording->state().files, changes.size() + 1);
  }
  ReplaySummary replayed(const path& from, bool all_parts) {
    const auto tracks = tracker();
    RecordingReadOptions options;
    options.all_parts = all_parts;
    const auto summary = replay_recording(from, options, *tracks, {}, {}, {}, {});
    EXPECT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->different, 0u) << from << ", step " << summary->first_different_step.value_or(0);
    return *summary;
  }

  tests::ScratchDir folder_;
  std::vector<interfaces::ReceivedMessage> messages_;
  std::string scene_text_;
  std::shared_ptr<const belief::Scene> scene_;
  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  std::vector<std::string> steps_;
  std::size_t recorded_steps_ = 0;
};

std::set<std::size_t> random_changes(std::size_t among, int count, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::set<std::size_t> changes;
  while (std::ssize(changes) < count)
    changes.insert(30 + static_cast<std::size_t>(stream.uniform() * static_cast<double>(among - 30)));
  return changes;
}

TEST_F(RollingRecordingLaws, EachFileReplaysToTheRecordedBitsAloneAndAfterOthers) {
  serve_with_changes(random_changes(messages_.size(), 4, 1));
  ASSERT_GE(steps_.size(), 25u);
  std::uint64_t alone = 0;
  for (std::uint64_t number = 0; number <= 4; ++number) {
    const ReplaySummary one = replayed(part(number), false);
    EXPECT_EQ(one.began_anew, "") << number;
    EXPECT_EQ(one.loss, "") << number;
    alone += one.compared;
    const ReplaySummary rest = replayed(part(number), true);
    EXPECT_EQ(rest.compared, steps_.size() - (alone - one.compared)) << number;
  }
  EXPECT_EQ(alone, steps_.size());
}

TEST_F(RollingRecordingLaws, AllFilesTogetherHoldEachMessageOnce) {
  serve_with_changes(random_changes(messages_.size(), 5, 2));
  const auto all = RecordingReader::open(file("run.mcap"), {.all_parts = true});
  ASSERT_TRUE(all.ok()) << all.status().message();
  std::size_t number = 0, steps = 0;
  for (;;) {
    const auto entry = (*all)->next();
    ASSERT_TRUE(entry.ok()) << entry.status().message();
    if (!*entry) break;
    if ((*entry)->is_json) {
      ++steps;
      continue;
    }
    ASSERT_LT(number, messages_.size());
    EXPECT_EQ((*entry)->index, number);
    EXPECT_EQ((*entry)->message.topic, messages_[number].topic);
    EXPECT_EQ((*entry)->message.received_ns, messages_[number].received_ns);
    EXPECT_EQ((*entry)->message.cdr, messages_[number].cdr);
    ++number;
  }
  EXPECT_EQ(number, messages_.size());
  EXPECT_EQ(steps, steps_.size());
  EXPECT_EQ((*all)->loss_text(), "");
  // And in what the files themselves say.
  std::size_t robots = 0;
  for (std::uint64_t part_number = 0; part_number <= 5; ++part_number) {
    const auto reader = interfaces::McapReader::open(part(part_number));
    ASSERT_TRUE(reader.ok());
    for (auto message = (*reader)->next(); message.ok() && *message; message = (*reader)->next()) {
      const auto& channel = (*reader)->channels()[static_cast<std::size_t>((*message)->channel)];
      robots += channel.metadata.contains("prescene") ? 0 : 1;
    }
  }
  EXPECT_EQ(robots, messages_.size());
}

TEST_F(RollingRecordingLaws, ABagIsReplayedAsAWholeWithAndWithoutItsMetadata) {
  const path bag = file("bag");
  {
    auto recording = RollingRecording::create(bag / "bag_0.mcap", {"scene.yaml", scene_text_, 1, "", FilesOfScene{}},
                                              {.as_bag = true});
    ASSERT_TRUE(recording.ok()) << recording.status().message();
    const auto changes = random_changes(messages_.size(), 3, 7);
    serve(**recording, [&](std::size_t number, Tracker& tracks) {
      if (!changes.contains(number)) return;
      (*recording)->ask_for_change();
      go_on_in_next_file(**recording, tracks);
    });
    // As long as it goes on, and where it is killed, there are none.
    EXPECT_FALSE(std::filesystem::exists(bag / "metadata.yaml"));
    EXPECT_TRUE((*recording)->close().ok());
  }
  const auto as_others_read_it = interfaces::BagReader::open(bag);
  ASSERT_TRUE(as_others_read_it.ok()) << as_others_read_it.status().message();
  EXPECT_EQ((*as_others_read_it)->files().size(), 4u);
  std::uint64_t messages = 0;
  for (auto message = (*as_others_read_it)->next(); message.ok() && *message; message = (*as_others_read_it)->next())
    ++messages;
  EXPECT_EQ((*as_others_read_it)->message_count(), messages);
  const ReplaySummary whole = replayed(bag, false);
  EXPECT_EQ(whole.compared, steps_.size());
  EXPECT_EQ(whole.loss, "");
  std::filesystem::remove(bag / "metadata.yaml");
  EXPECT_EQ(replayed(bag, false).compared, steps_.size());
  // A folder that is there is nobody's to write into.
  EXPECT_EQ(RollingRecording::create(bag / "bag_0.mcap", {}, {.as_bag = true}).status().code(),
            core::StatusCode::kUnavailable);
}

TEST_F(RollingRecordingLaws, CutAnywhereAFileReplaysToItsEndAndThoseBeforeItAreWhole) {
  serve_with_changes({messages_.size() / 3, 2 * messages_.size() / 3});
  const std::uint64_t before = replayed(part(0), false).compared + replayed(part(1), false).compared;
  const auto bytes = static_cast<double>(std::filesystem::file_size(part(2)));
  int anew = 0;
  for (int i = 1; i < 16; ++i) {
    SCOPED_TRACE(i);
    const path cut = folder_.path() / ("cut" + std::to_string(i));
    std::filesystem::create_directory(cut);
    for (std::uint64_t number = 0; number <= 2; ++number)
      std::filesystem::copy_file(part(number), cut / part(number).filename());
    std::filesystem::resize_file(cut / part(2).filename(), static_cast<std::uintmax_t>(bytes * i / 16.0));
    const ReplaySummary all = replayed(cut / "run.mcap", true);
    EXPECT_GE(all.compared, before);
    EXPECT_NE(all.loss, "");
    const ReplaySummary alone = replayed(cut / part(2).filename(), false);
    if (alone.began_anew.empty()) {
      EXPECT_EQ(alone.compared, all.compared - before);
    } else {
      ++anew;
      EXPECT_EQ(alone.compared, 0u);
    }
  }
  EXPECT_LT(anew, 15) << "a file holds the belief soon after its beginning";
}

TEST_F(RollingRecordingLaws, GoesOnInANewFileAfterWritingFailed) {
  const auto recording = begin({.part = {}, .pause = 0.0, .room = 0});
  serve(*recording, [&](std::size_t number, Tracker& tracks) {
    if (number == 80) recording->fail(core::unavailable("run.mcap: no space left on device"));
    if (number != 120) return;
    EXPECT_EQ(recording->state().failure, "run.mcap: no space left on device");
    EXPECT_EQ(recording->state().lost_messages, 40u);
    go_on_in_next_file(*recording, tracks);
    EXPECT_TRUE(recording->is_on());
    EXPECT_EQ(recording->state().failure, "");
  });
  EXPECT_EQ(recording->state().interruptions, 1u);
  EXPECT_EQ(recording->state().tries, 1u);
  EXPECT_EQ(recording->close().message(), "run.mcap: no space left on device") << "it is told in the end";
  const std::uint64_t first = replayed(part(0), false).compared, second = replayed(part(1), false).compared;
  EXPECT_GT(first, 0u);
  EXPECT_GT(second, 0u);
  EXPECT_EQ(first + second, recorded_steps_);
  const ReplaySummary all = replayed(part(0), true);
  EXPECT_EQ(all.compared, recorded_steps_) << "the belief is taken up after the gap";
  EXPECT_NE(all.loss, "");
  EXPECT_EQ(all.missing, "") << "no file has what was not recorded";
  EXPECT_EQ(all.began_anew, "");
}

TEST_F(RollingRecordingLaws, SaysWhichMessagesOfAMissingPartAreNotThere) {
  serve_with_changes({60, 100, 140});
  const std::string is_not_there = "run_0002.mcap: 40 messages before it are not there";
  std::filesystem::rename(part(1), file("aside"));
  EXPECT_EQ(replayed(part(0), true).loss, is_not_there);
  EXPECT_EQ(replayed(part(0), true).missing, is_not_there);
  const std::string with_name =
      is_not_there + " (passed over, as they are no readable parts of the recording: run_0001.mcap)";
  std::ofstream(part(1)).flush();
  EXPECT_EQ(replayed(part(0), true).loss, with_name) << "it is empty";
  std::filesystem::copy_file(file("robot.mcap"), part(1), std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(replayed(part(0), true).loss, with_name) << "it is another recording's";
  std::filesystem::copy_file(file("aside"), part(1), std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(replayed(part(0), true).loss, "");
  EXPECT_EQ(replayed(part(0), true).missing, "");

  std::filesystem::resize_file(part(1), std::filesystem::file_size(part(1)) / 2);
  EXPECT_THAT(replayed(part(0), true).loss, HasSubstr(" messages before it are not there")) << "it was cut";
  std::filesystem::copy_file(file("aside"), part(1), std::filesystem::copy_options::overwrite_existing);

  std::ofstream(part(4)).flush();
  EXPECT_EQ(replayed(part(0), true).loss, "run_0004.mcap: it can't be read");
  EXPECT_EQ(replayed(part(0), true).missing, "run_0004.mcap: it can't be read");
  std::filesystem::remove(part(4));

  std::filesystem::resize_file(part(3), std::filesystem::file_size(part(3)) / 2);
  EXPECT_NE(replayed(part(0), true).loss, "");
  EXPECT_EQ(replayed(part(0), true).missing, "") << "the end of a recording is cut wherever a program is killed";
}

// The files after a damaged one go on from the belief that they hold, not from what the damage made of it.
TEST_F(RollingRecordingLaws, TakesUpTheBeliefAfterADamagedPart) {
  serve_with_changes({messages_.size() / 3, 2 * messages_.size() / 3});
  const std::uint64_t last = replayed(part(2), false).compared;
  const auto bytes = static_cast<double>(std::filesystem::file_size(part(1)));
  std::filesystem::copy_file(part(1), file("aside"));
  int damaged = 0;
  for (int i = 1; i < 16; ++i) {
    SCOPED_TRACE(i);
    std::filesystem::copy_file(file("aside"), part(1), std::filesystem::copy_options::overwrite_existing);
    {
      std::fstream bad(part(1), std::ios::in | std::ios::out | std::ios::binary);
      bad.seekp(static_cast<std::streamoff>(bytes * i / 16.0));
      bad << std::string(64, '\x5a');
    }
    const auto tracks = tracker();
    RecordingReadOptions options;
    options.all_parts = options.salvage = true;
    const auto all = RecordingReader::open(part(0), options);
    ASSERT_TRUE(all.ok()) << all.status().message();
    bool goes_on = true;
    for (auto entry = (*all)->next(); entry.ok() && *entry; entry = (*all)->next())
      if ((*entry)->part && (*entry)->part->number == 2) goes_on = (*entry)->part->goes_on;
    if ((*all)->loss_text().empty()) continue;
    ++damaged;
    EXPECT_FALSE(goes_on) << (*all)->loss_text();
    const auto summary = replay_recording(part(0), options, *tracks, {}, {}, {}, {});
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_GE(summary->compared - summary->different, last);
  }
  EXPECT_GT(damaged, 5);
}

TEST_F(RollingRecordingLaws, BeginsNoFileWithoutRoomOrOverAnotherOne) {
  {
    const auto recording = begin({.part = {}, .pause = 0.0, .room = std::uint64_t{1} << 62});
    recording->fail(core::unavailable("full"));
    for (int i = 0; i < 3; ++i) {
      recording->write(messages_[static_cast<std::size_t>(i)]);
      EXPECT_FALSE(recording->is_change_due());
    }
    EXPECT_EQ(recording->state().tries, 3u);
    EXPECT_THAT(recording->state().failure, HasSubstr("are free; from"));
    EXPECT_FALSE(recording->close().ok());
  }
  EXPECT_FALSE(std::filesystem::exists(part(1)));

  std::filesystem::remove(part(0));
  const auto recording = begin({.part = {}, .pause = 0.0});
  std::filesystem::copy_file(file("robot.mcap"), part(1));
  const auto bytes = std::filesystem::file_size(part(1));
  const auto tracks = tracker();
  recording->ask_for_change();
  go_on_in_next_file(*recording, *tracks);
  EXPECT_EQ(recording->state().file, part(2));
  EXPECT_TRUE(recording->close().ok());
  EXPECT_EQ(std::filesystem::file_size(part(1)), bytes);
  const auto reader = RecordingReader::open(part(0));
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(parts_after(part(0), (*reader)->info().part), std::vector<path>{part(2)}) << "the other is not of it";
}

TEST_F(RollingRecordingLaws, BeginsANewFileByTimeAndBySize) {
  for (const PartLimits& limits : {PartLimits{.seconds = 0.5}, PartLimits{.bytes = 300'000}}) {
    SCOPED_TRACE(limits.seconds);
    steps_.clear();
    const auto recording = begin({.part = limits, .safety = {0.05, 0.0}, .pause = 0.0});
    std::uint64_t waited = 0;
    serve(*recording, [&](std::size_t number, Tracker& tracks) {
      // On a busy machine no file may be ready before all has come: one change is waited for.
      const bool is_waited_for = waited == 0 && number + 1 == messages_.size();
      if (!recording->is_change_due() && !is_waited_for) return;
      ++waited;
      go_on_in_next_file(*recording, tracks);
    });
    EXPECT_TRUE(recording->close().ok());
    EXPECT_GE(waited, 1u);
    EXPECT_EQ(recording->state().files, waited + 1);
    const ReplaySummary all = replayed(part(0), true);
    EXPECT_EQ(all.compared, steps_.size());
    for (std::uint64_t number = 0; number <= waited; ++number) std::filesystem::remove(part(number));
  }
}

TEST_F(RollingRecordingLaws, RemovesTheOldestAndTheOthersReplay) {
  serve_with_changes({60, 100, 140, 180}, {.part = {.keep_bytes = 1}});
  for (std::uint64_t number = 0; number <= 4; ++number)
    EXPECT_EQ(std::filesystem::exists(part(number)), number >= 3) << number;
  EXPECT_GT(replayed(part(3), true).compared, 0u);
  EXPECT_EQ(unused_recording_path(file("run.mcap")), file("run-2.mcap")) << "its files are not written over";
}

TEST_F(RollingRecordingLaws, CountsEachFileThatWasRemovedOnce) {
  const auto recording = begin({.part = {.keep_bytes = 1}, .pause = 0.0});
  const auto tracks = tracker();
  for (int i = 0; i < 40; ++i) {
    recording->ask_for_change();
    go_on_in_next_file(*recording, *tracks);
  }
  EXPECT_TRUE(recording->close().ok());
  std::uint64_t there = 0;
  for (std::uint64_t number = 0; number <= 40; ++number) there += std::filesystem::exists(part(number)) ? 1 : 0;
  EXPECT_EQ(there, 2u);
  EXPECT_EQ(recording->state().removed, 41 - there);
}

// A file that carries much is not full at its beginning.
TEST_F(RollingRecordingLaws, TheSizeOfAPartIsThatOfWhatIsNewInIt) {
  constexpr std::uint64_t kAttached = 1'000'000, kNew = 200'000;
  auto made = RollingRecording::create(
      file("run.mcap"),
      {"scene.yaml", kScene, 1, "", FilesOfScene{{"big.bin", std::vector<std::uint8_t>(kAttached, 7)}}},
      {.part = {.bytes = kNew}, .safety = {0.05, 0.0}, .pause = 0.0});
  ASSERT_TRUE(made.ok()) << made.status().message();
  const auto recording = *std::move(made);
  serve(*recording, [&](std::size_t number, Tracker& tracks) {
    const bool is_waited_for = recording->state().files == 1 && number + 1 == messages_.size();
    if (recording->is_change_due() || is_waited_for) go_on_in_next_file(*recording, tracks);
  });
  EXPECT_TRUE(recording->close().ok());
  const std::uint64_t files = recording->state().files;
  EXPECT_GE(files, 2u);
  for (std::uint64_t number = 0; number + 1 < files; ++number)
    EXPECT_GE(std::filesystem::file_size(part(number)), kAttached + kNew) << number;
}

interfaces::ReceivedMessage transform(const std::string& topic, const std::string& parent, const std::string& child,
                                      double x, core::TimeNs received_ns) {
  interfaces::RosTransformStamped stamped;
  stamped.header.stamp.sec = static_cast<std::int32_t>(received_ns / 1'000'000'000);
  stamped.header.frame_id = parent;
  stamped.child_frame_id = child;
  stamped.transform.translation.x = x;
  stamped.transform.rotation.w = 1.0;
  interfaces::RosTfMessage message;
  message.transforms.push_back(stamped);
  return {topic, "tf2_msgs/msg/TFMessage", interfaces::encode_cdr(message), received_ns, received_ns};
}

/// Of each message that a new file repeats, its transform's parent and x.
std::vector<std::pair<std::string, double>> repeated_by(const RepeatedMessages& repeated) {
  std::vector<std::pair<std::string, double>> all;
  EXPECT_TRUE(repeated
                  .each([&all](const interfaces::ReceivedMessage& message, MessageIndex) {
                    const auto tf = interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr);
                    EXPECT_TRUE(tf.ok());
                    all.emplace_back(tf->transforms.at(0).header.frame_id, tf->transforms[0].transform.translation.x);
                    return core::ok_status();
                  })
                  .ok());
  return all;
}

constexpr core::TimeNs kSecondNs = 1'000'000'000;

TEST(RepeatedMessagesTest, TheNewestStaticTransformComesLast) {
  RepeatedMessages repeated;
  MessageIndex index = 0;
  for (const double x : {1.0, 2.0, 1.0})
    repeated.note(transform("/tf_static", "world", "camera", x, kSecondNs), index++);
  ASSERT_FALSE(repeated_by(repeated).empty());
  EXPECT_EQ(repeated_by(repeated).back().second, 1.0);
  // Published again and again with new stamps: they do not add up, and drive out no other.
  repeated.note(transform("/tf_static", "world", "base", 5.0, kSecondNs), index++);
  for (int i = 2; i < 3000; ++i) repeated.note(transform("/tf_static", "world", "camera", i, i * kSecondNs), index++);
  using Repeated = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(repeated_by(repeated), (Repeated{{"world", 1.0}, {"world", 5.0}, {"world", 2999.0}}));
}

// Which parent a frame has is decided by who came first.
TEST(RepeatedMessagesTest, AnotherParentDoesNotComeBeforeTheFirst) {
  RepeatedMessages repeated;
  repeated.note(transform("/tf_static", "world", "camera", 1.0, kSecondNs), 0);
  repeated.note(transform("/tf_static", "other", "camera", 2.0, kSecondNs), 1);
  repeated.note(transform("/tf_static", "world", "camera", 3.0, kSecondNs), 2);
  using Repeated = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(repeated_by(repeated), (Repeated{{"world", 1.0}, {"other", 2.0}, {"world", 3.0}}));
}

TEST(RepeatedMessagesTest, StaticIsWhatComesOnTheTopicThatIsNamed) {
  RepeatedMessages repeated("/robot/fixed");
  repeated.note(transform("/robot/fixed", "world", "camera", 1.0, kSecondNs), 0);
  repeated.note(transform("/robot/not_static", "world", "hand", 2.0, kSecondNs), 1);
  repeated.note(transform("/tf", "world", "arm", 3.0, 30 * kSecondNs), 2);
  using Repeated = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(repeated_by(repeated), (Repeated{{"world", 1.0}, {"world", 3.0}}));
}

TEST(RepeatedMessagesTest, AReaderThatBeginsLaterReadsTheStaticTransformsOfTheTopicThatTheSettingsName) {
  const tests::ScratchDir folder;
  const path recording = folder.path() / "fixed.mcap";
  auto writer = RecordingWriter::create(recording, {"", "", 1, R"({"tf_static_topic": "/robot/fixed"})"});
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  EXPECT_TRUE((*writer)->write(transform("/robot/fixed", "world", "camera", 1.0, kSecondNs)).ok());
  EXPECT_TRUE((*writer)->write(transform("/robot/not_static", "world", "hand", 2.0, kSecondNs)).ok());
  EXPECT_TRUE((*writer)->write(transform("/tf", "world", "arm", 3.0, 30 * kSecondNs)).ok());
  EXPECT_TRUE((*writer)->close().ok());
  const auto reader = RecordingReader::open(recording, {.from = 25.0});
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::vector<std::string> topics;
  for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next())
    topics.push_back((*entry)->message.topic);
  EXPECT_EQ(topics, (std::vector<std::string>{"/robot/fixed", "/tf"}));
}

TEST_F(RollingRecordingLaws, AFileBeginsAnewFromALaterMomentAndSaysNothingOfBits) {
  serve_with_changes({100});
  const auto tracks = tracker();
  const auto summary = replay_recording(part(1), {.from = 0.3}, *tracks, {}, {}, {}, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_FALSE(summary->followed_step_records);
  EXPECT_GT(summary->steps, 0u) << "the static transforms and the camera info are there";
}

TEST_F(RollingRecordingLaws, AFileIsDescribedByWhatIsNewInIt) {
  serve_with_changes({100});
  const auto of_all = overview_of(file("robot.mcap"), {}, {}), later = overview_of(part(1), {}, {});
  ASSERT_TRUE(of_all.ok() && later.ok());
  std::uint64_t robots = 0;
  for (const RecordedTopic& topic : later->topics)
    if (topic.of == "robot") robots += topic.messages;
  EXPECT_EQ(robots, messages_.size() - 100);
  EXPECT_EQ(later->transforms.size(), of_all->transforms.size()) << "the static ones, too";
  for (const std::string& problem : later->problems) EXPECT_THAT(problem, Not(HasSubstr("could be read")));
}

/// Things on a table, none of which the scene names: neither the box, nor the can, nor the table.
TEST_F(RollingRecordingLaws, WhatWasFoundIsInTheBeliefOfEachFile) {
  const std::string camera =
      "camera: {width: 320, height: 240, fov_deg: 55, look: {from: [0.15, -0.65, 0.55], at: [0, 0, 0.04]}}\n";
  set_up(R"(name: found
duration: 0.6
models:
  block: {box: [0.09, 0.06, 0.11], mass: 0.3}
  can: {cylinder: {radius: 0.035, length: 0.11}, mass: 0.3}
supports:
  table: {box: [1.0, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  block: {model: block, pose: {position: [-0.12, 0.02, 0.055], rotation: {euler_deg: [0, 0, 25]}}}
  can: {model: can, pose: {position: [0.12, 0.03, 0.055]}}
)" + camera,
         "name: unknown\nnew_objects: true\n" + camera);
  serve_with_changes({messages_.size() / 3, 2 * messages_.size() / 3});
  ASSERT_GE(steps_.size(), 6u);
  std::uint64_t compared = 0;
  for (std::uint64_t number = 0; number <= 2; ++number) {
    const ReplaySummary one = replayed(part(number), false);
    EXPECT_EQ(one.began_anew, "") << number;
    compared += one.compared;
  }
  EXPECT_EQ(compared, steps_.size());

  const auto tracks = tracker();
  ASSERT_TRUE(replay_recording(part(0), {}, *tracks, {}, {}, {}, {}).ok());
  const std::shared_ptr<const belief::Belief> belief = tracks->belief();
  EXPECT_EQ(belief->objects.size(), 2u);
  EXPECT_EQ(belief->scene->supports.size(), 1u);
  const auto text = snapshot_text(tracks->snapshot(), scene_);
  ASSERT_TRUE(text.ok()) << text.status().message();
  const auto read = snapshot_from_text(*text, scene_);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(*read->belief->scene, *belief->scene);
  for (const auto& [what, with] : std::map<std::string, std::string>{{"\"unknown_1\"", "\"box\""},
                                                                     {"\"cylinder\"", "\"sphere\""},
                                                                     {"\"support_plane\"", "\"plane\""},
                                                                     {"\"pose\"", "\"place\""}}) {
    std::string changed = *text;
    ASSERT_NE(changed.find(what), std::string::npos) << what;
    changed.replace(changed.find(what), what.size(), with);
    EXPECT_FALSE(snapshot_from_text(changed, scene_).ok()) << what;
  }
}

// What follows from nothing that is written is not promised.
TEST_F(RollingRecordingLaws, ABeliefWhoseSceneCannotBeWrittenIsNotWritten) {
  const auto tracks = tracker();
  auto scene = std::make_shared<belief::Scene>(*scene_);
  scene->supports.front().X_WS.translation.x() += 0.01;
  auto belief = std::make_shared<belief::Belief>(*tracks->belief());
  belief->scene = scene;
  const auto text = snapshot_text({belief, {}, {}}, scene_);
  EXPECT_EQ(text.status().code(), core::StatusCode::kUnsupported);
}

// A recording comes from outside: what the filter looks for by its place has to be there.
TEST_F(RollingRecordingLaws, ABeliefThatIsNotOfItsSceneIsRefused) {
  const auto tracks = tracker();
  EXPECT_TRUE(snapshot_text({tracks->belief(), {}, {}}, scene_).ok());
  const auto refused = [&](const auto& change) {
    auto belief = std::make_shared<belief::Belief>(*tracks->belief());
    change(*belief);
    const auto text = snapshot_text({belief, {}, {}}, scene_);
    EXPECT_THAT(text.status().message(), HasSubstr("not those of its scene"));
  };
  refused([](belief::Belief& belief) { belief.objects.pop_back(); });
  refused([](belief::Belief& belief) { std::swap(belief.objects[0], belief.objects[1]); });
  refused([](belief::Belief& belief) { belief.robot.resize(2); });
  refused([](belief::Belief& belief) { belief.cameras.resize(3); });
  refused([](belief::Belief& belief) { belief.objects[0].views.resize(2); });
}

}  // namespace
}  // namespace prescene::service::rolling_recording_test
