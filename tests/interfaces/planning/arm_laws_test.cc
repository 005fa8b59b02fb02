// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/arm.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "prescene/core/random.h"
#include "prescene/interfaces/planning/motion_checker.h"
#include "prescene/interfaces/planning/scene_obstacles.h"
#include "tests/interfaces/planning/test_arm.h"
#include "tests/support/brute_force.h"

namespace prescene::interfaces::arm_laws_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<double> random_configuration(const Arm& arm, core::RandomStream& random) {
  std::vector<double> q;
  for (const Arm::JointRange& range : arm.joints()) q.push_back(random.uniform(range.lower, range.upper));
  return q;
}

TEST(ArmLaws, LinksAreWhereTheSceneFilesSay) {
  const tests::TestArm made;
  core::RandomStream random(21, core::Purpose::kTest);
  for (int i = 0; i < 50; ++i) {
    const auto q = random_configuration(*made.arm, random);
    std::map<std::string, double> given;
    for (std::size_t k = 0; k < q.size(); ++k) given[made.arm->joints()[k].name] = q[k];
    const auto X_RL = link_poses(*made.robot, given);
    std::vector<Pose> poses(made.arm->shapes().size()), work;
    made.arm->place(q, poses, &work);
    for (std::size_t s = 0; s < poses.size(); ++s) {
      const std::string& name = made.arm->shapes()[s].name;
      if (name == "held") continue;
      const Pose expected = *made.robot->X_WR * X_RL.at(name);
      EXPECT_LT((poses[s].matrix() - expected.matrix()).norm(), 1e-12) << name;
    }
  }
}

Vector3d vertex(const Arm& arm, std::size_t shape, std::size_t number) {
  const auto& vertices = arm.shapes()[shape].shape.triangles()->mesh().vertices();
  return vertices[number % vertices.size()].cast<double>();
}

TEST(ArmLaws, NoPointTravelsFurtherThanItsWay) {
  const tests::TestArm made;
  core::RandomStream random(22, core::Purpose::kTest);
  const std::size_t count = made.arm->shapes().size();
  std::vector<Pose> first(count), last(count), poses(count), work;
  double largest_share = 0.0;
  for (int i = 0; i < 300; ++i) {
    const auto q0 = random_configuration(*made.arm, random), q1 = random_configuration(*made.arm, random);
    std::vector<double> q(q0.size());
    made.arm->place(q0, first, &work);
    for (std::size_t s = 0; s < count; ++s) {
      const Vector3d p = vertex(*made.arm, s, random.uniform_below(1000));
      const double way = made.arm->way(s, std::nullopt, q0, q1);
      double travelled = 0.0;
      last = first;
      for (int step = 1; step <= 50; ++step) {
        made.arm->between(q0, q1, step / 50.0, q);
        made.arm->place(q, poses, &work);
        travelled += (poses[s] * p - last[s] * p).norm();
        ASSERT_LE(travelled, way * step / 50.0 + 1e-9) << made.arm->shapes()[s].name;
        last = poses;
      }
      if (way > 0.0) largest_share = std::max(largest_share, travelled / way);
    }
  }
  EXPECT_GT(largest_share, 0.5);  // The bound is not just large.
}

// Two shapes get nearer to each other, or further apart, by at most the ways that one goes seen from the other.
TEST(ArmLaws, NoDistanceOfTwoPointsChangesMoreThanTheirWays) {
  const tests::TestArm made;
  core::RandomStream random(24, core::Purpose::kTest);
  const std::size_t count = made.arm->shapes().size();
  std::vector<Pose> first(count), poses(count), work;
  for (int i = 0; i < 1000; ++i) {
    const auto q0 = random_configuration(*made.arm, random), q1 = random_configuration(*made.arm, random);
    std::vector<double> q(q0.size());
    made.arm->place(q0, first, &work);
    const double t = random.uniform();
    made.arm->between(q0, q1, t, q);
    made.arm->place(q, poses, &work);
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        const Vector3d p = vertex(*made.arm, a, random.uniform_below(1000));
        const Vector3d r = vertex(*made.arm, b, random.uniform_below(1000));
        const double before = (first[a] * p - first[b] * r).norm(), after = (poses[a] * p - poses[b] * r).norm();
        ASSERT_LE(std::abs(after - before), t * (made.arm->way(a, b, q0, q1) + made.arm->way(b, a, q0, q1)) + 1e-9);
      }
    }
  }
}

TEST(ArmLaws, FreeMotionsAreFreeInDenseSamples) {
  const tests::TestArm made;
  core::ThreadPool pool(1);
  auto obstacles = scene_obstacles(made.scene, made.arm->bodies(), pool);
  ASSERT_TRUE(obstacles.ok()) << obstacles.status().message();
  const auto checker = MotionChecker::make(made.arm, *std::move(obstacles), {.margin = 0.005}, made.arm->home());
  ASSERT_TRUE(checker.ok());
  core::RandomStream random(23, core::Purpose::kTest);
  PlanningScratch scratch;
  int free = 0, blocked = 0;
  while (free + blocked < 40) {
    const auto q0 = random_configuration(*made.arm, random), q1 = random_configuration(*made.arm, random);
    if (!(*checker)->is_free(q0, scratch) || !(*checker)->is_free(q1, scratch)) continue;
    const bool is_free = (*checker)->check(q0, q1, scratch).outcome == MotionCheck::kFree;
    (is_free ? free : blocked) += 1;
    bool collides = false;
    std::vector<double> q(q0.size());
    std::vector<Pose> poses(made.arm->shapes().size()), work;
    for (int step = 0; step <= 100; ++step) {
      made.arm->between(q0, q1, step / 100.0, q);
      made.arm->place(q, poses, &work);
      for (std::size_t s = 0; s < poses.size(); ++s) {
        if (!made.arm->moves(s)) continue;
        for (const Obstacle& obstacle : (*checker)->obstacles())
          collides = collides || tests::collide_by_brute_force(obstacle.shape.triangles()->mesh(),
                                                               made.arm->shapes()[s].shape.triangles()->mesh(),
                                                               *collision::relative_transform(obstacle.X_WO, poses[s]));
      }
      for (const auto& [a, b] : made.arm->own_pairs())
        collides = collides || tests::collide_by_brute_force(made.arm->shapes()[a].shape.triangles()->mesh(),
                                                             made.arm->shapes()[b].shape.triangles()->mesh(),
                                                             *collision::relative_transform(poses[a], poses[b]));
    }
    ASSERT_FALSE(is_free && collides);
  }
  EXPECT_GT(free, 5);
  EXPECT_GT(blocked, 5);
}

TEST(ArmLaws, WhatIsHeldIsCarriedAndIsNoObstacle) {
  const tests::TestArm made;
  EXPECT_THAT(made.arm->bodies(), ElementsAre("base", "upper", "fore", "tool", "finger", "held"));
  core::ThreadPool pool(1);
  const auto obstacles = scene_obstacles(made.scene, made.arm->bodies(), pool);
  ASSERT_TRUE(obstacles.ok());
  std::vector<std::string> names;
  for (const Obstacle& obstacle : *obstacles) names.push_back(obstacle.name);
  EXPECT_THAT(names, ElementsAre("plate", "post"));
  std::vector<Pose> poses(made.arm->shapes().size()), work;
  made.arm->place(made.arm->home(), poses, &work);
  const Pose X_tool_held = poses[3].inverse() * poses[5];
  EXPECT_LT((poses[5].translation - belief::mean_start(made.scene).objects[0].X_WO.translation).norm(), 1e-12);
  const std::vector<double> q = {0.3, -0.4, 0.5, 0.02};
  made.arm->place(q, poses, &work);
  EXPECT_LT((X_tool_held.matrix() - (poses[3].inverse() * poses[5]).matrix()).norm(), 1e-12);
  EXPECT_FALSE(made.arm->moves(0));
  EXPECT_TRUE(made.arm->moves(5));
}

TEST(ArmLaws, RefusesWhatIsWrongAndNamesIt) {
  const tests::TestArm made;
  core::ThreadPool pool(1);
  const auto error = [&](std::vector<std::string> joints) {
    return Arm::make(*made.robot, made.scene, {.joints = std::move(joints)}, pool).status().message();
  };
  EXPECT_THAT(error({"wrist"}), HasSubstr("joint 'wrist': there is none of this name"));
  EXPECT_THAT(error({"turn", "turn"}), HasSubstr("named twice"));
  EXPECT_THAT(error({"follow"}), HasSubstr("name that instead"));
  EXPECT_THAT(error({"mount"}), HasSubstr("does not move"));
  EXPECT_THAT(scene_obstacles(made.scene, {"mug"}, pool).status().message(), HasSubstr("'mug' is to be left out"));
}

}  // namespace
}  // namespace prescene::interfaces::arm_laws_test
