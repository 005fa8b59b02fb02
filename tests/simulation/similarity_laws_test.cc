// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace prescene::simulation {
namespace {

using belief::FixedScalar;
using belief::NormalScalar;
using belief::UniformScalar;
using geometry::Pose;
using geometry::Vector3d;

/// A box that falls, spins and rolls, each of its numbers uncertain, beside a hand that moves.
belief::Scene scene_of_a_box(double edge) {
  belief::Scene scene;
  belief::ObjectModel model;
  model.name = "box";
  model.collision = {belief::PrimitiveShape{geometry::BoxShape{Vector3d(edge, 0.8 * edge, 1.2 * edge)}, {}}};
  model.center_of_mass = {UniformScalar{-0.1 * edge, 0.1 * edge}, FixedScalar{0.0}, FixedScalar{0.0}};
  model.contact.friction = UniformScalar{0.2, 0.6};
  model.contact.rolling_friction = 0.01 * edge;
  scene.models = {*belief::with_derived_properties(model)};
  belief::SceneObject object;
  object.name = "box";
  belief::BoxPose pose;
  pose.position = {NormalScalar{0.0, 0.5 * edge}, UniformScalar{-edge, edge}, FixedScalar{3.0 * edge}};
  pose.any_rotation = true;
  object.pose = pose;
  object.twist.angular.z = NormalScalar{1.0, 0.5};
  object.twist.linear.x = UniformScalar{0.0, 1.0};
  scene.objects = {object};
  scene.actions = {{0.5, belief::Push{{-edge, 0, edge}, {edge, 0, edge}, 1.0, 0.1 * edge, FixedScalar{0.0}}}};
  return scene;
}

TEST(Similarity, DrawsOfTheSimilarSceneAreTheSimilarDraws) {
  const belief::Scene scene = scene_of_a_box(0.1);
  for (const double factor : {1.0 / 64, 0.3, 8.0}) {
    const Similarity similarity{factor};
    const belief::Scene other = scaled(scene, similarity);
    core::RandomStream stream(1, core::Purpose::kTest);
    ASSERT_EQ(start_dimensions(other), start_dimensions(scene));
    std::vector<double> uniforms(static_cast<std::size_t>(start_dimensions(scene)));
    for (int i = 0; i < 100; ++i) {
      for (double& u : uniforms) u = stream.uniform();
      const belief::ObjectState expected = scaled(draw_start(scene, uniforms), similarity).objects[0];
      const belief::ObjectState drawn = draw_start(other, uniforms).objects[0];
      EXPECT_NEAR((drawn.X_WO.translation - expected.X_WO.translation).norm(), 0.0, 1e-12 * factor);
      EXPECT_NEAR(geometry::log_rotation(drawn.X_WO.rotation * expected.X_WO.rotation.conjugate()).norm(), 0.0, 1e-9);
      EXPECT_NEAR((drawn.V_WO.linear - expected.V_WO.linear).norm(), 0.0, 1e-12 * std::sqrt(factor));
      EXPECT_NEAR((drawn.V_WO.angular - expected.V_WO.angular).norm(), 0.0, 1e-12 / std::sqrt(factor));
      EXPECT_NEAR((drawn.physical.center_of_mass - expected.physical.center_of_mass).norm(), 0.0, 1e-12 * factor);
      EXPECT_EQ(drawn.physical.friction, expected.physical.friction);
    }
  }
}

// Its axes of the widest uncertainty depend on the units, so that draws differ while their distribution is similar.
TEST(Similarity, ScalesTheCovarianceOfPoses) {
  belief::Scene scene = scene_of_a_box(0.1);
  belief::NormalPose pose;
  pose.mean.translation = Vector3d(0.1, 0.2, 0.3);
  pose.covariance.diagonal() << 0.1, 0.2, 0.3, 1e-2, 2e-2, 3e-2;
  pose.covariance(0, 5) = pose.covariance(5, 0) = 0.01;
  scene.objects[0].pose = pose;
  const belief::Scene half = scaled(scene, Similarity{0.5});
  const auto& similar = std::get<belief::NormalPose>(half.objects[0].pose);
  geometry::Matrix6d expected = pose.covariance;
  expected.topRightCorner<3, 3>() *= 0.5;
  expected.bottomLeftCorner<3, 3>() *= 0.5;
  expected.bottomRightCorner<3, 3>() *= 0.25;
  EXPECT_TRUE(similar.covariance.isApprox(expected, 1e-15));
  EXPECT_EQ(similar.mean.translation, Vector3d(0.05, 0.1, 0.15));
}

TEST(Similarity, KeepsWhatHasNoLength) {
  const belief::Scene scene = scene_of_a_box(0.1);
  const Similarity similarity{0.25};
  const belief::Scene other = scaled(scene, similarity);
  // A pendulum of its size swings as often in its own time: sqrt(length / gravity) over the unit of time.
  EXPECT_EQ(other.gravity_W, scene.gravity_W);
  EXPECT_EQ(similarity.time(), 0.5);
  EXPECT_EQ(other.models[0].mass, scene.models[0].mass);
  const auto derived = belief::with_derived_properties(other.models[0]);
  EXPECT_NEAR((derived->unit_inertia - other.models[0].unit_inertia).norm(), 0.0, 1e-15);
  const auto& push = std::get<belief::Push>(other.actions[0].what);
  EXPECT_EQ(other.actions[0].time, 0.25);
  EXPECT_EQ(push.duration, 0.5);
  EXPECT_EQ((push.to - push.from).norm(), 0.05);
}

TEST(Similarity, ThereAndBackIsTheSameScene) {
  const belief::Scene scene = scene_of_a_box(0.1);
  const Similarity quarter{0.25};  // Powers of four are exact.
  EXPECT_EQ(scaled(scaled(scene, quarter), quarter.inverse()), scene);
}

TEST(Similarity, IsOfTheSmallestObject) {
  EXPECT_EQ(similarity_of(scene_of_a_box(0.1)), Similarity{});
  EXPECT_EQ(similarity_of(belief::Scene{}), Similarity{});
  const double volume = 0.8 * 1.2;
  EXPECT_NEAR(similarity_of(scene_of_a_box(0.01)).length, 0.1 * std::cbrt(volume), 1e-9);
  EXPECT_NEAR(similarity_of(scene_of_a_box(6.0)).length, 60.0 * std::cbrt(volume), 1e-6);
  belief::Scene both = scene_of_a_box(0.1);
  both.models.push_back(scene_of_a_box(0.002).models[0]);
  both.models[1].name = "grain";
  both.objects.push_back(both.objects[0]);
  both.objects[1].name = "grain";
  both.objects[1].model = 1;
  EXPECT_NEAR(similarity_of(both).length, 0.02 * std::cbrt(volume), 1e-9);
}

}  // namespace
}  // namespace prescene::simulation
