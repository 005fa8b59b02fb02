// SPDX-License-Identifier: Apache-2.0
// What still moves when the simulated time ends is said in the answer, if the outcomes may depend on it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/queries/query_engine.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "tests/support/simple_scenes.h"

namespace prescene::queries::motion_remarks_test {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;
using tests::Vector3d;

belief::Outcome stays(const std::string& object) {
  return {object + "_stays", object, {{belief::MovedMoreThan{10.0}, belief::When::kAtEnd, true}}};
}

/// A ball on a table 0.5 m high, that rolls for some 10 m, and one that lies there.
belief::Scene two_balls() {
  belief::Scene scene;
  scene.name = "balls";
  scene.supports.push_back(tests::floor_support());
  const belief::ObjectModel ball = tests::primitive_model("ball", geometry::Sphere{0.05});
  for (const char* name : {"rolling", "lying"}) {
    const auto i = static_cast<std::size_t>(tests::add_object(scene, ball, name));
    scene.models[i].name = std::string("ball_") + name;
    scene.objects[i].pose = belief::FixedPose{tests::Pose::from_translation({0.0, i == 0 ? 0.0 : 0.5, 0.05})};
  }
  scene.objects[0].twist.linear = {belief::FixedScalar{1.0}, belief::FixedScalar{0.0}, belief::FixedScalar{0.0}};
  scene.objects[0].twist.angular = {belief::FixedScalar{0.0}, belief::FixedScalar{20.0}, belief::FixedScalar{0.0}};
  scene.duration = 1.0;
  return scene;
}

class MotionRemarks : public testing::TestWithParam<const char*> {
 protected:
  /// Of the scene's own outcomes; to rest, or until they are decided.
  std::vector<std::string> remarks_on(const belief::Scene& scene, bool to_rest = true) {
    core::ThreadPool pool(1);
    simulation::ShapeStore shapes(simulation::hacd_decomposer());
    QueryContext context;
    context.pool = &pool;
    context.shapes = &shapes;
    context.make_simulator = [&](const belief::Scene& asked, double) {
      return GetParam() == std::string("bullet") ? simulation::make_bullet_simulator(asked, shapes)
                                                 : simulation::make_lockstep_simulator(asked, shapes);
    };
    belief::PredictQuery query;
    query.effort.exact_instances = 16;
    query.detail.final_poses = query.detail.typical_runs = to_rest;
    const belief::Answer answer = queries::answer(std::make_shared<belief::Scene>(scene), 1, {"", query}, context);
    EXPECT_TRUE(answer.error.ok()) << answer.error.message();
    return answer.error.ok() ? std::get<belief::PredictAnswer>(answer.what).remarks : std::vector<std::string>{};
  }
};

TEST_P(MotionRemarks, NameWhatMovesAtTheEndAndTheRemedy) {
  belief::Scene scene = two_balls();
  scene.outcomes = {stays("rolling")};
  const std::string remark =
      "In 100.0 % of the instances 'rolling' still moves when the 1 s that are simulated end: outcomes that are judged "
      "at the end may come out otherwise later. Give a longer 'duration'.";
  EXPECT_THAT(remarks_on(scene), Contains(remark));
  EXPECT_THAT(remarks_on(scene, false), Contains(remark));
  // Of a group, in which outcomes.
  scene.outcomes.clear();
  scene.exclusive_outcomes = {{"way", {stays("lying"), stays("rolling")}}};
  EXPECT_THAT(remarks_on(scene), Contains(HasSubstr("simulated end (way: lying_stays 100.0 %): outcomes")));
}

TEST_P(MotionRemarks, LeaveOutWhatTheOutcomesDoNotDependOn) {
  belief::Scene scene = two_balls();
  // Another object, something that is true once and for all, the motion itself, and nothing.
  for (const belief::Outcome& outcome :
       {stays("lying"), belief::Outcome{"touches", "rolling", {{belief::Touched{"lying"}}}},
        belief::Outcome{"rolls", "rolling", {{belief::StillMoving{}}}}}) {
    scene.outcomes = {outcome};
    EXPECT_THAT(remarks_on(scene), Each(Not(HasSubstr("still move")))) << outcome.name;
  }
  scene.outcomes.clear();
  EXPECT_THAT(remarks_on(scene), Each(Not(HasSubstr("still move"))));
}

TEST_P(MotionRemarks, LeaveOutWhatIsDecidedAlthoughItMoves) {
  // Off the table by then, it can't come up again, however long it rolls on the ground: nothing is there to lift it.
  belief::Scene scene = two_balls();
  scene.objects.pop_back();
  belief::Support& ground = scene.supports.emplace_back(tests::floor_support());
  ground.name = "ground";
  ground.X_WS = tests::Pose::from_translation({0.0, 0.0, -1.0});
  scene.supports[0].collision = {belief::PrimitiveShape{geometry::BoxShape{{1.0, 2.0, 0.1}}, {}}};
  scene.supports[0].X_WS = tests::Pose::from_translation({0.0, 0.0, -0.05});
  scene.duration = 3.0;
  scene.outcomes = {{"falls", "rolling", {{belief::BelowHeight{-0.2}}}}};
  EXPECT_THAT(remarks_on(scene), Each(Not(HasSubstr("still move"))));
  EXPECT_THAT(remarks_on(scene, false), Each(Not(HasSubstr("still move"))));
  // But it may be anywhere.
  scene.outcomes.push_back({"near", "rolling", {{belief::MovedMoreThan{4.0}, belief::When::kAtEnd, true}}});
  EXPECT_THAT(remarks_on(scene), Contains(HasSubstr("'rolling' still moves when the 3 s")));
}

TEST_P(MotionRemarks, AreAbsentWhereAllRests) {
  belief::Scene scene = two_balls();
  scene.objects[0].twist = {};
  scene.outcomes = {stays("rolling"), stays("lying")};
  EXPECT_THAT(remarks_on(scene), Each(Not(HasSubstr("still move"))));
  // That an instance is not stopped when it rests makes no difference.
  scene.stop_at_rest = false;
  EXPECT_THAT(remarks_on(scene), Each(Not(HasSubstr("still move"))));
}

INSTANTIATE_TEST_SUITE_P(, MotionRemarks, testing::Values("bullet", "lockstep"),
                         [](const auto& stepper) { return std::string(stepper.param); });

}  // namespace
}  // namespace prescene::queries::motion_remarks_test
