// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/shape_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/primitives.h"

namespace prescene::tests {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;
using simulation::ConvexPolytope;

TriangleMesh box_mesh(const Vector3d& size) { return geometry::make_mesh(geometry::BoxShape{size}); }
belief::MeshPtr shared(TriangleMesh mesh) { return std::make_shared<const TriangleMesh>(std::move(mesh)); }

TEST(ConvexPolytopeOf, BoxHasSixFacesOfFourCorners) {
  const auto polytope = simulation::make_polytope(box_mesh({0.1, 0.2, 0.3}).vertices);
  ASSERT_TRUE(polytope.ok());
  EXPECT_EQ(polytope->vertices.size(), 8u);
  ASSERT_EQ(polytope->faces.size(), 6u);
  for (const ConvexPolytope::Face& face : polytope->faces) {
    ASSERT_EQ(face.loop.size(), 4u);
    // Counter-clockwise from outside.
    const Vector3d& a = polytope->vertices[face.loop[0]];
    const Vector3d& b = polytope->vertices[face.loop[1]];
    const Vector3d& c = polytope->vertices[face.loop[2]];
    EXPECT_GT((b - a).cross(c - b).dot(face.normal), 0.0);
  }
  EXPECT_NEAR(polytope->inner_radius(), 0.05, 1e-12);
}

TEST(ConvexPolytopeOf, FlatPointsAreRefused) {
  EXPECT_EQ(simulation::make_polytope({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}).status().code(),
            core::StatusCode::kInvalidInput);
}

TEST(Inset, MovesEveryFaceInwardsByTheDistance) {
  const TriangleMesh carton = geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2);
  const auto polytope = simulation::make_polytope(carton.vertices);
  ASSERT_TRUE(polytope.ok());
  const double r = 0.003;
  const auto smaller = simulation::inset(*polytope, r);
  ASSERT_TRUE(smaller.has_value());
  for (const ConvexPolytope::Face& face : polytope->faces) {
    double highest = -1.0;
    for (const Vector3d& v : smaller->vertices) highest = std::max(highest, face.normal.dot(v));
    EXPECT_LE(highest, face.offset - r + 1e-9);
    const bool kept = std::any_of(smaller->faces.begin(), smaller->faces.end(), [&](const ConvexPolytope::Face& f) {
      return f.normal.dot(face.normal) > 1.0 - 1e-6;
    });
    if (kept) {
      EXPECT_NEAR(highest, face.offset - r, 1e-9);
    }
  }
  EXPECT_FALSE(simulation::inset(*polytope, polytope->inner_radius()).has_value());
}

TEST(ShapeStore, MakesEachShapeOnceForAllThreads) {
  std::atomic<int> calls{0};
  simulation::ShapeStore store([&](const TriangleMesh& mesh, const simulation::DecompositionSettings&) {
    ++calls;
    return core::Result<std::vector<TriangleMesh>>(std::vector<TriangleMesh>{mesh});
  });
  const belief::MeshPtr mesh = shared(box_mesh({0.1, 0.1, 0.1}));
  std::vector<std::shared_ptr<const simulation::ConvexParts>> parts(8);
  std::vector<std::thread> threads;
  for (auto& part : parts) {
    threads.emplace_back([&] { part = *store.convex_parts(mesh, belief::MeshUse::kDecompose, {}); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& part : parts) EXPECT_EQ(part, parts[0]);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(store.built(), 1u);
  simulation::DecompositionSettings other;
  other.concavity = 0.05;
  EXPECT_NE(*store.convex_parts(mesh, belief::MeshUse::kDecompose, other), parts[0]);
  EXPECT_NE(*store.convex_parts(shared(box_mesh({0.1, 0.1, 0.2})), belief::MeshUse::kDecompose, {}), parts[0]);
}

TEST(ShapeStore, KeepsWhatAStepperMakesOfAMesh) {
  simulation::ShapeStore store;
  const auto make = [] { return core::Result<simulation::ShapeStore::Made>(std::make_shared<const int>(7)); };
  const auto first = *store.made(shared(box_mesh({0.1, 0.1, 0.1})), 1, make);
  EXPECT_EQ(*std::static_pointer_cast<const int>(first), 7);
  EXPECT_EQ(*store.made(shared(box_mesh({0.1, 0.1, 0.1})), 1, make), first);
  EXPECT_NE(*store.made(shared(box_mesh({0.1, 0.1, 0.1})), 2, make), first);
  EXPECT_NE(*store.made(shared(box_mesh({0.1, 0.1, 0.2})), 1, make), first);
  EXPECT_EQ(store.built(), 3u);
  const auto fails = [] { return core::Result<simulation::ShapeStore::Made>(core::unsupported("too thin")); };
  EXPECT_EQ(store.made(shared(box_mesh({0.1, 0.1, 0.1})), 3, fails).status().message(), "too thin");
}

TEST(ShapeStore, ConvexPartsAreTheComponents) {
  simulation::ShapeStore store;
  const belief::MeshPtr two = shared(geometry::joined(
      box_mesh({0.1, 0.1, 0.1}),
      geometry::transformed(box_mesh({0.1, 0.1, 0.1}), geometry::Pose::from_translation({0.5, 0.0, 0.0}))));
  EXPECT_EQ((*store.convex_parts(two, belief::MeshUse::kConvexParts, {}))->size(), 2u);
  EXPECT_EQ((*store.convex_parts(two, belief::MeshUse::kConvexHull, {}))->size(), 1u);
}

TEST(ShapeStore, AHullOfAScanHasFewVerticesAndIsNearlyTheWholeHull) {
  simulation::ShapeStore store;
  // Round all over, and round between two flat faces of 3000 corners.
  const TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.05}, 200);
  const TriangleMesh can = geometry::make_mesh(geometry::Cylinder{0.03, 0.1}, 3000);
  // As flat as a piece of soap: nearly all of its normals point up or down, and few of 1000 directions meet its sides.
  TriangleMesh flat = ball;
  for (Vector3d& vertex : flat.vertices) vertex.z() *= 0.1;
  for (const TriangleMesh& scan : {ball, can, flat}) {
    ASSERT_GT(scan.vertices.size(), 5000u);
    const auto parts = *store.convex_parts(shared(scan), belief::MeshUse::kConvexHull, {});
    ASSERT_EQ(parts->size(), 1u);
    EXPECT_LE(parts->front().vertices.size(), 2000u);
    double highest = 0.0;
    for (const ConvexPolytope::Face& face : parts->front().faces)
      for (const Vector3d& v : scan.vertices) highest = std::max(highest, face.normal.dot(v) - face.offset);
    EXPECT_LT(highest, 0.002 * geometry::bounding_box(scan).diagonal().norm());
    EXPECT_NEAR(parts->front().left_out, highest, 1e-9);
  }
  const auto parts = *store.convex_parts(shared(can), belief::MeshUse::kConvexHull, {});
  for (const double up : {-1.0, 1.0})
    EXPECT_TRUE(std::any_of(parts->front().faces.begin(), parts->front().faces.end(), [&](const auto& face) {
      return up * face.normal.z() > 1.0 - 1e-9 && face.loop.size() >= 32;
    })) << up;
}

TEST(ShapeStore, SaysWhatItCannotDo) {
  simulation::ShapeStore store;
  const belief::MeshPtr mesh = shared(box_mesh({0.1, 0.1, 0.1}));
  EXPECT_EQ(store.convex_parts(mesh, belief::MeshUse::kDecompose, {}).status().code(), core::StatusCode::kUnsupported);
  EXPECT_EQ(store.convex_parts(mesh, belief::MeshUse::kSurface, {}).status().code(), core::StatusCode::kUnsupported);
  EXPECT_EQ(store.static_mesh(shared({})).status().code(), core::StatusCode::kInvalidInput);
}

TEST(StaticMesh, OnlyRidgesAndBordersCanBeFelt) {
  simulation::ShapeStore store;
  // All twelve edges of a box are ridges, the six diagonals are not.
  const auto box = *store.static_mesh(shared(box_mesh({0.1, 0.1, 0.1})));
  int ridges = 0;
  for (const std::uint8_t bits : box->ridges) ridges += (bits & 1) + (bits >> 1 & 1) + (bits >> 2 & 1);
  EXPECT_EQ(ridges, 24);  // each from both sides
  // Turned inside out, all edges are valleys.
  TriangleMesh inside_out = box_mesh({0.1, 0.1, 0.1});
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  for (const std::uint8_t bits : (*store.static_mesh(shared(inside_out)))->ridges) EXPECT_EQ(bits, 0);
}

}  // namespace
}  // namespace prescene::tests
