// SPDX-License-Identifier: Apache-2.0
// Whichever allocation fails, in whichever thread: a recording goes on, and all that it lacks is counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <functional>
#include <new>
#include <thread>

#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/service/recording/rolling_recording.h"
#include "tests/support/allocations.h"
#include "tests/support/paths.h"

namespace prescene::service::recording_memory_test {
namespace {

using std::filesystem::path;

interfaces::ReceivedMessage message(std::uint64_t number) {
  return {"/tf_static", "tf2_msgs/msg/TFMessage", std::vector<std::uint8_t>(200, static_cast<std::uint8_t>(number)), 1,
          static_cast<core::TimeNs>(number)};
}

/// The messages that all files together hold, and what they say is missing.
struct Held {
  std::uint64_t messages = 0;
  std::string loss;
};
Held held_from(const path& first) {
  RecordingReadOptions options;
  options.all_parts = options.salvage = true;
  const auto reader = RecordingReader::open(first, options);
  EXPECT_TRUE(reader.ok()) << reader.status().message();
  for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next())
    EXPECT_EQ((*entry)->message.cdr, message((*entry)->index).cdr);
  Held held{0, (*reader)->loss_text()};
  // Each once, but for what is repeated.
  for (const auto& file : std::filesystem::directory_iterator(first.parent_path())) {
    const auto part = interfaces::McapReader::open(file.path(), {.salvage = true});
    if (!part) continue;
    for (auto next = (*part)->next(); next.ok() && *next; next = (*part)->next())
      held.messages += is_repeated((*part)->channels()[static_cast<std::size_t>((*next)->channel)]) ? 0 : 1;
  }
  return held;
}

class RecordingMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations can't be made to fail in this build";
  }
  std::unique_ptr<RollingRecording> begin(const path& first) {
    auto made =
        RollingRecording::create(first, {"", "", 1, "", FilesOfScene{{"a", {1, 2, 3}}}},
                                 {.part = {.keep_bytes = std::uint64_t{1} << 40}, .safety = {0.2, 0.0}, .pause = 0.0},
                                 [this](core::LogLevel, const std::string&) { ++lines_; });
    EXPECT_TRUE(made.ok()) << made.status().message();
    return *std::move(made);
  }
  /// Calls what may find no memory; it is tried again by who calls, as LiveService does.
  static bool tried(const std::function<void()>& what) {
    try {
      what();
      return true;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }
  static void write(RollingRecording& recording, std::uint64_t& number) {
    recording.write(message(number));
    ++number;
  }
  static void go_on_in_next_file(RollingRecording& recording, const RollingRecording::Snapshot& snapshot) {
    const std::uint64_t files = recording.state().files;
    recording.ask_for_change();
    for (int i = 0; recording.state().files == files; ++i) {
      ASSERT_LT(i, 100'000'000) << "it does not come to a next file any more";
      bool is_due = false;
      tried([&] { is_due = recording.is_change_due(); });
      if (is_due) tried([&] { recording.change(snapshot); });
      std::this_thread::yield();
    }
  }

  const tests::ScratchDir folder_;
  int lines_ = 0;
};

TEST_F(RecordingMemory, OnItsOwnThreadNothingIsLostUnsaid) {
  std::uint64_t failed = 0, said = 0, cut = 0;
  bool fails = true;
  for (std::uint64_t n = 0; fails; ++n) {
    SCOPED_TRACE(n);
    const path first = folder_.path() / ("run" + std::to_string(n)) / "run.mcap";
    std::filesystem::create_directory(first.parent_path());
    const auto recording = begin(first);
    std::uint64_t number = 0;
    write(*recording, number);
    // It is called on the thread: what fails is in the jobs after it, up to that which makes the next file ready.
    go_on_in_next_file(*recording, [n]() -> core::Result<std::string> {
      tests::fail_allocation_after(n);
      return std::string("{}");
    });
    write(*recording, number);
    std::atomic<bool> has_failed = false;
    go_on_in_next_file(*recording, [&has_failed]() -> core::Result<std::string> {
      has_failed = !tests::stop_failing_allocations();
      return std::string("{}");
    });
    write(*recording, number);
    const core::Status closed = recording->close();
    fails = has_failed;
    failed += fails ? 1 : 0;
    said += recording->state().unfinished;
    cut += closed.ok() ? 0 : 1;
    const Held held = held_from(first);
    if (closed.ok()) {
      EXPECT_EQ(held.messages, number);
      EXPECT_EQ(held.loss, "");
    } else {  // What was kept back for less than a second when the file before was closed.
      EXPECT_EQ(recording->state().first_failure, "out of memory");
      EXPECT_GE(held.messages, number - 1);
      EXPECT_NE(held.loss, "");
    }
    if (HasFailure()) return;
  }
  std::printf(
      "compared: %llu allocations on the thread that failed, %llu jobs that were said to be unfinished, %llu "
      "files that were cut\n",
      static_cast<unsigned long long>(failed), static_cast<unsigned long long>(said),
      static_cast<unsigned long long>(cut));
  EXPECT_GT(failed, 30u);
}

TEST_F(RecordingMemory, OnTheThreadOfWhoOwnsItWhatIsLostIsCounted) {
  std::uint64_t failed = 0, interrupted = 0;
  bool fails = true;
  for (std::uint64_t n = 0; fails; ++n) {
    SCOPED_TRACE(n);
    const path first = folder_.path() / ("run" + std::to_string(n)) / "run.mcap";
    std::filesystem::create_directory(first.parent_path());
    const auto recording = begin(first);
    std::uint64_t number = 0;
    write(*recording, number);
    recording->ask_for_change();
    const auto snapshot = []() -> core::Result<std::string> { return std::string("{}"); };
    tests::fail_allocation_after(n);
    go_on_in_next_file(*recording, snapshot);
    // What is thrown has no number.
    for (int i = 0; i < 3; ++i) tried([&] { write(*recording, number); });
    tried([&] { recording->write_due(1'000'000'000); });
    fails = !tests::stop_failing_allocations();
    failed += fails ? 1 : 0;
    if (!recording->is_on()) go_on_in_next_file(*recording, snapshot);
    write(*recording, number);
    static_cast<void>(recording->close());
    const RollingState& state = recording->state();
    interrupted += state.interruptions;
    const Held held = held_from(first);
    EXPECT_EQ(held.messages + state.lost_messages, number);
    if (state.lost_messages > 0) {
      EXPECT_NE(held.loss, "");
    } else if (state.interruptions == 0) {
      EXPECT_EQ(held.loss, "");
    }
    if (HasFailure()) return;
  }
  std::printf("compared: %llu allocations of the owner that failed, %llu interruptions\n",
              static_cast<unsigned long long>(failed), static_cast<unsigned long long>(interrupted));
  EXPECT_GT(failed, 30u);
}

}  // namespace
}  // namespace prescene::service::recording_memory_test
