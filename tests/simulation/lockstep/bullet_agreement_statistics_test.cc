// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper against Bullet's, an implementation of the same mechanics in scalar double precision: step by
// step where nothing is chaotic, and in the probabilities of outcomes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/support/paths.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

/// How many starts fall in each class with both steppers, and in which they agree start by start.
struct Shares {
  std::vector<int> bullet, lockstep;
  int same = 0;
};
Shares shares_of(const Scene& scene, int count) {
  const std::vector<WorldState> starts = drawn_starts(scene, count, 11);
  simulation::RunRequest request;
  request.stop.duration = scene.duration;
  request.stop.stop_at_rest = scene.stop_at_rest;
  request.actions = scene.actions;
  const auto bullet = run_all(*bullet_of(scene), starts, request);
  const auto lockstep = run_all(*lockstep_of(scene), starts, request);
  const belief::ExclusiveOutcomes& classes = scene.exclusive_outcomes.front();
  Shares shares;
  shares.bullet.assign(classes.outcomes.size() + 1, 0);
  shares.lockstep = shares.bullet;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const int a = belief::classify(scene, bullet[i], classes);
    const int b = belief::classify(scene, lockstep[i], classes);
    ++shares.bullet[static_cast<std::size_t>(a)];
    ++shares.lockstep[static_cast<std::size_t>(b)];
    shares.same += a == b ? 1 : 0;
  }
  return shares;
}

/// The same starts are given to both, so that a difference of n instances in a class has a variance of at most the
/// number of starts that disagree. False alarms: one in 1,000 a scene.
void expect_same_distribution(const Scene& scene, int count, double least_same) {
  const Shares shares = shares_of(scene, count);
  const int changed = count - shares.same;
  EXPECT_GE(shares.same, least_same * count) << scene.name;
  const double z = 3.8;  // six classes at most
  testing::Test::RecordProperty(scene.name + "_same", std::to_string(shares.same));
  for (std::size_t k = 0; k < shares.bullet.size(); ++k) {
    testing::Test::RecordProperty(scene.name + "_" + std::to_string(k),
                                  std::to_string(shares.bullet[k]) + " / " + std::to_string(shares.lockstep[k]));
    EXPECT_LE(std::abs(shares.bullet[k] - shares.lockstep[k]), 1.0 + z * std::sqrt(static_cast<double>(changed)))
        << scene.name << " class " << k << ": " << shares.bullet[k] << " and " << shares.lockstep[k] << " of " << count;
  }
}

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

/// What a thing meets in one step.
enum class Opposite { kFixed, kKinematic, kFree };

struct StepErrors {
  std::size_t touching = 0;
  std::size_t different = 0;
  std::vector<double> errors;  // ascending
};

/// Random poses and speeds of a thing about another: how much the changes of velocities in a step differ.
StepErrors compare_steps(const belief::CollisionShape& shape, const belief::CollisionShape& other, Opposite opposite) {
  Scene scene;
  scene.name = "edge";
  const Pose X_WB{about({1.0, 0.3, 0.2}, 0.4), Vector3d(0.02, 0.01, 0.03)};
  ObjectModel model = model_of("thing", {shape});
  model.contact.restitution = belief::FixedScalar{0.4};
  add_object(scene, model, "thing");
  if (opposite == Opposite::kFixed) scene.supports.push_back(support_of("fixed", {other}, X_WB));
  if (opposite == Opposite::kKinematic) {
    belief::KinematicBody hand;
    hand.name = "hand";
    hand.collision = {other};
    hand.contact.restitution = belief::FixedScalar{1.0};
    const Pose X_end{about({0.2, 1.0, 0.1}, 0.5) * X_WB.rotation, X_WB.translation + Vector3d(0.4, -0.3, 0.5)};
    hand.timeline = {{0.0, X_WB}, {1.0, X_end}};
    scene.robot.push_back(hand);
  }
  if (opposite == Opposite::kFree) {
    ObjectModel second = model_of("second", {other}, 0.6);
    second.contact.restitution = belief::FixedScalar{0.9};
    add_object(scene, second, "second");
  }
  auto bullet = bullet_of(scene)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
  auto lockstep = lockstep_instance_of(scene);
  core::RandomStream stream(17, core::Purpose::kTest);
  StepErrors result;
  const auto velocity_of_mass = [](const belief::ObjectState& o) {
    return Vector3d(o.V_WO.linear + o.V_WO.angular.cross(o.X_WO.rotation * o.physical.center_of_mass));
  };
  for (int i = 0; i < 16000; ++i) {
    WorldState start = start_of(scene);
    belief::ObjectState& object = start.objects[0];
    object.X_WO = Pose{geometry::uniform_rotation(stream),
                       {stream.uniform(-0.35, 0.35), stream.uniform(-0.3, 0.3), stream.uniform(-0.2, 0.25)}};
    if (opposite == Opposite::kFree) start.objects[1].X_WO = X_WB;
    // Overlap is parted another way, and shows at rest.
    bullet->set_state(start);
    bullet->step();
    const Vector3d fallen = bullet->state().objects[0].X_WO.translation - object.X_WO.translation;
    if ((fallen - 0.5 * scene.gravity_W / (240.0 * 240.0)).norm() > 1e-7) continue;
    object.V_WO.linear = -5.0 * object.X_WO.translation + 0.5 * geometry::normal_vector(stream);
    object.V_WO.angular = 5.0 * geometry::normal_vector(stream);
    if (opposite == Opposite::kFree) {
      start.objects[1].V_WO.linear = 0.5 * geometry::normal_vector(stream);
      start.objects[1].V_WO.angular = 5.0 * geometry::normal_vector(stream);
    }
    bullet->set_state(start);
    lockstep->set_state(start);
    bullet->step();
    lockstep->step();
    double change = 0.0, error = 0.0;
    for (std::size_t k = 0; k < start.objects.size(); ++k) {
      const belief::ObjectState a = bullet->state().objects[k];
      const belief::ObjectState b = lockstep->state().objects[k];
      const Vector3d free = velocity_of_mass(start.objects[k]) + scene.gravity_W / 240.0;
      change = std::max({change, (velocity_of_mass(a) - free).norm(), (velocity_of_mass(b) - free).norm()});
      error = std::max(error, (a.V_WO.linear - b.V_WO.linear).norm() + 0.05 * (a.V_WO.angular - b.V_WO.angular).norm());
    }
    if (change < 1e-3) continue;
    ++result.touching;
    result.errors.push_back(error);
    if (error > 0.01) ++result.different;
  }
  std::sort(result.errors.begin(), result.errors.end());
  return result;
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
