// SPDX-License-Identifier: Apache-2.0
// The files of a recording beside those of others: none is written over, and none goes that is not to go.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <thread>
#include <vector>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/recording/repeated_messages.h"
#include "prescene/service/recording/rolling_recording.h"
#include "tests/support/paths.h"

namespace prescene::service::recording_room_test {
namespace {

using std::filesystem::path;
using ::testing::HasSubstr;

constexpr std::size_t kBytes = 200'000;

/// Bytes that no compression makes fewer.
std::vector<std::uint8_t> noise(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::uint64_t state = 1;
  for (std::uint8_t& byte : bytes) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    byte = static_cast<std::uint8_t>(state >> 56);
  }
  return bytes;
}

interfaces::ReceivedMessage image(std::size_t bytes = kBytes) {
  return {"/camera/depth", "sensor_msgs/msg/Image", noise(bytes), 1, 1};
}

std::set<std::string> names_in(const path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

void go_on_in_next_file(RollingRecording& recording) {
  recording.ask_for_change();
  while (!recording.is_change_due()) std::this_thread::yield();
  recording.change(nullptr);
}

class RecordingRoomTest : public ::testing::Test {
 protected:
  path file(const std::string& name) const { return folder_.path() / name; }
  std::unique_ptr<RollingRecording> begin(const std::string& name, const RollingOptions& options = {}) {
    auto recording = RollingRecording::create(file(name), {}, options);
    EXPECT_TRUE(recording.ok()) << recording.status().message();
    return *std::move(recording);
  }
  /// A run of what is asked for as "run.mcap", as a supervisor starts it again and again.
  std::unique_ptr<RollingRecording> run(std::uint64_t keep_bytes) {
    const path asked = file("run.mcap");
    return begin(unused_recording_path(asked).filename(),
                 {.part = {.keep_bytes = keep_bytes}, .pause = 0.0, .asked = asked});
  }
  static void write_three_files(RollingRecording& recording) {
    recording.write(image());
    for (int i = 0; i < 2; ++i) {
      go_on_in_next_file(recording);
      recording.write(image());
    }
  }

  const tests::ScratchDir folder_;
};

TEST_F(RecordingRoomTest, ARunThatIsStartedAgainRemovesWhatEarlierOnesLeft) {
  constexpr std::uint64_t kAll = 1'000'000'000;
  const auto first = run(kAll);
  write_three_files(*first);
  EXPECT_TRUE(first->close().ok());
  EXPECT_EQ(first->state().removed, 0u);

  const auto second = run(3 * kBytes / 2);
  EXPECT_EQ(second->state().file, file("run-2.mcap"));
  write_three_files(*second);
  EXPECT_TRUE(second->close().ok());
  EXPECT_EQ(names_in(folder_.path()), (std::set<std::string>{"run-2_0001.mcap", "run-2_0002.mcap"}));
  EXPECT_EQ(second->state().removed, 4u);

  // Also one that ends before it comes to a second file.
  const auto third = run(1);
  EXPECT_TRUE(third->close().ok());
  EXPECT_EQ(names_in(folder_.path()), (std::set<std::string>{"run.mcap"}));
  EXPECT_EQ(third->state().removed, 2u);
}

TEST_F(RecordingRoomTest, TheOldestOfEarlierRunsGoesFirst) {
  for (int i = 0; i < 3; ++i) {
    const auto earlier = run(1'000'000'000);
    earlier->write(image());
    EXPECT_TRUE(earlier->close().ok());
  }
  // By when they were written, whatever their names say.
  const auto now = std::filesystem::last_write_time(file("run.mcap"));
  std::filesystem::last_write_time(file("run.mcap"), now - std::chrono::hours(1));
  std::filesystem::last_write_time(file("run-2.mcap"), now - std::chrono::hours(3));
  std::filesystem::last_write_time(file("run-3.mcap"), now - std::chrono::hours(2));
  const auto last = run(3 * kBytes / 2);
  EXPECT_TRUE(last->close().ok());
  EXPECT_EQ(names_in(folder_.path()), (std::set<std::string>{"run.mcap", "run-4.mcap"}));
}

TEST_F(RecordingRoomTest, NothingElseGoes) {
  const RollingOptions bounded = {.part = {.keep_bytes = 1'000'000'000}};
  const auto record = [&](const std::string& name, const RollingOptions& options) {
    const auto recording = begin(name, options);
    recording->write(image());
    EXPECT_TRUE(recording->close().ok());
  };
  record("run-5.mcap", {});       // made to be kept
  record("run-6.mcap", bounded);  // another recording, which was asked for by this name
  record("walk.mcap", bounded);   // the same
  record("aside.mcap", {.part = bounded.part, .asked = file("run.mcap")});
  std::filesystem::rename(file("aside.mcap"), file("run-saved.mcap"));  // by a person
  record("aside.mcap", {.part = bounded.part, .asked = file("run.mcap")});
  std::filesystem::rename(file("aside.mcap"), file("run-20261127.mcap"));  // and to a name that a run could have
  ASSERT_TRUE(interfaces::write_file(file("run-7.mcap"), noise(kBytes)).ok());
  ASSERT_TRUE(interfaces::write_file(file("run_0001.txt"), noise(kBytes)).ok());
  auto simulated = RecordingWriter::create(file("run-8.mcap"), {});
  ASSERT_TRUE(simulated.ok());
  ASSERT_TRUE((*simulated)->close().ok());
  std::filesystem::create_directory(file("run-9.mcap"));
  std::filesystem::create_symlink(file("walk.mcap"), file("run-10.mcap"));
  const std::set<std::string> before = names_in(folder_.path());

  const auto last = run(1);
  EXPECT_TRUE(last->close().ok());
  std::set<std::string> after = names_in(folder_.path());
  EXPECT_EQ(after.erase("run.mcap"), 1u);
  EXPECT_EQ(after, before);
  EXPECT_EQ(last->state().removed, 0u);
}

// Two robots that record under one name into one folder.
TEST_F(RecordingRoomTest, ARunThatGoesOnIsNotTouched) {
  const auto other = run(1'000'000'000);
  write_three_files(*other);
  const auto last = run(1);
  EXPECT_TRUE(last->close().ok());
  EXPECT_EQ(last->state().removed, 0u);
  EXPECT_TRUE(other->close().ok());
  const auto later = run(1);
  EXPECT_TRUE(later->close().ok());
  EXPECT_EQ(later->state().removed, 4u) << "it has ended by now";
}

// A link that leads nowhere looks as if nothing were there.
TEST_F(RecordingRoomTest, BeginsNoFileThroughALinkThatLeadsNowhere) {
  const auto recording = begin("run.mcap", {.part = {}, .pause = 0.0});
  std::filesystem::create_symlink(file("elsewhere"), file("run_0001.mcap"));
  std::filesystem::create_symlink(file("elsewhere"), file("other.mcap"));
  go_on_in_next_file(*recording);
  EXPECT_EQ(recording->state().file, file("run_0002.mcap"));
  EXPECT_TRUE(recording->close().ok());
  EXPECT_EQ(unused_recording_path(file("other.mcap")), file("other-2.mcap"));
  EXPECT_THAT(RollingRecording::create(file("other.mcap"), {}).status().message(), HasSubstr("is there already"));
  EXPECT_FALSE(std::filesystem::exists(file("elsewhere")));
  EXPECT_TRUE(std::filesystem::is_symlink(file("run_0001.mcap")));
}

// Whoever is first has the name: the files of both are made at the same time.
TEST_F(RecordingRoomTest, TwoOfOneNameShareNoFile) {
  const auto first = begin("run.mcap", {.part = {}, .pause = 0.0});
  std::filesystem::rename(file("run.mcap"), file("aside.mcap"));
  const auto second = begin("run.mcap", {.part = {}, .pause = 0.0});
  std::set<path> files;
  constexpr std::size_t kChanges = 20;
  for (std::size_t i = 0; i < kChanges; ++i) {
    first->ask_for_change();
    second->ask_for_change();
    for (RollingRecording* one : {first.get(), second.get()}) {
      while (!one->is_change_due()) std::this_thread::yield();
      one->change(nullptr);
      files.insert(one->state().file);
    }
  }
  EXPECT_TRUE(first->close().ok());
  EXPECT_TRUE(second->close().ok());
  EXPECT_EQ(files.size(), 2 * kChanges);
  std::set<std::string> series;
  for (const path& one : files) {
    const auto says = part_of(one);
    ASSERT_TRUE(says.ok()) << says.status().message();
    series.insert(says->series);
  }
  EXPECT_EQ(series.size(), 2u);
}

TEST_F(RecordingRoomTest, WhatIsTooMuchToBeRepeatedIsCountedAndSaidOnceAFile) {
  std::vector<std::string> lines;
  auto made = RollingRecording::create(file("run.mcap"), {}, {.part = {}, .pause = 0.0},
                                       [&lines](core::LogLevel, const std::string& text) { lines.push_back(text); });
  ASSERT_TRUE(made.ok());
  RollingRecording& recording = **made;
  recording.need_images_from(0);
  constexpr std::size_t kEach = std::size_t{8} << 20;
  constexpr std::uint64_t kFit = RepeatedMessages::kMostBytes / kEach;
  interfaces::ReceivedMessage large = image(100);
  large.cdr.resize(kEach);  // zeros, which take no time to compress
  for (std::uint64_t i = 0; i < kFit; ++i) recording.write(large);
  EXPECT_EQ(recording.state().not_repeated, 0u);
  for (int i = 0; i < 3; ++i) recording.write(large);
  EXPECT_EQ(recording.state().not_repeated, 3u);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("128.0 MiB"));
  EXPECT_TRUE(recording.close().ok());
}

TEST(RepeatedMessagesBound, HoldsForStaticTransformsToo) {
  RepeatedMessages repeated;
  constexpr std::size_t kEach = std::size_t{4} << 20;
  constexpr std::uint64_t kFit = RepeatedMessages::kMostBytes / kEach;
  for (std::uint64_t i = 0; i < kFit + 5; ++i) {
    interfaces::ReceivedMessage message{"/tf_static", "tf2_msgs/msg/TFMessage", std::vector<std::uint8_t>(kEach), 1, 1};
    message.cdr.back() = static_cast<std::uint8_t>(i);  // none is understood, and no two are the same
    repeated.note(message, i);
    EXPECT_LE(repeated.bytes(), RepeatedMessages::kMostBytes);
  }
  EXPECT_EQ(repeated.dropped(), 5u);
}

}  // namespace
}  // namespace prescene::service::recording_room_test
