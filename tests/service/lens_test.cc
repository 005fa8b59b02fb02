// SPDX-License-Identifier: Apache-2.0
// A recording through a lens tracks as well as one without: the images are straightened on every path.
#include <gtest/gtest.h>

#include <vector>

#include "prescene/service/belief_summary.h"
#include "prescene/service/calibration/depth_noise.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/tracker.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::lens_test {
namespace {

/// A box in a corner of the image, where a lens distorts most.
const char* kScene = R"(name: box
duration: 1
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [1.2, 1.2, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0.2, 0.24, 0.05]}}
camera:
  width: 160
  height: 120
  fov_deg: 62
  look: {from: [0.5, -0.45, 0.5], at: [0, 0, 0.03]}
)";

geometry::LensDistortion barrel() {
  return *geometry::LensDistortion::brown({-0.28, 0.07, 0.001, -0.0005, 0.0, 0.0, 0.0, 0.0});
}

struct Tracked {
  ObjectTrackingScore score;
  std::vector<std::string> hashes;
  std::vector<std::pair<std::string, std::uint64_t>> degraded;
  core::Result<DepthNoise> depth_noise = core::not_found("not measured");
};

Tracked track(const geometry::LensDistortion& lens, std::optional<bool> rectified) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto scene = load_scene_text(kScene, "box.yaml", {});
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_TRUE(tests::record_scene(kScene, {"box.yaml", kScene, 1, ""}, 15.0, path, lens).ok());
  TrackerSettings settings;
  settings.assembler.rectified = rectified;
  Tracked tracked;
  // Twice, as the same input and seed give the same bits.
  for (int run = 0; run < 2; ++run) {
    const auto tracker = Tracker::create(*scene, settings, 1, backends);
    TrackingScore score(*scene);
    std::vector<std::string> hashes;
    const StepSink on_step = [&](const TrackerStep& step, const Tracker& at) {
      hashes.push_back(step.record.belief_hash);
      score.add(summary_of(*at.belief()));
      return core::ok_status();
    };
    const JsonSink on_json = [&](const std::string& topic, const std::string& json, core::TimeNs) {
      if (topic == kTruthTopic) score.add(*truth_from_json(json));
      return core::ok_status();
    };
    const auto summary = replay_recording(path, {}, **tracker, {}, {}, on_step, on_json);
    EXPECT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->steps, 16u);
    EXPECT_TRUE(run == 0 || hashes == tracked.hashes);
    tracked.hashes = hashes;
    tracked.degraded = summary->degraded;
    tracked.score = score.rows().at(0);
  }
  tracked.depth_noise = depth_noise_of(path, 0.001, {}, {});
  return tracked;
}

TEST(Lens, OfTheCameraDoesNotMakeTrackingWorse) {
  const Tracked without = track({}, std::nullopt);
  const Tracked with = track(barrel(), std::nullopt);
  const Tracked ignored = track(barrel(), true);
  std::printf("median error: %.2f mm without a lens, %.2f mm with one, %.2f mm where it is ignored\n",
              1e3 * without.score.median_position_error, 1e3 * with.score.median_position_error,
              1e3 * ignored.score.median_position_error);
  EXPECT_TRUE(with.degraded.empty());
  EXPECT_LT(with.score.median_position_error, without.score.median_position_error + 0.001);
  EXPECT_GT(ignored.score.median_position_error, 5.0 * with.score.median_position_error);
  // `inspect --depth-noise` measures the camera, not its lens.
  ASSERT_TRUE(without.depth_noise.ok()) << without.depth_noise.status().message();
  ASSERT_TRUE(with.depth_noise.ok()) << with.depth_noise.status().message();
  EXPECT_NEAR(with.depth_noise->sigma_over_time, without.depth_noise->sigma_over_time,
              0.2 * without.depth_noise->sigma_over_time);
}

}  // namespace
}  // namespace prescene::service::lens_test
