// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/scene.h"

#include <gmock/gmock.h>

#include <functional>

#include "prescene/belief/body_names.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/belief/scene_size.h"
#include "prescene/belief/validation.h"
#include "prescene/core/sobol.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"
#include "tests/support/matchers.h"

namespace prescene::belief {
namespace {

using testing::HasSubstr;

TEST(PoseAt, HoldsTheEndsAndInterpolatesBetween) {
  KinematicBody body;
  const Pose X_a{geometry::Quaterniond::Identity(), Vector3d(0.0, 0.0, 1.0)};
  const Pose X_b{geometry::exp_rotation({0.0, 0.0, 1.0}), Vector3d(2.0, 0.0, 1.0)};
  body.timeline = {{1.0, X_a}, {3.0, X_b}};
  EXPECT_EQ(pose_at(body, 0.0), X_a);
  EXPECT_EQ(pose_at(body, 5.0), X_b);
  const Pose expected{geometry::exp_rotation({0.0, 0.0, 0.25}), Vector3d(0.5, 0.0, 1.0)};
  EXPECT_THAT(pose_at(body, 1.5), tests::is_near(expected, 1e-12, 1e-12));
}

TEST(PoseAt, IsTheOriginForABodyWithoutATimeline) {
  EXPECT_EQ(pose_at({}, 1.0), Pose{});
  Scene scene;
  scene.robot.emplace_back().name = "hand";
  // The same with actions and without.
  const std::vector<Action> actions = {{0.5, Push{}}};
  EXPECT_EQ(robot_pose_at(scene, {}, 0, 1.0), Pose{});
  EXPECT_EQ(robot_pose_at(scene, actions, 0, 1.0), Pose{});
}

TEST(WorldRadius, GrowsWithThingsThatAreLargerThanAHouseholds) {
  const auto radius_with = [](std::initializer_list<double> edges) {
    Scene scene;
    for (const double edge : edges) {
      ObjectModel model;
      model.name = "box" + std::to_string(scene.models.size());
      model.collision.emplace_back(PrimitiveShape{geometry::BoxShape{{edge, 2.0 * edge, 0.5 * edge}}, {}});
      scene.models.push_back(*with_derived_properties(model));
      SceneObject object;
      object.name = model.name;
      object.model = static_cast<int>(scene.models.size()) - 1;
      scene.objects.push_back(object);
    }
    return world_radius(scene);
  };
  EXPECT_EQ(radius_with({}), kWorldRadius);
  EXPECT_EQ(radius_with({0.005}), kWorldRadius);
  EXPECT_EQ(radius_with({0.3}), kWorldRadius);
  EXPECT_NEAR(radius_with({6.0}), 20.0 * kWorldRadius, 1e-9);
  EXPECT_EQ(radius_with({6.0, 0.1}), kWorldRadius);
}

TEST(SceneValidate, AcceptsTheSmallScene) { EXPECT_EQ(validate(tests::small_scene()), core::ok_status()); }

TEST(SceneValidate, NamesWhatIsWrong) {
  const auto message = [](const std::function<void(Scene&)>& spoil) {
    Scene scene = tests::small_scene();
    spoil(scene);
    return validate(scene).message();
  };
  EXPECT_THAT(message([](Scene& s) { s.models[0].mass = FixedScalar{0.0}; }), HasSubstr("model 'block': mass: 0"));
  EXPECT_THAT(message([](Scene& s) { s.models[0].contact.friction = FixedScalar{-0.1}; }), HasSubstr("friction: -0.1"));
  EXPECT_THAT(message([](Scene& s) { s.models[0].contact.friction = NormalScalar{0.4, 0.1}; }), HasSubstr("below 0"));
  EXPECT_THAT(message([](Scene& s) {
                s.models[0].contact.restitution = UniformScalar{0.5, 1.5};
              }),
              HasSubstr("restitution"));
  EXPECT_THAT(message([](Scene& s) { s.models[0].unit_inertia.diagonal() = Vector3d(1.0, 1.0, 3.0); }),
              HasSubstr("inertia"));
  EXPECT_THAT(message([](Scene& s) { s.models[1].name = "block"; }), HasSubstr("two models"));
  EXPECT_THAT(message([](Scene& s) { s.supports[0].name = "ball"; }), HasSubstr("'ball'"));
  EXPECT_THAT(message([](Scene& s) { s.objects[0].name = "a b"; }), HasSubstr("other characters"));
  EXPECT_THAT(message([](Scene& s) { s.objects[0].model = 2; }), HasSubstr("object 'block'"));
  EXPECT_THAT(message([](Scene& s) { s.objects[0].held_by = "foot"; }), HasSubstr("'foot'"));
  EXPECT_THAT(message([](Scene& s) {
                s.objects[0].pose = NormalPose{Pose{}, -Matrix6d::Identity()};
              }),
              HasSubstr("eigenvalue"));
  EXPECT_THAT(message([](Scene& s) { s.objects[0].pose = SampledPose{}; }), HasSubstr("samples"));
  EXPECT_THAT(message([](Scene& s) { s.supports[0].X_WS.rotation.coeffs() *= 2.0; }), HasSubstr("quaternion"));
  EXPECT_THAT(message([](Scene& s) { s.robot[0].timeline.clear(); }), HasSubstr("timeline"));
  EXPECT_THAT(message([](Scene& s) {
                s.robot[0].timeline = {{1.0, Pose{}}, {1.0, Pose{}}};
              }),
              HasSubstr("do not grow"));
  EXPECT_THAT(message([](Scene& s) { s.duration = 0.0; }), HasSubstr("duration"));
  EXPECT_THAT(message([](Scene& s) { s.actions = {{0.0, Release{"cup"}}}; }), HasSubstr("'cup'"));
  EXPECT_THAT(message([](Scene& s) {
                s.actions = {{1.0, Release{"block"}}, {0.5, Release{"block"}}};
              }),
              HasSubstr("sort"));
  EXPECT_THAT(message([](Scene& s) { s.outcomes = {{"a", "block", {}}}; }), HasSubstr("no condition"));
  EXPECT_THAT(message([](Scene& s) {
                s.outcomes = {{"a", "block", {Condition{Touched{"moon"}}}}};
              }),
              HasSubstr("'moon'"));
  EXPECT_THAT(message([](Scene& s) {
                s.exclusive_outcomes = {{"g", {{"other", "block", {Condition{StillMoving{}}}}}}};
              }),
              HasSubstr("'other'"));
}

TEST(DrawStart, DealsPositionsFirstAndTheWidestObjectBeforeTheOthers) {
  Scene scene = tests::small_scene();
  Matrix6d small = Matrix6d::Zero(), wide = Matrix6d::Zero();
  small(3, 3) = 1e-6;
  wide(4, 4) = 1e-2;
  scene.objects[0].pose = NormalPose{Pose{}, small};
  scene.objects[1].pose = NormalPose{Pose{}, wide};
  scene.models[0].contact.friction = UniformScalar{0.1, 0.5};
  scene.models[1].contact.friction = FixedScalar{0.5};
  scene.models[1].mass = UniformScalar{1.0, 2.0};
  scene.objects[0].twist.linear.x = UniformScalar{-1.0, 1.0};
  ASSERT_EQ(start_dimensions(scene), 5);
  const std::vector<double> middle(5, 0.5);
  const WorldState center = draw_start(scene, middle);
  const auto changed_by = [&](std::size_t coordinate) {
    std::vector<double> u = middle;
    u[coordinate] = 0.9;
    return draw_start(scene, u);
  };
  EXPECT_NE(changed_by(0).objects[1].X_WO, center.objects[1].X_WO);
  EXPECT_NE(changed_by(1).objects[0].X_WO, center.objects[0].X_WO);
  EXPECT_NE(changed_by(2).objects[0].V_WO, center.objects[0].V_WO);
  EXPECT_NE(changed_by(3).objects[0].physical.friction, center.objects[0].physical.friction);
  EXPECT_NE(changed_by(4).objects[1].physical.mass, center.objects[1].physical.mass);
  EXPECT_EQ(center.objects[0].mode, MotionMode::kHeld);
  EXPECT_EQ(center.objects[1].mode, MotionMode::kMoving);
  EXPECT_EQ(center.objects[0].physical.impact_friction, center.objects[0].physical.friction)
      << "like friction if not given";
}

TEST(DrawStartLaws, TheMiddleOfTheCubeIsTheMeanWhereDistributionsAreSymmetric) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    Scene scene = tests::small_scene();
    for (SceneObject& object : scene.objects)
      object.pose = NormalPose{tests::random_pose(stream), tests::random_covariance(stream, 6, 3)};
    scene.models[0].contact.friction = UniformScalar{0.1, stream.uniform(0.2, 1.0)};
    const std::vector<double> middle(static_cast<std::size_t>(start_dimensions(scene)), 0.5);
    const WorldState drawn = draw_start(scene, middle), mean = mean_start(scene);
    for (std::size_t i = 0; i < 2; ++i) {
      RC_ASSERT(geometry::box_minus(drawn.objects[i].X_WO, mean.objects[i].X_WO).norm() < 1e-12);
      RC_ASSERT(std::abs(drawn.objects[i].physical.friction - mean.objects[i].physical.friction) < 1e-12);
    }
  }));
}

TEST(BodyNames, NumberObjectsThenSupportsThenRobotBodiesThenPushers) {
  const Scene scene = tests::small_scene();
  const std::vector<std::string> names{"block", "ball", "table", "bin", "hand"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(body_name(scene, static_cast<int>(i)), names[i]);
    EXPECT_EQ(body_index(scene, names[i]), static_cast<int>(i));
  }
  EXPECT_EQ(body_name(scene, 5), "pusher");
  EXPECT_EQ(body_name(scene, 6), "pusher 2");
  EXPECT_EQ(body_index(scene, "pusher"), std::nullopt);
}

TEST(DerivedProperties, OfTwoHalvesAreThoseOfTheWhole) {
  ObjectModel whole, halves;
  whole.name = halves.name = "box";
  whole.collision.emplace_back(PrimitiveShape{geometry::BoxShape{{0.2, 0.1, 0.3}}, {}});
  for (const double side : {-0.05, 0.05})
    halves.collision.emplace_back(
        PrimitiveShape{geometry::BoxShape{{0.1, 0.1, 0.3}}, Pose::from_translation({side, 0.0, 0.0})});
  const auto a = with_derived_properties(whole), b = with_derived_properties(halves);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_THAT(a->unit_inertia, tests::is_near(b->unit_inertia, 1e-12));
  // (y^2 + z^2) / 12 for a box of 1 kg.
  EXPECT_NEAR(a->unit_inertia(0, 0), (0.01 + 0.09) / 12.0, 1e-12);
  EXPECT_THAT(mean(b->center_of_mass), tests::is_near(Vector3d(Vector3d::Zero()), 1e-12));
  EXPECT_NE(a->visual, nullptr);
}

TEST(DerivedProperties, OfAMeshFollowItsUse) {
  // An open box mesh has no inside, its hull has.
  geometry::TriangleMesh open = geometry::make_mesh(geometry::BoxShape{{0.2, 0.1, 0.3}});
  open.triangles.pop_back();
  ObjectModel model;
  model.name = "open";
  model.collision.emplace_back(MeshShape{std::make_shared<const geometry::TriangleMesh>(open),
                                         Pose::from_translation({0.0, 0.0, 0.1}), MeshUse::kConvexHull});
  const auto hull = with_derived_properties(model);
  ASSERT_TRUE(hull.ok());
  EXPECT_THAT(mean(hull->center_of_mass), tests::is_near(Vector3d(0.0, 0.0, 0.1), 1e-9));
  std::get<MeshShape>(model.collision[0]).use = MeshUse::kDecompose;
  EXPECT_THAT(with_derived_properties(model).status().message(), HasSubstr("model 'open'"));
}

}  // namespace
}  // namespace prescene::belief
