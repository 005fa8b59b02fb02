// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/tracking_suite.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/service/evaluate/carried_cube.h"
#include "prescene/service/evaluate/suite_scenes.h"
#include "prescene/service/evaluate/tracking_counter.h"
#include "prescene/service/load_scene.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

using belief::TrackState;
using geometry::Pose;

class SuiteScenes : public testing::TestWithParam<std::string> {};

TEST_P(SuiteScenes, AreValidAndKnowOnlyWhatTheyAreTold) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const SuiteScene made = make_suite_scene(GetParam(), seed);
    std::string warnings;
    const core::LogSink log = [&](core::LogLevel, const std::string& text) { warnings += text + "\n"; };
    const auto world = load_scene_text(made.world, "world.yaml", log);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto known = load_scene_text(made.known, "known.yaml", log);
    ASSERT_TRUE(known.ok()) << known.status().message();
    EXPECT_EQ(warnings, "") << made.world;
    EXPECT_EQ((*world)->objects.size(), (*known)->objects.size());
    EXPECT_EQ(made.reports_robot, (*known)->robot == (*world)->robot && (*known)->actions == (*world)->actions);
    for (const UnannouncedChange& change : made.changes) EXPECT_TRUE(belief::find_object(**world, change.object));
  }
}

TEST_P(SuiteScenes, DifferFromSeedToSeedAndAreTheSameForOne) {
  EXPECT_EQ(make_suite_scene(GetParam(), 7).world, make_suite_scene(GetParam(), 7).world);
  EXPECT_NE(make_suite_scene(GetParam(), 7).world, make_suite_scene(GetParam(), 8).world);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SuiteScenes, testing::ValuesIn(suite_kinds()),
                         [](const auto& tested) { return tested.param; });

std::shared_ptr<const belief::Scene> scene_with_can() {
  auto scene = std::make_shared<belief::Scene>();
  belief::ObjectModel model;
  model.name = "can";
  scene->models = {model};
  belief::SceneObject object;
  object.name = "can";
  scene->objects = {object};
  return scene;
}

BeliefSummary believed(core::TimeNs stamp_ns, const Pose& X_WO, double confidence,
                       TrackState state = TrackState::kTracked) {
  ObjectSummary object;
  object.name = object.model = "can";
  object.state = state;
  object.confidence = confidence;
  object.X_WO = X_WO;
  object.covariance = 1e-4 * geometry::Matrix6d::Identity();  // 1 cm
  return {1, stamp_ns, {object}};
}

Pose shifted(double x) { return Pose::from_translation({x, 0.0, 0.0}); }

TEST(TrackingCounter, CountsRightAndWrongVisibleAndHidden) {
  TrackingCounter counter(scene_with_can());
  counter.add(TruthRecord{1, {{"can", Pose::identity(), 1.0}}});
  counter.add(believed(1, shifted(0.005), 1.0));  // right
  counter.add(TruthRecord{2, {{"can", Pose::identity(), 1.0}}});
  counter.add(believed(2, shifted(0.03), 0.95));  // wrong
  counter.add(TruthRecord{3, {{"can", Pose::identity(), 0.05}}});
  counter.add(believed(3, shifted(0.015), 0.3, TrackState::kUnseen));  // hidden, region holds it: 1.5 sigma
  counter.add(TruthRecord{4, {{"can", Pose::identity(), 0.05}}});
  counter.add(believed(4, shifted(0.04), 0.3, TrackState::kUnseen));  // 4 sigma
  counter.add(TruthRecord{5, {{"can", {}, 0.0, false}}});
  counter.add(believed(5, shifted(0.0), 0.995));  // not there at all
  counter.add(believed(6, shifted(0.0), 1.0));    // no truth of this stamp
  Pose turned;
  turned.rotation = geometry::exp_rotation({0.0, 0.0, 0.5});
  counter.add(TruthRecord{7, {{"can", Pose::identity(), 1.0}}});
  counter.add(believed(7, turned, 0.5));
  const TrackingFigures f = counter.figures();
  EXPECT_EQ(f.frames, 6);
  EXPECT_EQ(f.visible, 3);
  EXPECT_EQ(f.tracked, 3);
  EXPECT_EQ(f.believed, 4);
  EXPECT_EQ(f.wrong, 3);
  EXPECT_EQ(f.surely_wrong, 2);
  EXPECT_EQ(f.hidden, 2);
  EXPECT_EQ(f.hidden_covered, 1);
  EXPECT_EQ(f.sure, 2);
  EXPECT_EQ(f.sure_right, 1);
  EXPECT_EQ(f.by_confidence[9], 3);
  EXPECT_EQ(f.right_by_confidence[9], 1);
}

TEST(TrackingCounter, MotionOfAStillObjectIsThatBetweenFramesOnly) {
  TrackingCounter counter(scene_with_can());
  for (int i = 0; i < 4; ++i) {
    counter.add(TruthRecord{i, {{"can", shifted(i < 2 ? 0.0 : 0.1), 1.0}}});
    counter.add(believed(i, shifted((i < 2 ? 0.0 : 0.1) + 0.001 * i), 1.0));
  }
  const TrackingFigures f = counter.figures();
  ASSERT_EQ(f.still_shifts.size(), 2u);  // not where it was moved
  for (const double shift : f.still_shifts) EXPECT_NEAR(shift, 0.001, 1e-12);
}

TEST(TrackingSuite, TracksASequenceOfEachKindThatIsAskedFor) {
  core::ThreadPool pool(1);
  TrackingOptions options;
  options.sequences = 1;
  options.rate = 10.0;
  options.kinds = {"taken_away"};
  const auto report = evaluate_tracking({}, options, 3, pool, {}, nullptr);
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_EQ(report->rows.size(), 1u);
  EXPECT_EQ(report->rows[0].kind, "taken_away");
  EXPECT_EQ(report->simulated.sequences, 1);
  EXPECT_GE(report->simulated.frames, 24);
  EXPECT_GT(report->simulated.visible, report->simulated.frames);  // two of the three objects stay
  const auto json = to_json(*report);
  EXPECT_FALSE(json["simulated"]["share_tracked"].is_null());
  EXPECT_EQ(json["seed"], 3);
  EXPECT_EQ(json["rate"], 10.0);
}

TEST(TrackingSuite, NamesTheKindsThatThereAre) {
  core::ThreadPool pool(1);
  TrackingOptions options;
  options.kinds = {"juggling"};
  const core::Status status = evaluate_tracking({}, options, 3, pool, {}, nullptr).status();
  EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput);
  for (const std::string& kind : suite_kinds()) EXPECT_NE(status.message().find(kind), std::string::npos) << kind;
}

TEST(TrackingSuite, RecordedDataThatAreNotThereAreAnErrorBeforeAnythingIsSimulated) {
  core::ThreadPool pool(1);
  TrackingOptions options;
  options.sequences = 1000;  // what would take a day
  bool begun = false;
  const core::ProgressSink progress = [&begun](const core::Progress&) { begun = true; };
  const core::Status absent = evaluate_tracking("/nowhere", options, 1, pool, progress, nullptr).status();
  EXPECT_FALSE(absent.ok());
  EXPECT_NE(absent.message().find("/nowhere/carried_cube/truth.csv"), std::string::npos) << absent.message();
  options.kinds = {"taken_away", kCarriedCube};
  const core::Status unnamed = evaluate_tracking({}, options, 1, pool, progress, nullptr).status();
  EXPECT_EQ(unnamed.code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(unnamed.message().find("--data"), std::string::npos) << unnamed.message();
  EXPECT_FALSE(begun);
}

TEST(TrackingSuite, KeptRecordingsAreUsedAgainOnlyWhereTheyAreWholeAndOfTheSameRate) {
  core::ThreadPool pool(1);
  const prescene::tests::ScratchDir folder;
  TrackingOptions options;
  options.sequences = 1;
  options.kinds = {"taken_away"};
  const auto frames_at = [&](double rate, const std::filesystem::path& keep) {
    options.rate = rate;
    options.keep = keep;
    const auto report = evaluate_tracking({}, options, 3, pool, {}, nullptr);
    return report ? report->simulated.frames : -1;
  };
  const int slow = frames_at(2.0, {}), fast = frames_at(4.0, {});
  ASSERT_GT(fast, slow);
  const std::filesystem::path recording = folder.path() / "taken_away_3.mcap";
  EXPECT_EQ(frames_at(2.0, folder.path()), slow);
  const auto written = std::filesystem::last_write_time(recording);
  EXPECT_EQ(frames_at(2.0, folder.path()), slow);
  EXPECT_EQ(std::filesystem::last_write_time(recording), written) << "used again";
  EXPECT_EQ(frames_at(4.0, folder.path()), fast) << "not those of the slower recording";
  // What a stop leaves is no recording.
  core::Cancellation stopped;
  stopped.request();
  std::filesystem::remove(recording);
  EXPECT_EQ(evaluate_tracking({}, options, 3, pool, {}, &stopped).status().code(), core::StatusCode::kCancelled);
  EXPECT_FALSE(std::filesystem::exists(recording));
  EXPECT_EQ(frames_at(4.0, folder.path()), fast);
}

TEST(TrackingSuite, ACubeInAHandOfNoModelIsTrackedOrHonestlyNot) {
  const auto data = prescene::tests::data_dir("carried_cube");
  if (!data) GTEST_SKIP() << prescene::tests::missing_data_message(kCarriedCube);
  core::ThreadPool pool(1);
  TrackingOptions options;
  options.sequences = 2;
  options.kinds = {kCarriedCube};
  const auto report = evaluate_tracking(data->parent_path(), options, 1, pool, {}, nullptr);
  ASSERT_TRUE(report.ok()) << report.status().message();
  const TrackingFigures& f = report->rows.back().figures;
  EXPECT_EQ(f.frames, 102);
  EXPECT_GE(f.tracked, 0.9 * f.visible);
  EXPECT_LE(f.wrong, 2);
}

}  // namespace
}  // namespace prescene::service
