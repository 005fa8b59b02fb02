// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper against Bullet's, an implementation of the same mechanics in scalar double precision: step by
// step where nothing is chaotic, and in the probabilities of outcomes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "agreement.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/support/paths.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

TEST(BulletAgreement, CartonOverBinEndsAlike) { expect_same_distribution(carton_over_bin(), 1024, 0.85); }
TEST(BulletAgreement, BottleAtEdgeEndsAlike) { expect_same_distribution(bottle_at_edge(), 1024, 0.9); }
// Chaotic: a rounding error is another face.
TEST(BulletAgreement, TumblingBoxEndsAlike) { expect_same_distribution(tumbling_box(), 1536, 0.3); }

/// As a scanned mesh, whose hull has more vertices than lanes have room for; Bullet's stepper takes it as it is.
TEST(BulletAgreement, SimplifiedHullOfABottleEndsAlike) {
  Scene scene = bottle_at_edge();
  scene.name = "scanned_bottle_at_edge";
  belief::ObjectModel& bottle = scene.models[0];
  bottle.collision = {hull_of(geometry::make_mesh(geometry::Cylinder{0.035, 0.24}, 48))};
  EXPECT_GT(lockstep_of(scene)->stepper().hull_error, 0.0);
  EXPECT_LT(lockstep_of(scene)->stepper().hull_error, 2e-3);
  expect_same_distribution(scene, 256, 0.85);
}

Scene scenario(const std::string& name) {
  auto scene = interfaces::read_scene(source_dir() / "scenarios" / (name + ".yaml"));
  PRESCENE_CHECK(scene.ok());
  return *std::move(scene);
}

TEST(BulletAgreement, ReleasedMilkEndsAlike) { expect_same_distribution(scenario("milk_on_bin"), 512, 0.85); }
TEST(BulletAgreement, ShovedStackEndsAlike) { expect_same_distribution(shoved_stack(), 512, 0.9); }
TEST(BulletAgreement, PushedStackEndsAlike) { expect_same_distribution(scenario("pushed_stack"), 512, 0.9); }

TEST(BulletAgreement, FivePushedObjectsEndAlike) {
  Scene scene = scenario("five_objects_pushed");
  const auto below = [](const char* object) {
    belief::Condition falls;
    falls.predicate = belief::BelowHeight{-0.1};
    return belief::Outcome{std::string(object) + "_falls", object, {falls}};
  };
  belief::Condition lies;
  lies.predicate = belief::UprightWithin{Vector3d::UnitZ(), 0.5};
  lies.negated = true;
  scene.exclusive_outcomes = {{"ends", {below("can"), below("ball"), {"carton_lies", "carton", {lies}}}}};
  expect_same_distribution(scene, 256, 0.85);
}

/// Ten dominoes at uncertain distances; the first one is tipped over.
TEST(BulletAgreement, TenDominoesEndAlike) {
  Scene scene;
  scene.name = "dominoes";
  scene.duration = 3.0;
  scene.supports.push_back(floor_support());
  ObjectModel model = primitive_model("domino", BoxShape{{0.008, 0.03, 0.05}}, 0.02);
  model.contact.friction = belief::UniformScalar{0.1, 0.5};
  for (int i = 0; i < 10; ++i) {
    add_object(scene, model, "domino" + std::to_string(i));
    scene.objects.back().model = i;
    scene.models[static_cast<std::size_t>(i)].name += std::to_string(i);
    belief::BoxPose pose;
    pose.position = {belief::UniformScalar{0.034 * i - 0.009, 0.034 * i + 0.009}, belief::UniformScalar{-0.006, 0.006},
                     belief::FixedScalar{0.025}};
    scene.objects.back().pose = pose;
  }
  scene.objects[0].twist.angular.y = belief::FixedScalar{8.0};
  belief::Condition lies;
  lies.predicate = belief::UprightWithin{Vector3d::UnitZ(), 0.5};
  lies.negated = true;
  scene.exclusive_outcomes = {{"fall", {{"all", "domino9", {lies}}, {"half", "domino4", {lies}}}}};
  expect_same_distribution(scene, 256, 0.7);
}

TEST(BulletAgreement, ReleasesOfTheSameSeedAreTheSame) {
  const Scene scene = scenario("milk_on_bin");
  const std::vector<WorldState> starts = drawn_starts(scene, 20, 3);
  simulation::RunRequest request;
  request.actions = scene.actions;
  request.stop.duration = 2.52;  // let go at 2.5 s
  const auto bullet = run_all(*bullet_of(scene), starts, request);
  const auto lockstep = run_all(*lockstep_of(scene), starts, request);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const belief::ObjectState& a = bullet[i].final().objects[0];
    const belief::ObjectState& b = lockstep[i].final().objects[0];
    EXPECT_EQ(b.mode, belief::MotionMode::kMoving);
    EXPECT_EQ(bullet[i].final().time, lockstep[i].final().time);
    EXPECT_LT((a.X_WO.translation - b.X_WO.translation).norm(), 1e-6);
    EXPECT_LT((a.V_WO.linear - b.V_WO.linear).norm(), 1e-6);
    EXPECT_LT((a.V_WO.angular - b.V_WO.angular).norm(), 1e-5);
  }
}

TEST(BulletAgreement, TrajectoriesTellTheSameStory) {
  for (const char* name : {"milk_on_bin", "pushed_stack"}) {
    const Scene scene = scenario(name);
    const std::vector<WorldState> starts = drawn_starts(scene, 64, 13);
    simulation::RunRequest request;
    request.actions = scene.actions;
    request.stop.duration = scene.duration;
    request.sample_interval = 0.25;
    const auto bullet = run_all(*bullet_of(scene), starts, request);
    const auto lockstep = run_all(*lockstep_of(scene), starts, request);
    int same_end = 0, same_pairs = 0, same_final = 0, near_in_time = 0;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      const auto pairs_of = [](const belief::Trajectory& run) {
        std::set<std::pair<int, int>> pairs;
        for (const belief::ContactInterval& c : run.contacts) pairs.insert({c.first, c.second});
        return pairs;
      };
      same_end += bullet[i].end == lockstep[i].end ? 1 : 0;
      same_pairs += pairs_of(bullet[i]) == pairs_of(lockstep[i]) ? 1 : 0;
      same_final += bullet[i].final_contacts == lockstep[i].final_contacts ? 1 : 0;
      near_in_time += std::abs(bullet[i].simulated_seconds - lockstep[i].simulated_seconds) < 0.1 ? 1 : 0;
      // What is held is where the hand is, in both.
      for (std::size_t k = 0; k < std::min(bullet[i].states.size(), lockstep[i].states.size()); ++k) {
        const belief::ObjectState& a = bullet[i].states[k].objects[0];
        const belief::ObjectState& b = lockstep[i].states[k].objects[0];
        if (a.mode != belief::MotionMode::kHeld || k + 1 == bullet[i].states.size()) continue;
        ASSERT_EQ(b.mode, belief::MotionMode::kHeld);
        ASSERT_EQ(bullet[i].states[k].time, lockstep[i].states[k].time);
        ASSERT_LT((a.X_WO.translation - b.X_WO.translation).norm(), 1e-6);
        ASSERT_LT((a.V_WO.linear - b.V_WO.linear).norm(), 1e-6);
      }
    }
    const int count = static_cast<int>(starts.size());
    EXPECT_GE(same_end, count - 1) << name;  // one in a thousand leans so that it rests here and not quite there
    EXPECT_GE(same_pairs, count * 9 / 10) << name;
    EXPECT_GE(same_final, count * 9 / 10) << name;
    EXPECT_GE(near_in_time, count * 2 / 3) << name;  // how long something rocks is chaotic
  }
}

TEST(BulletAgreement, StepsAboutEdgesAreTheSame) {
  struct Case {
    const char* name;
    belief::CollisionShape shape;
  };
  const std::vector<Case> things = {
      {"sphere", belief::PrimitiveShape{geometry::Sphere{0.05}, Pose{}}},
      {"box", belief::PrimitiveShape{BoxShape{{0.1, 0.06, 0.04}}, Pose{}}},
      {"cylinder", belief::PrimitiveShape{geometry::Cylinder{0.03, 0.1}, Pose{}}},
      {"cone", belief::PrimitiveShape{geometry::Cone{0.04, 0.1}, Pose{}}},
      {"capsule", belief::PrimitiveShape{geometry::Capsule{0.02, 0.1}, Pose{}}},
      {"carton", hull_of(geometry::make_gable_carton(0.07, 0.07, 0.1, 0.14))},
  };
  const std::vector<Case> others = {
      {"box", belief::PrimitiveShape{BoxShape{{0.5, 0.4, 0.1}}, Pose{}}},
      {"roof", hull_of(geometry::make_gable_carton(0.3, 0.3, 0.05, 0.2))},
      {"drum", belief::PrimitiveShape{geometry::Cylinder{0.15, 0.2}, Pose{}}},
      {"rail", belief::PrimitiveShape{geometry::Capsule{0.06, 0.4}, Pose{}}},
      {"ball", belief::PrimitiveShape{geometry::Sphere{0.15}, Pose{}}},
      {"hat", belief::PrimitiveShape{geometry::Cone{0.18, 0.25}, Pose{}}},
  };
  for (const Case& thing : things) {
    for (const Case& other : others) {
      for (const Opposite opposite : {Opposite::kFixed, Opposite::kKinematic, Opposite::kFree}) {
        const StepErrors found = compare_steps(thing.shape, other.shape, opposite);
        SCOPED_TRACE(std::string(thing.name) + " on " + other.name + " " + std::to_string(static_cast<int>(opposite)));
        const std::vector<double>& errors = found.errors;
        ASSERT_GT(found.touching, 40U);
        // Nearest points of edges with something round are found step by step, the normal to some 1e-4 rad.
        const bool round =
            std::string(other.name) == "drum" || std::string(other.name) == "rail" || std::string(other.name) == "hat";
        // Where 60 iterations do not settle an impact, the order of its contacts shows.
        EXPECT_LT(errors[errors.size() / 2], round ? 2e-4 : 5e-6);
        EXPECT_LT(errors[errors.size() * 85 / 100], round ? 6e-4 : 1e-4);
        // Rims are eight points here, twelve there.
        EXPECT_LE(found.different, found.touching / (round ? 7 : 10));
      }
    }
  }
}

}  // namespace
}  // namespace prescene::tests
