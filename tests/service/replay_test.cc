// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/replay.h"

#include <gtest/gtest.h>

#include <fstream>

#include "prescene/service/load_scene.h"
#include "prescene/service/recording/read_ahead.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::replay_test {
namespace {

TEST(Replay, StoppedOnRequestKeepsTheStepsThatWereMade) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  core::ThreadPool pool(1);
  Backends backends(pool);
  const std::string yaml = tests::box_on_table("0.5");
  const auto scene = load_scene_text(yaml, "box.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const core::Status recorded = tests::record_scene(yaml, {"box.yaml", yaml, 1, ""}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  const auto tracker = Tracker::create(*scene, {}, 1, backends);
  ASSERT_TRUE(tracker.ok()) << tracker.status().message();
  core::Cancellation cancellation;
  std::uint64_t steps = 0;
  const StepSink stop_after_two = [&](const TrackerStep&, const Tracker&) {
    if (++steps == 2) cancellation.request();
    return core::ok_status();
  };
  const auto summary = replay_recording(path, {}, **tracker, cancellation, {}, stop_after_two, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->cancelled);
  EXPECT_EQ(summary->steps, 2u);
}

/// Larger than what is read ahead, in messages and in bytes.
void write_messages(const std::filesystem::path& path) {
  const auto writer = RecordingWriter::create(path, {});
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  for (int i = 0; i < 200; ++i) {
    const auto byte = static_cast<std::uint8_t>(i);
    const std::vector<std::uint8_t> cdr(i % 10 == 0 ? std::size_t{1} << 20 : 100, byte);
    ASSERT_TRUE((*writer)->write({"/image", "sensor_msgs/msg/Image", cdr, i, 1000 + i}).ok());
  }
  ASSERT_TRUE((*writer)->close().ok());
}

DecodedImages decode_nothing(const interfaces::ReceivedMessage&) { return {}; }

TEST(ReadAhead, GivesWhatTheReaderGives) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  ASSERT_NO_FATAL_FAILURE(write_messages(path));
  const auto direct = RecordingReader::open(path), ahead_of = RecordingReader::open(path);
  ASSERT_TRUE(direct.ok() && ahead_of.ok());
  ReadAhead ahead(**ahead_of, decode_nothing);
  for (int i = 0; i < 200; ++i) {
    const auto expected = (*direct)->next();
    const auto entry = ahead.next();
    ASSERT_TRUE(expected.ok() && *expected && entry.ok() && *entry) << i;
    ASSERT_EQ((*entry)->recorded.index, (*expected)->index);
    ASSERT_EQ((*entry)->recorded.message.cdr, (*expected)->message.cdr) << i;
    ASSERT_EQ((*entry)->recorded.message.source_ns, i);
  }
  for (int i = 0; i < 2; ++i) {
    const auto end = ahead.next();
    ASSERT_TRUE(end.ok() && !*end);
  }
}

TEST(ReadAhead, GivesTheErrorAfterWhatCameBeforeIt) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  ASSERT_NO_FATAL_FAILURE(write_messages(path));
  // One byte, so that the reader notices it after some messages: most bytes of what is compressed, or stands between
  // chunks, may be any.
  const auto is_noticed = [&] {
    const auto reader = RecordingReader::open(path, {.check_data = false});
    for (int read = 0; reader.ok(); ++read) {
      const auto entry = (*reader)->next();
      if (!entry) return read > 0;
      if (!*entry) return false;
    }
    return false;
  };
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path));
  for (std::streamoff at = size / 10; at < size; ++at) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(at);
    const auto before = static_cast<char>(file.get());
    file.seekp(at);
    file.put('\x55');
    file.flush();
    if (is_noticed()) break;
    file.seekp(at);
    file.put(before);
  }
  ASSERT_TRUE(is_noticed());
  const auto direct = RecordingReader::open(path, {.check_data = false}),
             ahead_of = RecordingReader::open(path, {.check_data = false});
  ASSERT_TRUE(direct.ok() && ahead_of.ok());
  ReadAhead ahead(**ahead_of, decode_nothing);
  for (;;) {
    const auto expected = (*direct)->next();
    const auto entry = ahead.next();
    ASSERT_EQ(entry.status(), expected.status());
    if (!expected) break;
    ASSERT_TRUE(*expected && *entry);
    ASSERT_EQ((*entry)->recorded.index, (*expected)->index);
  }
}

TEST(ReadAhead, EndsWhereItIsStopped) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  ASSERT_NO_FATAL_FAILURE(write_messages(path));
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok());
  {
    ReadAhead ahead(**reader, decode_nothing);
    ASSERT_TRUE(ahead.next().ok());
  }
  // What it had read is gone, the reader goes on behind it.
  const auto entry = (*reader)->next();
  ASSERT_TRUE(entry.ok() && *entry);
  EXPECT_GT((*entry)->index, 0u);
}

}  // namespace
}  // namespace prescene::service::replay_test
