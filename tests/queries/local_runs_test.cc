// SPDX-License-Identifier: Apache-2.0
// A push among things that lie still: simulated without those that nothing comes near, it moves what it moves among
// them, and what it does come near is there.
#include "prescene/queries/local_runs.h"

#include <gtest/gtest.h>

#include "prescene/belief/body_names.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/own_actions.h"
#include "tests/queries/sliding_scene.h"

namespace prescene::queries::local_runs_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;

/// Three boxes of 6 cm in a row along x, 15 cm from one to the next, the last with another on top.
belief::Scene row_of_boxes() {
  belief::Scene scene;
  scene.name = "row";
  scene.models = {tests::box_model("box", {0.06, 0.06, 0.06})};
  belief::Support table;
  table.name = "table";
  table.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{2.0, 2.0, 0.1}}, {}});
  table.X_WS = Pose::from_translation({0.0, 0.0, -0.05});
  scene.supports.push_back(table);
  for (const Vector3d& p :
       {Vector3d(0.0, 0.0, 0.03), Vector3d(0.15, 0.0, 0.03), Vector3d(0.3, 0.0, 0.03), Vector3d(0.3, 0.0, 0.09)}) {
    belief::SceneObject object;
    object.name = "box_" + std::to_string(scene.objects.size());
    object.pose = belief::FixedPose{Pose::from_translation(p)};
    scene.objects.push_back(object);
  }
  return scene;
}

std::vector<belief::Action> push_along_x(double from, double length) {
  belief::Push push;
  push.from = {from, 0.0, 0.03};
  push.to = {from + length, 0.0, 0.03};
  push.duration = 0.5;
  return {{0.0, push}};
}

class LocalRunsOfARow : public testing::Test {
 protected:
  void SetUp() override {
    const auto make = [&](const belief::Scene& of, double) {
      made_.push_back(of.objects.size());
      return simulation::make_bullet_simulator(of, shapes_);
    };
    factory_ = make;
    whole_ = *factory_(scene_, 1.0);
    for (const belief::SceneObject& object : scene_.objects)
      meshes_.push_back(belief::collision_mesh(scene_.model_of(object)));
    start_ = belief::mean_start(scene_);
    for (belief::ObjectState& object : start_.objects) object.mode = belief::MotionMode::kResting;
    request_.stop.duration = 1.0;
    request_.sample_interval = 1.0 / 60.0;
  }
  std::vector<belief::Trajectory> reference(const std::vector<std::vector<belief::Action>>& actions) {
    const std::vector<belief::WorldState> starts(actions.size(), start_);
    std::vector<belief::Trajectory> runs(actions.size());
    simulation::run_own_actions(*whole_, starts, actions, request_, stream_, 0, pool_, runs);
    return runs;
  }
  std::vector<belief::Trajectory> local(std::size_t object, const std::vector<std::vector<belief::Action>>& actions) {
    const std::vector<belief::WorldState> starts(actions.size(), start_);
    std::vector<belief::Trajectory> runs(actions.size());
    LocalRuns locals(scene_, meshes_, start_, *whole_, factory_);
    const auto count = locals.run(object, {starts, actions, &request_, stream_, &pool_, nullptr}, runs);
    EXPECT_TRUE(count.ok());
    simulated_ = count.ok() ? *count : 0;
    return runs;
  }

  belief::Scene scene_ = row_of_boxes();
  simulation::ShapeStore shapes_;
  std::vector<std::size_t> made_;  // objects of the simulators that were made
  simulation::SimulatorFactory factory_;
  std::unique_ptr<simulation::Simulator> whole_;
  std::vector<geometry::TriangleMesh> meshes_;
  belief::WorldState start_;
  simulation::RunRequest request_;
  core::RandomStream stream_{1, core::Purpose::kTest};
  core::ThreadPool pool_{2};
  int simulated_ = 0;
};

TEST_F(LocalRunsOfARow, MoveWhatIsPushedAsAmongAllOthers) {
  const std::vector<std::vector<belief::Action>> actions = {push_along_x(-0.08, 0.07), push_along_x(-0.08, 0.09)};
  const auto expected = reference(actions), runs = local(0, actions);
  EXPECT_EQ(simulated_, 2);
  EXPECT_EQ(made_.back(), 1U);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const belief::WorldState &end = runs[i].final(), &other = expected[i].final();
    ASSERT_EQ(end.objects.size(), 4U);
    EXPECT_GT((end.objects[0].X_WO.translation - start_.objects[0].X_WO.translation).x(), 0.02);
    EXPECT_LT((end.objects[0].X_WO.translation - other.objects[0].X_WO.translation).norm(), 5e-4);
    for (std::size_t k = 1; k < 4; ++k) EXPECT_EQ(end.objects[k].X_WO, start_.objects[k].X_WO);
    // Numbered as in the whole scene, whose table is body 4.
    const auto on_table = std::count(runs[i].final_contacts.begin(), runs[i].final_contacts.end(), std::pair(0, 4));
    EXPECT_EQ(on_table, 1);
  }
}

TEST_F(LocalRunsOfARow, AreRunAgainWithWhatTheyComeNear) {
  // Nothing, the next box, and the stack behind it, too.
  const std::vector<std::vector<belief::Action>> actions = {push_along_x(-0.08, 0.07), push_along_x(-0.08, 0.15),
                                                            push_along_x(-0.08, 0.3)};
  const auto expected = reference(actions), runs = local(0, actions);
  EXPECT_EQ(simulated_, 1 + 2 + 2);
  EXPECT_EQ(made_, (std::vector<std::size_t>{4, 1, 2}));
  const auto moved = [&](const belief::Trajectory& run, std::size_t object) {
    return (run.final().objects[object].X_WO.translation - start_.objects[object].X_WO.translation).norm();
  };
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_LT((runs[i].final().objects[k].X_WO.translation - expected[i].final().objects[k].X_WO.translation).norm(),
                k <= 2 ? 2e-3 : 5e-3)
          << i << " " << k;
  EXPECT_GT(moved(runs[1], 1), 0.02);
  EXPECT_EQ(moved(runs[1], 2), 0.0);
  EXPECT_GT(moved(runs[2], 2), 0.02);
  // With everything, it is what it is among all others.
  EXPECT_TRUE(runs[2] == expected[2]);
}

TEST_F(LocalRunsOfARow, KeepWhatStandsOnTheObject) {
  local(2, {push_along_x(0.36, 0.01)});
  EXPECT_EQ(made_.back(), 2U);
}

}  // namespace
}  // namespace prescene::queries::local_runs_test
