// SPDX-License-Identifier: Apache-2.0
// At rest means still and stable: what merely balances is not at rest, what stands, lies, leans or is stacked is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bullet_scenes.h"

namespace prescene::tests {
namespace {

using belief::TrajectoryEnd;
using geometry::BoxShape;
using geometry::Cone;
using geometry::Cylinder;
using geometry::Sphere;

belief::Trajectory run_from(const Scene& scene, const std::vector<Pose>& poses, double duration = 2.0) {
  WorldState start = start_of(scene);
  for (std::size_t i = 0; i < poses.size(); ++i) start.objects[i].X_WO = poses[i];
  simulation::RunRequest request;
  request.stop.duration = duration;
  return run_one(*simulator_of(scene), start, request);
}

TrajectoryEnd end_of(const geometry::Primitive& shape, const Pose& X_WO) {
  return run_from(floor_scene(primitive_model("thing", shape)), {X_WO}).end;
}

TEST(Rest, StandingAndLyingThingsAreAtRest) {
  const Quaterniond on_side = about(Vector3d::UnitX(), 0.5 * kPi);
  EXPECT_EQ(end_of(BoxShape{{0.1, 0.06, 0.04}}, Pose::from_translation({0, 0, 0.02})), TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(BoxShape{{0.1, 0.1, 0.003}}, Pose::from_translation({0, 0, 0.0015})), TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(Cylinder{0.03, 0.2}, Pose::from_translation({0, 0, 0.1})), TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(Cylinder{0.03, 0.2}, Pose{on_side, {0, 0, 0.03}}), TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(Sphere{0.05}, Pose::from_translation({0, 0, 0.05})), TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(Cone{0.03, 0.1}, Pose::from_translation({0, 0, 0.05})), TrajectoryEnd::kAtRest);
}

TEST(Rest, BoxBalancedOnAnEdgeIsNot) {
  const double half = 0.05;
  const Pose X_WO{about(Vector3d::UnitY(), 0.25 * kPi), {0, 0, half * std::sqrt(2.0) - 8e-5}};
  const belief::Trajectory run = run_from(floor_scene(primitive_model("box", BoxShape{{0.1, 0.1, 0.1}})), {X_WO}, 1.0);
  EXPECT_NE(run.end, TrajectoryEnd::kAtRest);
}

TEST(Rest, ConeOnItsTipIsNot) {
  const Pose X_WO{about(Vector3d::UnitX(), kPi), {0, 0, 0.05}};
  const belief::Trajectory run = run_from(floor_scene(primitive_model("cone", Cone{0.03, 0.1})), {X_WO}, 1.0);
  EXPECT_NE(run.end, TrajectoryEnd::kAtRest);
}

TEST(Rest, UprightCoinAndPencilAreNot) {
  const Quaterniond on_rim = about(Vector3d::UnitX(), 0.5 * kPi);
  // A disc of foil balances on its rim and a pencil on its point; a pencil on its flat end stands (it takes 2 degrees
  // to topple it).
  const belief::Trajectory coin =
      run_from(floor_scene(primitive_model("coin", Cylinder{0.012, 0.00015})), {Pose{on_rim, {0, 0, 0.012}}}, 0.5);
  EXPECT_NE(coin.end, TrajectoryEnd::kAtRest);
  ObjectModel pencil = model_of(
      "pencil", {belief::PrimitiveShape{Cylinder{0.0035, 0.16}, Pose::from_translation({0, 0, 0.02})},
                 belief::PrimitiveShape{Cone{0.0035, 0.02}, Pose{about(Vector3d::UnitX(), kPi), {0, 0, -0.07}}}});
  const belief::Trajectory tip = run_from(floor_scene(pencil), {Pose::from_translation({0, 0, 0.08})}, 1.0);
  EXPECT_NE(tip.end, TrajectoryEnd::kAtRest);
  const belief::Trajectory stub =
      run_from(floor_scene(primitive_model("stub", Cylinder{0.0035, 0.1})), {Pose::from_translation({0, 0, 0.05})});
  EXPECT_EQ(stub.end, TrajectoryEnd::kAtRest);
}

TEST(Rest, StackIsAtRestAndItsOverhangingTopIsNot) {
  Scene scene = floor_scene(primitive_model("lower", BoxShape{{0.1, 0.1, 0.1}}));
  add_object(scene, primitive_model("upper", BoxShape{{0.1, 0.1, 0.1}}), "upper");
  const Pose below = Pose::from_translation({0, 0, 0.05});
  EXPECT_EQ(run_from(scene, {below, Pose::from_translation({0.03, 0, 0.15})}).end, TrajectoryEnd::kAtRest);
  // Its centre of mass exactly above the edge (which is rounded by 0.2 mm).
  const belief::Trajectory overhang = run_from(scene, {below, Pose::from_translation({0.0497, 0, 0.15})}, 0.5);
  EXPECT_NE(overhang.end, TrajectoryEnd::kAtRest);
}

TEST(Rest, BookLeaningAgainstAWallIsAtRest) {
  ObjectModel book = primitive_model("book", BoxShape{{0.02, 0.15, 0.2}});
  book.contact.friction = belief::FixedScalar{0.6};
  Scene scene = floor_scene(book);
  scene.supports.push_back(support_of("wall", {belief::PrimitiveShape{BoxShape{{0.1, 1.0, 1.0}}, Pose{}}},
                                      Pose::from_translation({0.2, 0.0, 0.5})));
  const Quaterniond lean = about(Vector3d::UnitY(), 0.25);
  const Pose X_WO{lean, Vector3d(0.15, 0.0, 0.0) - (lean * Vector3d(0.01, 0.0, 0.1)) + Vector3d(0, 0, 0.2)};
  Pose X = X_WO;
  X.translation.z() = -(lean * Vector3d(0.01, 0.0, -0.1)).z();
  EXPECT_EQ(run_from(scene, {X}).end, TrajectoryEnd::kAtRest);
}

TEST(Rest, TossAtItsHighestPointIsNot) {
  Scene scene = floor_scene(primitive_model("ball", Sphere{0.05}));
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0, 0, 1.0};
  simulation::RunRequest request;
  request.stop.duration = 3.0;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  EXPECT_EQ(run.end, TrajectoryEnd::kAtRest);
  EXPECT_GT(run.simulated_seconds, std::sqrt(2.0 * 0.95 / kG) + 0.19);
  EXPECT_NEAR(run.final().objects[0].X_WO.translation.z(), 0.05, 1e-4);
  EXPECT_THAT(run.final_contacts, testing::ElementsAre(std::pair<int, int>(0, 1)));
}

TEST(Rest, WaitsForActionsToCome) {
  Scene scene = floor_scene(primitive_model("ball", Sphere{0.05}));
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0, 0, 0.05};
  simulation::RunRequest request;
  belief::Push push;
  push.from = {-0.2, 0.0, 0.05};
  push.to = {0.2, 0.0, 0.05};
  request.actions.push_back({1.0, push});
  request.stop.duration = 1.5;
  const belief::Trajectory run = run_one(*simulator_of(scene), start, request);
  EXPECT_GT(run.final().objects[0].X_WO.translation.x(), 0.05);
}

}  // namespace
}  // namespace prescene::tests
