// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/robot_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace prescene::belief {
namespace {

Scene scene_with_hand() {
  Scene scene;
  KinematicBody hand;
  hand.name = "hand";
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 1.0})}, {2.0, Pose::from_translation({2.0, 0.0, 1.0})}};
  scene.robot = {hand};
  SceneObject cup;
  cup.name = "cup";
  cup.pose = FixedPose{Pose::from_translation({0.0, 0.0, 0.9})};
  cup.held_by = "hand";
  scene.objects = {cup};
  return scene;
}

TEST(RobotMotion, FollowsTheTimelineWithoutActions) {
  const Scene scene = scene_with_hand();
  EXPECT_NEAR(robot_pose_at(scene, {}, 0, 0.5).translation.x(), 0.5, 1e-12);
  EXPECT_NEAR(robot_pose_at(scene, {}, 0, 9.0).translation.x(), 2.0, 1e-12);
}

TEST(RobotMotion, BacksOffAfterLettingGo) {
  const Scene scene = scene_with_hand();
  Release release;
  release.object = "cup";
  release.retreat = {0.0, 0.0, 0.4};
  release.retreat_duration = 0.5;
  const std::vector<Action> actions = {{1.0, release}};
  EXPECT_NEAR(robot_pose_at(scene, actions, 0, 0.99).translation.z(), 1.0, 1e-12);
  EXPECT_NEAR(robot_pose_at(scene, actions, 0, 1.25).translation.z(), 1.2, 1e-12);
  EXPECT_NEAR(robot_pose_at(scene, actions, 0, 3.0).translation.z(), 1.4, 1e-12);
}

TEST(RobotMotion, CarriesWhatItPlacesToItsGoal) {
  const Scene scene = scene_with_hand();
  Place place;
  place.object = "cup";
  place.X_WO = FixedPose{Pose::from_translation({0.0, 1.0, 0.3})};
  place.duration = 1.0;
  const std::vector<Action> actions = {{1.0, place}};
  // The hand stays 0.1 m above the cup.
  const Pose half_way = robot_pose_at(scene, actions, 0, 1.5);
  EXPECT_NEAR(half_way.translation.x(), 0.5, 1e-12);
  EXPECT_NEAR(half_way.translation.y(), 0.5, 1e-12);
  EXPECT_NEAR(half_way.translation.z(), 0.7, 1e-12);
  EXPECT_NEAR(robot_pose_at(scene, actions, 0, 5.0).translation.z(), 0.4, 1e-12);
}

TEST(RobotMotion, ActionsOnWhatIsNotHeldDoNotMoveIt) {
  Scene scene = scene_with_hand();
  scene.objects[0].held_by.reset();
  Release release;
  release.object = "cup";
  release.retreat = {0.0, 0.0, 0.4};
  EXPECT_NEAR(robot_pose_at(scene, std::vector<Action>{{0.0, release}}, 0, 1.0).translation.z(), 1.0, 1e-12);
}

TEST(RobotMotion, TurnsWithWhatItTiltsAndGoesAlongWithWhatItInserts) {
  Scene scene = scene_with_hand();
  scene.robot[0].timeline.resize(1);
  Tilt tilt;
  tilt.object = "cup";
  tilt.axis_W = Vector3d::UnitY();
  tilt.angle = std::acos(0.0);
  tilt.duration = 1.0;
  // The hand is 0.1 m above the cup, about whose origin it turns to its side.
  const Pose turned = robot_pose_at(scene, std::vector<Action>{{0.5, tilt}}, 0, 2.0);
  EXPECT_LT((turned.translation - Vector3d(0.1, 0.0, 0.9)).norm(), 1e-12);
  Insert insert;
  insert.object = "cup";
  insert.distance = 0.2;
  const std::vector<Action> inserted = {{0.5, insert}};
  EXPECT_NEAR(robot_pose_at(scene, inserted, 0, 0.9).translation.z(), 0.9, 1e-12);  // half of the first four fifths
  EXPECT_NEAR(robot_pose_at(scene, inserted, 0, 1.4).translation.z(), 0.8, 1e-12);
}

Action transport_to(double time, const Vector3d& p_WO) {
  Transport transport;
  transport.object = "cup";
  transport.X_WO = FixedPose{Pose::from_translation(p_WO)};
  transport.duration = 0.5;
  return {time, transport};
}

Action release_at(double time) {
  Release release;
  release.object = "cup";
  release.retreat = {0.0, 0.1, 0.2};
  return {time, release};
}

// Grasped at the start is held from the start, whatever is done then.
TEST(RobotMotion, GoesWithWhatItGraspedAsWithWhatItHeld) {
  Scene holding = scene_with_hand();
  Scene grasping = holding;
  grasping.objects[0].held_by.reset();
  Tilt tilt;
  tilt.object = "cup";
  tilt.axis_W = Vector3d::UnitX();
  tilt.angle = 0.7;
  const std::vector<Action> actions = {
      transport_to(0.4, {0.3, 0.2, 0.8}), {1.0, tilt}, transport_to(2.2, {-0.4, 0.1, 1.2}), release_at(3.0)};
  std::vector<Action> with_grasp = actions;
  with_grasp.insert(with_grasp.begin(), {0.0, Grasp{"cup", "hand", {}}});
  for (double time = 0.0; time < 4.0; time += 0.05) {
    const Pose held = robot_pose_at(holding, actions, 0, time);
    EXPECT_LT(geometry::box_minus(robot_pose_at(grasping, with_grasp, 0, time), held).norm(), 1e-12) << time;
  }
  EXPECT_GT((robot_pose_at(grasping, with_grasp, 0, 3.9).translation - Vector3d(0.0, 0.0, 1.0)).norm(), 0.2);
}

TEST(RobotMotion, GraspsAThingWhereItWasPutAndTakesItFromAnotherHand) {
  Scene scene = scene_with_hand();
  scene.robot[0].timeline.resize(1);
  KinematicBody other = scene.robot[0];
  other.name = "other";
  other.timeline[0].X_WG = Pose::from_translation({0.5, 0.0, 0.7});
  scene.robot.push_back(other);
  // Put down 0.1 m below the first hand, then taken by the second, which is 0.4 m beside it by then.
  const std::vector<Action> put = {transport_to(0.5, {0.1, 0.0, 0.7}),
                                   release_at(1.0),
                                   {2.0, Grasp{"cup", "other", {}}},
                                   transport_to(2.5, {0.1, 0.3, 0.9})};
  EXPECT_LT((robot_pose_at(scene, put, 1, 5.0).translation - Vector3d(0.5, 0.3, 0.9)).norm(), 1e-12);
  EXPECT_LT((robot_pose_at(scene, put, 0, 5.0).translation - Vector3d(0.1, 0.1, 1.0)).norm(), 1e-12);
  // The same where nobody lets go of it first.
  const std::vector<Action> handed = {put[0], put[2], put[3]};
  EXPECT_LT((robot_pose_at(scene, handed, 1, 5.0).translation - Vector3d(0.5, 0.3, 0.9)).norm(), 1e-12);
  EXPECT_LT((robot_pose_at(scene, handed, 0, 5.0).translation - Vector3d(0.1, 0.0, 0.8)).norm(), 1e-12);
}

TEST(RobotMotion, StaysWhereItLetsGoOnTheWay) {
  Scene scene = scene_with_hand();
  scene.robot[0].timeline.resize(1);
  Place place;
  place.object = "cup";
  place.X_WO = FixedPose{Pose::from_translation({0.2, 0.0, 0.9})};
  place.duration = 0.5;
  for (const Action& way : {transport_to(0.5, {0.2, 0.0, 0.9}), Action{0.5, place}}) {
    const std::vector<Action> actions = {
        way, release_at(0.75), {2.0, Grasp{"cup", "hand", {}}}, transport_to(2.5, {0.1, 0.0, 0.7})};
    EXPECT_LT((robot_pose_at(scene, actions, 0, 1.9).translation - Vector3d(0.1, 0.1, 1.2)).norm(), 1e-12);
    EXPECT_LT((robot_pose_at(scene, actions, 0, 5.0).translation - Vector3d(0.1, 0.1, 1.0)).norm(), 1e-12);
    // The same where another hand takes it.
    Scene with_other = scene;
    KinematicBody other = scene.robot[0];
    other.name = "other";
    other.timeline[0].X_WG = Pose::from_translation({0.5, 0.0, 0.7});
    with_other.robot.push_back(other);
    const std::vector<Action> handed = {way, {0.75, Grasp{"cup", "other", {}}}, transport_to(1.0, {0.1, 0.3, 0.9})};
    EXPECT_LT((robot_pose_at(with_other, handed, 0, 5.0).translation - Vector3d(0.1, 0.0, 1.0)).norm(), 1e-12);
    EXPECT_LT((robot_pose_at(with_other, handed, 1, 5.0).translation - Vector3d(0.5, 0.3, 0.7)).norm(), 1e-12);
    // What begins on the way goes on from there, and nothing is let go of.
    const std::vector<Action> changed = {way, transport_to(0.75, {0.1, 0.0, 0.7}), transport_to(2.0, {0.0, 0.0, 0.5})};
    EXPECT_LT((robot_pose_at(scene, changed, 0, 1.0).translation - Vector3d(0.1, 0.0, 0.9)).norm(), 1e-12);
    EXPECT_LT((robot_pose_at(scene, changed, 0, 5.0).translation - Vector3d(0.0, 0.0, 0.6)).norm(), 1e-12);
  }
}

TEST(RobotMotion, WhatItInsertsTakesItFromItsTimeline) {
  const Scene scene = scene_with_hand();
  Insert insert;
  insert.object = "cup";
  insert.distance = 0.2;
  const std::vector<Action> actions = {{0.5, insert}};
  EXPECT_LT((robot_pose_at(scene, actions, 0, 0.9).translation - Vector3d(0.5, 0.0, 0.9)).norm(), 1e-12);
  EXPECT_LT((robot_pose_at(scene, actions, 0, 3.0).translation - Vector3d(0.5, 0.0, 0.8)).norm(), 1e-12);
}

TEST(RobotMotion, DoesNotBackOffWhileItCarriesAnotherThing) {
  Scene scene = scene_with_hand();
  scene.robot[0].timeline.resize(1);
  SceneObject lid = scene.objects[0];
  lid.name = "lid";
  scene.objects.push_back(lid);
  const std::vector<Action> actions = {transport_to(0.5, {0.2, 0.0, 0.9}), {0.6, Release{"lid", {0.0, 0.0, 0.4}}}};
  for (const double time : {0.75, 5.0})
    EXPECT_EQ(robot_pose_at(scene, actions, 0, time).translation,
              robot_pose_at(scene, std::vector<Action>{actions[0]}, 0, time).translation);
}

TEST(RobotMotion, WhatIsLetGoOfMovesTheHandNoMore) {
  Scene scene = scene_with_hand();
  scene.robot[0].timeline.resize(1);
  const std::vector<Action> actions = {release_at(0.5), transport_to(1.0, {0.3, 0.2, 0.8}), release_at(2.0)};
  EXPECT_LT((robot_pose_at(scene, actions, 0, 5.0).translation - Vector3d(0.0, 0.1, 1.2)).norm(), 1e-12);
  const std::vector<Action> unknown = {{0.2, Grasp{"spoon", "hand", {}}}, {0.3, Grasp{"cup", "foot", {}}}};
  EXPECT_LT((robot_pose_at(scene, unknown, 0, 5.0).translation - Vector3d(0.0, 0.0, 1.0)).norm(), 1e-12);
}

/// Where the cup is when it is not where the scene's mean has it.
WorldState drawn_start(const Scene& scene, double time) {
  geometry::Vector6d off;
  off << 0.2, -0.1, 0.3, 0.01, -0.02, 0.03;
  WorldState state;
  state.time = time;
  state.objects.resize(1);
  state.objects[0].X_WO = geometry::box_plus(mean(scene.objects[0].pose), off);
  return state;
}

// A state is as good as a scene whose start is fixed to it.
TEST(RobotMotion, FollowsWhatItHoldsFromAGivenState) {
  const Scene scene = scene_with_hand();
  const WorldState drawn = drawn_start(scene, 0.0);
  Scene fixed = scene;
  fixed.objects[0].pose = FixedPose{drawn.objects[0].X_WO};
  Tilt tilt;
  tilt.object = "cup";
  tilt.axis_W = Vector3d::UnitX();
  tilt.angle = 0.7;
  const std::vector<Action> actions = {transport_to(0.4, {0.3, 0.2, 0.8}),
                                       {1.0, tilt},
                                       release_at(2.2),
                                       {2.5, Grasp{"cup", "hand", {}}},
                                       transport_to(2.7, {-0.4, 0.1, 1.2})};
  double most = 0.0;
  for (double time = 0.0; time < 4.0; time += 0.05) {
    const Pose X_WG = robot_pose_at(scene, actions, {&drawn, {}}, 0, time);
    EXPECT_LT(geometry::box_minus(X_WG, robot_pose_at(fixed, actions, 0, time)).norm(), 1e-12) << time;
    most = std::max(most, geometry::box_minus(X_WG, robot_pose_at(scene, actions, 0, time)).norm());
  }
  EXPECT_GT(most, 0.1);
}

TEST(RobotMotion, TimesOfActionsCountFromTheGivenState) {
  const Scene scene = scene_with_hand();
  const WorldState now = drawn_start(scene, 0.0), later = drawn_start(scene, 0.3);
  const std::vector<Action> actions = {transport_to(0.5, {0.3, 0.2, 0.8}), release_at(1.2)};
  std::vector<Action> sooner = actions;
  for (Action& action : sooner) action.time -= 0.3;
  Scene still = scene;
  still.robot[0].timeline.resize(1);
  for (double time = 0.3; time < 2.0; time += 0.05)
    EXPECT_LT(geometry::box_minus(robot_pose_at(still, sooner, {&later, {}}, 0, time),
                                  robot_pose_at(still, actions, {&now, {}}, 0, time))
                  .norm(),
              1e-12)
        << time;
  // It is held from the state's time on, whatever the hand did before.
  const Pose X_GO = pose_at(scene.robot[0], 0.3).inverse() * later.objects[0].X_WO;
  EXPECT_LT(
      geometry::box_minus(object_pose_at(scene, {}, {&later, {}}, 0, 1.1), pose_at(scene.robot[0], 1.1) * X_GO).norm(),
      1e-12);
}

TEST(RobotMotion, AGraspThatIsKnownTakesTheThingAsItIs) {
  Scene scene = scene_with_hand();
  scene.objects[0].held_by.reset();
  const Pose X_GO = drawn_start(scene, 0.0).objects[0].X_WO;
  const MotionStart known{nullptr, [&](int object, double time, const std::function<Pose(double)>& X_WG) {
                            EXPECT_EQ(object, 0);
                            EXPECT_EQ(time, 0.5);
                            EXPECT_NEAR(X_WG(0.75).translation.x(), 0.75, 1e-12);
                            return X_GO;
                          }};
  const std::vector<Action> actions = {{0.5, Grasp{"cup", "hand", {}}}, transport_to(1.0, {0.3, 0.2, 0.8})};
  EXPECT_EQ(object_pose_at(scene, actions, known, 0, 0.4).translation, mean(scene.objects[0].pose).translation);
  for (const double time : {0.5, 0.9, 1.25, 3.0})
    EXPECT_LT(geometry::box_minus(robot_pose_at(scene, actions, known, 0, time).inverse() *
                                      object_pose_at(scene, actions, known, 0, time),
                                  X_GO)
                  .norm(),
              1e-12)
        << time;
  EXPECT_LT((object_pose_at(scene, actions, known, 0, 3.0).translation - Vector3d(0.3, 0.2, 0.8)).norm(), 1e-12);
}

TEST(RobotMotion, WhatIsPutDownStaysThere) {
  Scene scene = scene_with_hand();
  Place place;
  place.object = "cup";
  place.X_WO = FixedPose{Pose::from_translation({0.2, 0.0, 0.4})};
  place.duration = 0.5;
  const std::vector<Action> actions = {{0.5, place}, {1.5, Release{"cup", {0.0, 0.0, 0.1}, 0.2, {}}}};
  EXPECT_LT((object_pose_at(scene, actions, {}, 0, 0.75).translation - Vector3d(0.35, 0.0, 0.65)).norm(), 1e-12);
  for (const double time : {1.0, 1.2, 3.0})
    EXPECT_LT((object_pose_at(scene, actions, {}, 0, time).translation - Vector3d(0.2, 0.0, 0.4)).norm(), 1e-12);
}

TEST(RobotMotion, ActionsLastAsLongAsTheyMoveSomething) {
  Release release;
  release.retreat_duration = 0.5;
  EXPECT_EQ(duration_of({1.0, release}), 0.0);  // the hand stays
  release.retreat = {0.0, 0.0, 0.1};
  EXPECT_EQ(duration_of({1.0, release}), 0.5);
  Push push;
  push.duration = 2.0;
  EXPECT_EQ(duration_of({1.0, push}), 2.0);
  EXPECT_EQ(duration_of({1.0, Grasp{}}), 0.0);
  EXPECT_EQ(share_done(1.0, 2.0, 0.5), 0.0);
  EXPECT_EQ(share_done(1.0, 2.0, 1.5), 0.25);
  EXPECT_EQ(share_done(1.0, 2.0, 4.0), 1.0);
  EXPECT_EQ(share_done(1.0, 0.0, 0.9), 0.0);  // at once
  EXPECT_EQ(share_done(1.0, 0.0, 1.0), 1.0);
}

}  // namespace
}  // namespace prescene::belief
