// SPDX-License-Identifier: Apache-2.0
// What one object can still fall is energy for the others, however deep that is.
#include <gtest/gtest.h>

#include "certified_problem.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::simulation {
namespace {

using geometry::Pose;

belief::ContactProperties lively(double restitution) {
  belief::ContactProperties contact;
  contact.friction = belief::FixedScalar{0.1};
  contact.restitution = belief::FixedScalar{restitution};
  return contact;
}

belief::ObjectModel ball(const std::string& name, double radius, double mass) {
  belief::ObjectModel model;
  model.name = name;
  model.collision.push_back(belief::PrimitiveShape{geometry::Sphere{radius}, Pose{}});
  model.mass = belief::FixedScalar{mass};
  model.contact = lively(0.97);
  return *belief::with_derived_properties(std::move(model));
}

constexpr double kDepth = 0.5, kRadius = 0.1, kWall = 0.01;  // of a bin, m

belief::Support mesh_bin() {
  belief::MeshShape shape;
  shape.mesh = std::make_shared<const geometry::TriangleMesh>(geometry::make_lathe({{0.0, -kWall},
                                                                                    {kRadius + kWall, -kWall},
                                                                                    {kRadius + kWall, kDepth},
                                                                                    {kRadius, kDepth},
                                                                                    {kRadius, 0.0},
                                                                                    {0.0, 0.0}},
                                                                                   32));
  shape.use = belief::MeshUse::kSurface;
  belief::Support bin;
  bin.name = "bin";
  bin.collision = {shape};
  bin.contact = lively(1.0);
  return bin;
}

belief::SceneObject dropped(const std::string& name, int model, const geometry::Vector3d& position) {
  belief::NormalPose pose;
  pose.mean = Pose::from_translation(position);
  geometry::Vector6d deviations;
  deviations << 0.0, 0.0, 0.0, 2e-3, 2e-3, 1e-3;
  pose.covariance = deviations.cwiseAbs2().asDiagonal();
  belief::SceneObject object;
  object.name = name;
  object.model = model;
  object.pose = pose;
  // Still for a moment when certificates are looked for.
  object.twist.linear = belief::Vector3Distribution::fixed({0.0, 0.0, 9.81 / 60.0});
  return object;
}

/// A light ball above a heavy one that falls half a metre in a bin of triangles: the light one is shot out of the bin.
/// Nothing but the bin is there.
belief::Scene cannon() {
  belief::Scene scene;
  scene.name = "cannon";
  scene.models = {ball("heavy", 0.04, 1.0), ball("light", 0.02, 0.01)};
  scene.supports = {mesh_bin()};
  scene.objects = {dropped("heavy", 0, {0.0, 0.0, 0.36}), dropped("light", 1, {0.003, 0.0, 0.425})};
  scene.duration = 2.0;
  const belief::InsideVolume hollow{Pose::from_translation({0.0, 0.0, 0.5 * kDepth}),
                                    {2.0 * kRadius, 2.0 * kRadius, kDepth}};
  scene.exclusive_outcomes = {{"light_ends", {{"in", "light", {belief::Condition{hollow}}}}}};
  return scene;
}

TEST(CertifiedEnergy, OfWhatFallsIntoABinIsThereForTheOthers) {
  const Problem problem(std::make_shared<const belief::Scene>(cannon()));
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  ASSERT_TRUE(certifier);
  const OutcomeEstimate whole = problem.run_exactly(64, nullptr, 0.0);
  const OutcomeEstimate certified = problem.run_exactly(64, certifier.get(), 0.0);
  EXPECT_LT(whole.variables[0].classes[0].probability, 0.5);  // or the scene shows nothing
  EXPECT_EQ(classed_otherwise(certified, whole), 0);
}

/// Two cartons, one after the other, over the rim of a bin of boxes on a floor.
TEST(CertifiedEnergy, OfSeveralFallingOverAFloorLeavesCertificates) {
  auto scene = std::make_shared<belief::Scene>(tests::carton_over_bin());
  belief::SceneObject second = scene->objects[0];
  second.name = "second";
  std::get<belief::NormalPose>(second.pose).mean.translation += geometry::Vector3d(-0.05, 0.02, 0.15);
  scene->objects.push_back(second);
  const Problem problem(scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
#ifdef NDEBUG
  const int count = 500;
#else
  const int count = 40;
#endif
  const OutcomeEstimate whole = problem.run_exactly(count, nullptr, 0.0);
  const OutcomeEstimate certified = problem.run_exactly(count, certifier.get(), 0.0);
  EXPECT_EQ(classed_otherwise(certified, whole), 0);
  EXPECT_GE(certified.certificates.certified, count * 6 / 10);
}

}  // namespace
}  // namespace prescene::simulation
