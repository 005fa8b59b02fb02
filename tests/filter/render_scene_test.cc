// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/render_scene.h"

#include <gtest/gtest.h>

#include "filter_fixture.h"

namespace prescene::filter_tests {
namespace {

TEST(MeshCache, MakesAMeshOnceByAddressAndByContent) {
  MeshCache meshes(100);
  const auto sphere = std::make_shared<const geometry::TriangleMesh>(geometry::make_mesh(geometry::Sphere{0.1}, 32));
  const auto twin = std::make_shared<const geometry::TriangleMesh>(*sphere);
  const auto fine = meshes.get(sphere, MeshDetail::kDisplay);
  const auto coarse = meshes.get(sphere, MeshDetail::kLikelihood);
  EXPECT_EQ(fine, meshes.get(sphere, MeshDetail::kDisplay));
  EXPECT_EQ(fine, meshes.get(twin, MeshDetail::kDisplay));
  EXPECT_NE(fine, coarse);
  EXPECT_EQ(fine->triangles.size(), sphere->triangles.size());
  EXPECT_LE(coarse->triangles.size(), 100u);
  EXPECT_GT(coarse->triangles.size(), 20u);
}

TEST(MeshCache, ScansAreDrawnCoarserAndNearlyTheSame) {
  MeshCache meshes;
  const auto scan = std::make_shared<const geometry::TriangleMesh>(geometry::make_mesh(geometry::Sphere{0.1}, 200));
  ASSERT_GT(scan->triangles.size(), 30000u);
  const std::pair<MeshDetail, std::size_t> levels[] = {
      {MeshDetail::kSurroundings, 20000}, {MeshDetail::kFine, 2000}, {MeshDetail::kLikelihood, 400}};
  for (const auto& [detail, most] : levels) {
    const auto mesh = meshes.get(scan, detail);
    EXPECT_LE(mesh->triangles.size(), most);
    EXPECT_GT(2 * mesh->triangles.size(), most);
    // A ball in n triangles is about 2 pi / (sqrt(3) n) of its radius off at their middles.
    const double off = 0.1 * 8.0 / static_cast<double>(most);
    for (const auto& vertex : mesh->vertices)
      EXPECT_NEAR(static_cast<double>(vertex.norm()), 0.1, std::max(off, 2e-5)) << most;
  }
  const auto few = std::make_shared<const geometry::TriangleMesh>(geometry::make_mesh(geometry::Sphere{0.1}, 32));
  EXPECT_EQ(meshes.get(few, MeshDetail::kSurroundings)->triangles.size(), few->triangles.size());
}

TEST(MeshCache, FallsBackToTheCollisionShapes) {
  MeshCache meshes;
  const std::vector<belief::CollisionShape> shapes = {
      belief::PrimitiveShape{geometry::BoxShape{Vector3d(0.1, 0.2, 0.3)}, Pose::from_translation({1.0, 0.0, 0.0})}};
  const auto mesh = meshes.get(nullptr, shapes, MeshDetail::kLikelihood);
  EXPECT_EQ(mesh, meshes.get(nullptr, shapes, MeshDetail::kLikelihood));
  EXPECT_NEAR(static_cast<double>(mesh->centre.x()), 1.0, 1e-6);
}

TEST(RenderScene, ListsObjectsThenSupportsThenRobot) {
  belief::Scene scene = *table_scene({box_model("a", {0.1, 0.1, 0.1}), box_model("b", {0.1, 0.1, 0.1})},
                                     {Pose::identity(), Pose::from_translation({0.3, 0.0, 0.0})}, 0.01, 0.01);
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::Sphere{0.05}, Pose::identity()});
  hand.timeline = {{0.0, Pose::identity()}, {2.0, Pose::from_translation({0.0, 0.0, 1.0})}};
  scene.robot.push_back(hand);
  belief::WorldState state = belief::mean_start(scene);
  state.time = 1.0;
  MeshCache meshes;
  const BeliefView view = render_scene(scene, state, {}, MeshDetail::kDisplay, meshes);
  EXPECT_EQ(view.names, (std::vector<std::string>{"a", "b", "table", "hand"}));
  EXPECT_EQ(view.kinds[1], InstanceKind::kObject);
  EXPECT_EQ(view.kinds[2], InstanceKind::kSupport);
  EXPECT_EQ(view.kinds[3], InstanceKind::kRobot);
  EXPECT_NEAR(view.scene.instances[3].X_WM.translation.z(), 0.5, 1e-12);
  EXPECT_NEAR(view.scene.instances[1].X_WM.translation.x(), 0.3, 1e-12);
}

TEST(RenderScene, OfABeliefLeavesOutWhatIsNotBelievedToBeThere) {
  Backends backends;
  const auto scene =
      table_scene({box_model("a", {0.1, 0.1, 0.1}), box_model("b", {0.1, 0.1, 0.1}), box_model("c", {0.1, 0.1, 0.1})},
                  {Pose::identity(), Pose::identity(), Pose::identity()}, 0.01, 0.01);
  belief::Belief belief = backends.make_filter().start(scene, 1);
  belief.objects[0].existence = 0.3;
  belief.objects[2].state = belief::TrackState::kLost;
  belief.objects[1].particles[3].log_weight = 0.0;
  const BeliefView view = render_scene(belief, MeshDetail::kLikelihood, backends.meshes);
  EXPECT_EQ(view.names, (std::vector<std::string>{"b", "table"}));
  EXPECT_EQ(view.scene.instances[0].X_WM, belief.objects[1].particles[3].X_WO);
}

TEST(MaterialOf, KeepsKindAndColour) {
  EXPECT_EQ(material_of(belief::SurfaceKind::kOpaque, {1.0, 0.0, 0.5}),
            rendering::SurfaceMaterial::opaque({255, 0, 128}));
  EXPECT_EQ(material_of(belief::SurfaceKind::kTransparent, {0.0, 0.0, 0.0}),
            rendering::SurfaceMaterial::transparent({0, 0, 0}));
}

}  // namespace
}  // namespace prescene::filter_tests
