// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/replay.h"

#include <gtest/gtest.h>

#include "prescene/service/load_scene.h"
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

}  // namespace
}  // namespace prescene::service::replay_test
