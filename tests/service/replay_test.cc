// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/replay.h"

#include <gtest/gtest.h>

#include "prescene/service/load_scene.h"
#include "prescene/service/simulated_recording.h"
#include "prescene/tests/support/paths.h"

namespace prescene::service::replay_test {
namespace {

constexpr const char* kScene = R"(name: box
duration: 0.5
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.05]}}
camera:
  width: 80
  height: 60
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
)";

TEST(Replay, StoppedOnRequestKeepsTheStepsThatWereMade) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto scene = load_scene_text(kScene, "box.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  {
    const auto recording = RecordingWriter::create(path, {"box.yaml", kScene, 1, ""});
    ASSERT_TRUE(recording.ok());
    SimulatedRecordingOptions options;
    options.rate = 10.0;
    ASSERT_TRUE(simulate_recording(**scene, options, 1, backends, {}, {}, **recording).ok());
    ASSERT_TRUE((*recording)->close().ok());
  }
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
