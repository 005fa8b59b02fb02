// SPDX-License-Identifier: Apache-2.0
// A table with things that the scene does not name: with new_objects they get a shape about their points and are
// tracked; an empty table has none.
#include <gtest/gtest.h>

#include <cstdio>

#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/simulated_recording.h"
#include "tests/support/paths.h"

namespace prescene::service::new_objects_test {
namespace {

using belief::TrackState;
using geometry::Vector3d;

constexpr const char* kTable =
    "supports:\n  table: {box: [1.0, 0.8, 0.04], pose: {position: [0, 0, -0.02]}, friction: 0.8}\n";
constexpr const char* kCamera =
    "camera: {width: 320, height: 240, fov_deg: 55, look: {from: [0.15, -0.65, 0.55], at: [0, 0, 0.04]}}\n";
const Vector3d kBlock(-0.12, 0.02, 0.055), kBlockSize(0.09, 0.06, 0.11);
const Vector3d kCan(0.12, 0.03, 0.055);

std::string world(double duration) {
  return "name: two_things\nduration: " + std::to_string(duration) + R"(
models:
  block: {box: [0.09, 0.06, 0.11], mass: 0.3, color: '#3060c0'}
  can: {cylinder: {radius: 0.035, length: 0.11}, mass: 0.3, color: '#c03020'}
objects:
  block: {model: block, pose: {position: [-0.12, 0.02, 0.055], rotation: {euler_deg: [0, 0, 25]}}}
  can: {model: can, pose: {position: [0.12, 0.03, 0.055]}}
)" + kTable +
         kCamera;
}

class NewObjects : public ::testing::Test {
 protected:
  /// Tracks `yaml` (with `settings`) on what a camera sees of `world_yaml`; `on_step` after each frame.
  std::shared_ptr<const belief::Belief> track(const std::string& world_yaml,
                                              const std::vector<UnannouncedChange>& changes, const std::string& yaml,
                                              const TrackerSettings& settings = {}, const StepSink& on_step = {}) {
    const auto path = folder_.path() / ("run" + std::to_string(++runs_) + ".mcap");
    const auto played = load_scene_text(world_yaml, "world.yaml", {});
    EXPECT_TRUE(played.ok()) << played.status().message();
    SimulatedRecordingOptions options;
    options.rate = 15.0;
    options.changes = changes;
    auto recording = RecordingWriter::create(path, {"world.yaml", world_yaml, 1, ""});
    EXPECT_TRUE(recording.ok()) << recording.status().message();
    EXPECT_TRUE(simulate_recording(**played, options, 1, backends_, {}, {}, **recording).ok());
    EXPECT_TRUE((*recording)->close().ok());
    const auto scene = load_scene_text(yaml, "scene.yaml", {});
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    const auto tracker = Tracker::create(*scene, settings, 1, backends_);
    EXPECT_TRUE(tracker.ok()) << tracker.status().message();
    const auto summary = replay_recording(path, {}, **tracker, {}, {}, on_step, {});
    EXPECT_TRUE(summary.ok()) << summary.status().message();
    return (*tracker)->belief();
  }
  /// The new object whose middle is within 2 cm of there, in state tracked; null = none.
  static const belief::ObjectBelief* tracked_at(const belief::Belief& belief, const Vector3d& p_W) {
    for (const belief::ObjectBelief& object : belief.objects) {
      const double off = (belief::estimate(belief, object).mean.translation - p_W).norm();
      if (off < 0.02 && object.state == TrackState::kTracked && filter::is_unknown_object(object.name)) return &object;
    }
    return nullptr;
  }
  static Vector3d size_of(const belief::Belief& belief, const belief::ObjectBelief& object) {
    return geometry::bounding_box(belief::collision_mesh(belief::model_of(belief, object))).sizes();
  }

  const tests::ScratchDir folder_;
  int runs_ = 0;
  core::ThreadPool pool_{2};
  Backends backends_{pool_};
};

TEST_F(NewObjects, TwoThingsOnATableAreTrackedAtOnce) {
  std::size_t after_first = 0;
  const StepSink on_step = [&](const TrackerStep& step, const Tracker& at) {
    if (step.record.step == 1) after_first = at.belief()->objects.size();
    return core::ok_status();
  };
  for (const bool listed : {true, false}) {
    SCOPED_TRACE(listed ? "the table is listed" : "the table is found");
    const std::string scene = std::string("new_objects: true\n") + (listed ? kTable : "") + kCamera;
    const auto belief = track(world(0.8), {}, scene, {}, on_step);
    EXPECT_EQ(after_first, 2u);
    ASSERT_EQ(belief->objects.size(), 2u);
    const belief::ObjectBelief* block = tracked_at(*belief, kBlock);
    const belief::ObjectBelief* can = tracked_at(*belief, kCan);
    ASSERT_NE(block, nullptr);
    ASSERT_NE(can, nullptr);
    Vector3d size = size_of(*belief, *block);
    std::printf("compared: a box of 90 x 60 x 110 mm, taken for %.0f x %.0f x %.0f mm\n", 1e3 * size.x(),
                1e3 * size.y(), 1e3 * size.z());
    if (size.x() < size.y()) std::swap(size.x(), size.y());
    EXPECT_LT((size - kBlockSize).cwiseAbs().maxCoeff(), 0.02);
    size = size_of(*belief, *can);
    std::printf("compared: a can of 70 x 110 mm, taken for %.0f x %.0f x %.0f mm\n", 1e3 * size.x(), 1e3 * size.y(),
                1e3 * size.z());
    EXPECT_LT((size - Vector3d(0.07, 0.07, 0.11)).cwiseAbs().maxCoeff(), 0.02);
    EXPECT_TRUE(belief::validate(*belief->scene).ok()) << belief::validate(*belief->scene).message();
  }
}

TEST_F(NewObjects, AreNoneOnAnEmptyTable) {
  std::size_t most = 0;
  const StepSink on_step = [&](const TrackerStep&, const Tracker& at) {
    most = std::max(most, at.belief()->objects.size());
    return core::ok_status();
  };
  const std::vector<UnannouncedChange> empty = {{0.0, "block", std::nullopt}, {0.0, "can", std::nullopt}};
  for (const char* table : {kTable, ""})
    track(world(1.5), empty, std::string("new_objects: true\n") + table + kCamera, {}, on_step);
  EXPECT_EQ(most, 0u);
}

TEST_F(NewObjects, AreLookedForOnlyWhereSomebodyAsks) {
  const std::string asks = std::string("new_objects: true\n") + kTable + kCamera;
  const std::string silent = std::string("objects: {}\n") + kTable + kCamera;
  EXPECT_EQ(track(world(0.2), {}, silent)->objects.size(), 0u);
  TrackerSettings settings;
  settings.new_objects = false;
  EXPECT_EQ(track(world(0.2), {}, asks, settings)->objects.size(), 0u) << "the option takes precedence";
  settings.new_objects = true;
  EXPECT_EQ(track(world(0.2), {}, silent, settings)->objects.size(), 2u);
}

TEST_F(NewObjects, ThatAreTakenAwayAreForgotten) {
  const std::string scene = std::string("new_objects: true\n") + kTable + kCamera;
  int forgotten = 0;
  const StepSink on_step = [&](const TrackerStep& step, const Tracker&) {
    forgotten += step.counters.forgotten_objects;
    return core::ok_status();
  };
  const auto belief = track(world(5.0), {{0.4, "block", std::nullopt}}, scene, {}, on_step);
  EXPECT_GE(forgotten, 1);
  EXPECT_NE(tracked_at(*belief, kCan), nullptr);
  EXPECT_EQ(tracked_at(*belief, kBlock), nullptr);
  EXPECT_EQ(belief->scene->objects.size(), belief->objects.size());
}

}  // namespace
}  // namespace prescene::service::new_objects_test
