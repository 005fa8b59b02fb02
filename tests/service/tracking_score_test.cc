// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/tracking_score.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "prescene/geometry/primitives.h"

namespace prescene::service {
namespace {

using geometry::Pose;

std::shared_ptr<const belief::Scene> scene_with(const geometry::SymmetryGroup& symmetry) {
  auto scene = std::make_shared<belief::Scene>();
  belief::ObjectModel model;
  model.name = "can";
  model.symmetry = symmetry;
  scene->models = {model};
  belief::SceneObject object;
  object.name = "can_1";
  scene->objects = {object};
  return scene;
}

BeliefSummary believed(core::TimeNs stamp_ns, const Pose& X_WO,
                       belief::TrackState state = belief::TrackState::kTracked) {
  ObjectSummary object;
  object.name = "can_1";
  object.model = "can";
  object.state = state;
  object.X_WO = X_WO;
  return {1, stamp_ns, {object}};
}

TruthRecord truth(core::TimeNs stamp_ns, const Pose& X_WO, double visible_share = 1.0) {
  return {stamp_ns, {{"can_1", X_WO, visible_share}}};
}

TEST(TrackingScore, ComparesFramesOfEqualStampOnly) {
  TrackingScore score(scene_with({}));
  score.add(truth(10, Pose::identity()));
  score.add(truth(20, Pose::identity()));
  score.add(truth(30, Pose::identity()));
  score.add(believed(10, Pose::from_translation({0.002, 0.0, 0.0})));
  score.add(believed(20, Pose::from_translation({0.0, 0.004, 0.0})));
  score.add(believed(31, Pose::from_translation({1.0, 0.0, 0.0})));
  const auto rows = score.rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].frames, 2);
  EXPECT_NEAR(rows[0].p90_position_error, 0.004, 1e-12);
  EXPECT_EQ(rows[0].share_tracked, 1.0);
  EXPECT_EQ(rows[0].share_confidently_wrong, 0.0);
}

TEST(TrackingScore, HiddenFramesCountForBeingConfidentlyWrongOnly) {
  TrackingScore score(scene_with({}));
  score.add(truth(10, Pose::identity(), 0.1));
  score.add(believed(10, Pose::from_translation({0.3, 0.0, 0.0})));
  score.add(truth(20, Pose::identity(), 0.0));
  score.add(believed(20, Pose::from_translation({0.3, 0.0, 0.0}), belief::TrackState::kUnseen));
  const auto rows = score.rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].visible_frames, 0);
  EXPECT_DOUBLE_EQ(rows[0].share_confidently_wrong, 0.5);
}

TEST(TrackingScore, ATurnAboutTheAxisOfACanIsNoError) {
  const Pose turned{geometry::exp_rotation({0.0, 0.0, 2.0}), {0.0, 0.0, 0.0}};
  TrackingScore can(scene_with(geometry::SymmetryGroup::continuous({0.0, 0.0, 1.0}, false)));
  can.add(truth(10, Pose::identity()));
  can.add(believed(10, turned));
  EXPECT_NEAR(can.rows()[0].median_turn_error, 0.0, 1e-6);
  TrackingScore box(scene_with({}));
  box.add(truth(10, Pose::identity()));
  box.add(believed(10, turned));
  EXPECT_NEAR(box.rows()[0].median_turn_error, 2.0, 1e-9);
}

TEST(BeliefSummary, ReadsBackWhatWasWritten) {
  BeliefSummary summary =
      believed(42, {geometry::exp_rotation({0.1, -0.2, 0.3}), {0.4, 0.5, -0.6}}, belief::TrackState::kDoubtful);
  summary.objects[0].confidence = 0.75;
  summary.objects[0].covariance(1, 4) = -2.5e-5;
  const auto read = belief_summary_from_json(to_json(summary).dump());
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->objects.size(), 1u);
  EXPECT_EQ(read->stamp_ns, 42);
  EXPECT_EQ(read->objects[0].name, "can_1");
  EXPECT_EQ(read->objects[0].state, belief::TrackState::kDoubtful);
  EXPECT_DOUBLE_EQ(read->objects[0].confidence, 0.75);
  EXPECT_DOUBLE_EQ(read->objects[0].covariance(1, 4), -2.5e-5);
  EXPECT_LT((read->objects[0].X_WO.translation - summary.objects[0].X_WO.translation).norm(), 1e-15);
  EXPECT_LT(geometry::angle_between(read->objects[0].X_WO.rotation, summary.objects[0].X_WO.rotation), 1e-7);
}

TEST(BeliefSummary, StampsThatNoClockGivesAreRefused) {
  const auto with = [](const std::string& step, const std::string& stamp_ns) {
    return belief_summary_from_json("{\"step\": " + step + ", \"stamp_ns\": " + stamp_ns + ", \"objects\": []}");
  };
  const auto latest = static_cast<std::uint64_t>(std::numeric_limits<core::TimeNs>::max() / 2);
  EXPECT_TRUE(with("0", "0").ok());
  ASSERT_TRUE(with("7", std::to_string(latest)).ok());
  EXPECT_EQ(with("7", std::to_string(latest))->stamp_ns, static_cast<core::TimeNs>(latest));
  for (const std::string& stamp : {std::to_string(latest + 1), std::string("-1"), std::string("18446744073709551615"),
                                   std::string("9223372036854775807"), std::string("-9223372036854775808")}) {
    const auto read = with("7", stamp);
    ASSERT_FALSE(read.ok()) << stamp;
    EXPECT_NE(read.status().message().find("set the clock"), std::string::npos) << read.status().message();
  }
  for (const char* step : {"-1", "18446744073709551615"}) EXPECT_FALSE(with(step, "2").ok()) << step;
}

TEST(BeliefSummary, StrangersTextIsRefused) {
  for (const char* text : {"", "{}", "[]", R"({"step": 1})", R"({"step": 1, "stamp_ns": 2, "objects": [{}]})",
                           R"({"step": 1, "stamp_ns": 2, "objects": [{"name": "a", "state": "dancing", "pose": {}}]})",
                           R"({"step": 1, "stamp_ns": 2, "objects": [{"name": "a", "state": "lost", "pose": 3}]})"}) {
    EXPECT_FALSE(belief_summary_from_json(text).ok()) << text;
  }
}

}  // namespace
}  // namespace prescene::service
