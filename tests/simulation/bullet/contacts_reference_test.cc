// SPDX-License-Identifier: Apache-2.0
// Where things have come to rest, FCL must find those touching that the simulator says touch, and none overlapping.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "bullet_scenes.h"
#include "prescene/geometry/sampling.h"
#include "tests/peers/hull_distance.h"

namespace prescene::tests {
namespace {

// Contacts are pushed out until this much overlap is left, and hulls of 32 segments stand for round bodies' outlines.
constexpr double kTouching = 5e-4;  // m

/// Boxes, a carton's hull and a prism, dropped one after the other into a corner so that they end in a heap.
Scene heap_scene() {
  Scene scene;
  scene.name = "heap";
  scene.supports.push_back(floor_support());
  const auto hull = [](const geometry::TriangleMesh& mesh) {
    return belief::MeshShape{std::make_shared<const geometry::TriangleMesh>(mesh), Pose{},
                             belief::MeshUse::kConvexHull};
  };
  const auto prism = geometry::make_mesh(geometry::Cylinder{0.05, 0.09}, 8);
  add_object(scene, primitive_model("slab", geometry::BoxShape{{0.2, 0.15, 0.04}}), "slab");
  add_object(scene, model_of("prism", {hull(prism)}), "prism");
  add_object(scene, model_of("carton", {hull(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2))}), "carton");
  add_object(scene, primitive_model("cube", geometry::BoxShape{{0.06, 0.06, 0.06}}), "cube");
  return scene;
}

geometry::TriangleMesh hull_of(const std::vector<belief::CollisionShape>& shapes) {
  return *geometry::convex_hull(belief::collision_mesh(shapes).vertices);
}

TEST(ContactsAtRest, AreThoseThatFclFinds) {
  const Scene scene = heap_scene();
  const auto simulator = simulator_of(scene);
  std::vector<geometry::TriangleMesh> hulls;
  for (const belief::SceneObject& object : scene.objects) hulls.push_back(hull_of(scene.model_of(object).collision));
  hulls.push_back(hull_of(scene.supports[0].collision));
  core::RandomStream stream(5, core::Purpose::kTest);
  int touching = 0, at_rest = 0;
  double deepest = 0.0, widest = 0.0;
  for (int heap = 0; heap < 40; ++heap) {
    WorldState start = start_of(scene);
    for (std::size_t i = 0; i < start.objects.size(); ++i) {
      start.objects[i].X_WO = {geometry::uniform_rotation(stream), {0.0, 0.0, 0.15 + 0.25 * static_cast<double>(i)}};
    }
    simulation::RunRequest request;
    request.stop.duration = 6.0;
    const belief::Trajectory run = run_one(*simulator, start, request);
    if (run.end != belief::TrajectoryEnd::kAtRest) continue;
    ++at_rest;
    std::vector<PlacedHull> placed;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) placed.push_back({&hulls[i], run.final().objects[i].X_WO});
    placed.push_back({&hulls.back(), scene.supports[0].X_WS});
    std::set<std::pair<int, int>> contacts;
    for (const auto& [a, b] : run.final_contacts) contacts.insert(std::minmax(a, b));
    for (int a = 0; a < std::ssize(placed); ++a) {
      for (int b = a + 1; b < std::ssize(placed); ++b) {
        const double distance =
            hull_distance_by_fcl(placed[static_cast<std::size_t>(a)], placed[static_cast<std::size_t>(b)]);
        deepest = std::min(deepest, distance);
        EXPECT_GT(distance, -kTouching) << "heap " << heap << ", bodies " << a << " and " << b;
        if (!contacts.contains({a, b})) continue;
        ++touching;
        widest = std::max(widest, distance);
        EXPECT_LT(distance, kTouching) << "heap " << heap << ", bodies " << a << " and " << b;
      }
    }
  }
  std::printf("%d heaps at rest, %d contacts: deepest overlap %.3f mm, widest gap %.3f mm\n", at_rest, touching,
              -1e3 * deepest, 1e3 * widest);
  EXPECT_GE(at_rest, 30);
  EXPECT_GE(touching, 4 * at_rest);
}

}  // namespace
}  // namespace prescene::tests
