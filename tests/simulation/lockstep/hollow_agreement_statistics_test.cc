// SPDX-License-Identifier: Apache-2.0
// Bodies of spheres in the lockstep stepper against Bullet's, which finds their contacts one by one in double
// precision: step by step, and in the probabilities of outcomes.
#include <gtest/gtest.h>

#include "agreement.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/support/hollow_meshes.h"
#include "tests/support/paths.h"

namespace prescene::tests::hollow_agreement_test {
namespace {

using belief::PrimitiveShape;
using geometry::BoxShape;

TEST(HollowAgreement, StepsAreTheSame) {
  struct Case {
    const char* name;
    belief::CollisionShape shape;
  };
  const std::vector<Case> things = {
      {"mug", spheres_of(mug(), {1500, 0.0})},
      {"box", spheres_of(geometry::make_mesh(BoxShape{{0.1, 0.06, 0.04}}), {800, 0.0})},
      {"ball", PrimitiveShape{geometry::Sphere{0.03}, Pose{}}},
  };
  const std::vector<Case> others = {
      {"slab", PrimitiveShape{BoxShape{{0.5, 0.4, 0.1}}, Pose{}}},
      {"roof", hull_of(geometry::make_gable_carton(0.3, 0.3, 0.05, 0.2))},
      {"drum", PrimitiveShape{geometry::Cylinder{0.15, 0.2}, Pose{}}},
      {"rail", PrimitiveShape{geometry::Capsule{0.06, 0.4}, Pose{}}},
      {"hat", PrimitiveShape{geometry::Cone{0.18, 0.25}, Pose{}}},
      {"bowl", spheres_of(bowl(0.12, 0.1, 0.004), {1500, 0.0})},
  };
  for (const Case& thing : things) {
    for (const Case& other : others) {
      if (std::string(thing.name) == "ball" && std::string(other.name) != "bowl") continue;
      for (const Opposite opposite : {Opposite::kFixed, Opposite::kKinematic, Opposite::kFree}) {
        const StepErrors found = compare_steps(thing.shape, other.shape, opposite, 6000);
        SCOPED_TRACE(std::string(thing.name) + " on " + other.name + " " + std::to_string(static_cast<int>(opposite)));
        const std::vector<double>& errors = found.errors;
        ASSERT_GT(found.touching, 5U);
        EXPECT_LT(errors[errors.size() / 2], 2e-5);
        EXPECT_LT(errors[errors.size() * 8 / 10], 1e-3);
        // Which of contacts that are equally good are kept, and their order where 60 iterations do not settle.
        EXPECT_LE(found.different, found.touching / 6);
      }
    }
  }
}

belief::SceneObject& add(Scene& scene, const std::string& name, const belief::CollisionShape& shape, double mass,
                         const Pose& X_WO, const std::array<double, 6>& deviations) {
  ObjectModel model = model_of(name, {shape}, mass);
  model.contact.restitution = belief::FixedScalar{0.2};
  model.contact.rolling_friction = 3e-4;
  belief::NormalPose pose;
  pose.mean = X_WO;
  pose.covariance.setZero();
  for (int i = 0; i < 6; ++i)
    pose.covariance(i, i) = deviations[static_cast<std::size_t>(i)] * deviations[static_cast<std::size_t>(i)];
  belief::SceneObject& object = scene.objects[static_cast<std::size_t>(add_object(scene, model, name))];
  object.pose = pose;
  return object;
}

Scene on_floor(const std::string& name, double duration) {
  Scene scene;
  scene.name = name;
  scene.duration = duration;
  scene.supports.push_back(floor_support());
  return scene;
}

TEST(HollowAgreement, AMugLetGoTiltedEndsAlike) {
  Scene scene = on_floor("tilted_mug", 4.0);
  add(scene, "mug", spheres_of(mug(), {1500, 0.0}), 0.3, Pose::from_translation({0.0, 0.0, 0.04}),
      {0.5, 0.5, 1.0, 0.0, 0.0, 0.005});
  scene.exclusive_outcomes.push_back(
      {"mug", {{"stands", "mug", {belief::Condition{belief::UprightWithin{Vector3d::UnitZ(), 0.3}}}}}});
  expect_same_distribution(scene, 96, 0.85);
}

TEST(HollowAgreement, ABallOverABowlEndsAlike) {
  Scene scene = on_floor("ball_over_bowl", 4.0);
  add(scene, "bowl", spheres_of(bowl(0.06, 0.05, 0.003), {1500, 0.0}), 0.3, Pose::from_translation({0.0, 0.0, 0.0005}),
      {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  add(scene, "ball", PrimitiveShape{geometry::Sphere{0.015}, Pose{}}, 0.03, Pose::from_translation({0.0, 0.0, 0.2}),
      {0.0, 0.0, 0.0, 0.03, 0.03, 0.0});
  scene.exclusive_outcomes.push_back({"ball", {{"in", "ball", {belief::Condition{belief::RestingOn{"bowl"}}}}}});
  expect_same_distribution(scene, 64, 0.8);
}

TEST(HollowAgreement, ABottleBesideAMugEndsAlike) {
  Scene scene = on_floor("bottle_beside_mug", 4.0);
  add(scene, "mug", spheres_of(mug(), {1500, 0.0}), 0.3, Pose::from_translation({0.09, 0.0, 0.0005}),
      {0.0, 0.0, 3.0, 0.0, 0.0, 0.0});
  add(scene, "bottle", PrimitiveShape{geometry::Cylinder{0.033, 0.2}, Pose{}}, 0.5,
      Pose{about(Vector3d::UnitY(), 0.2), {0.0, 0.0, 0.12}}, {0.15, 0.15, 0.0, 0.005, 0.01, 0.0});
  scene.exclusive_outcomes.push_back(
      {"bottle", {{"stands", "bottle", {belief::Condition{belief::UprightWithin{Vector3d::UnitZ(), 0.2}}}}}});
  expect_same_distribution(scene, 48, 0.8);
}

Scene scenario(const std::string& name) {
  auto scene = interfaces::read_scene(source_dir() / "scenarios" / (name + ".yaml"));
  PRESCENE_CHECK(scene.ok());
  return *std::move(scene);
}

TEST(HollowAgreement, AMugOnAHookEndsAlike) { expect_same_distribution(scenario("mug_on_hook"), 32, 0.75); }
TEST(HollowAgreement, ASpoonInAMugEndsAlike) { expect_same_distribution(scenario("spoon_in_mug"), 16, 0.4); }

}  // namespace
}  // namespace prescene::tests::hollow_agreement_test
