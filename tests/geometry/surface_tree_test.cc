// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/surface_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"

namespace prescene::geometry {
namespace {

TriangleMesh box(double x, double y, double z) { return make_mesh(BoxShape{{x, y, z}}); }

TEST(SurfaceTree, NearestIsThatOfAllTriangles) {
  const TriangleMesh mesh = make_open_bin({0.2, 0.15, 0.1}, 0.01);
  const SurfaceTree tree(mesh);
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = 0.2 * normal_vector(stream);
    double least = HUGE_VAL;
    std::uint32_t first = 0;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const double squared = tree.place_in(t, p).squared_distance;
      if (squared < least) least = squared, first = t;
    }
    const auto hint = static_cast<std::uint32_t>(stream.uniform_below(mesh.triangles.size()));
    const SurfaceTree::Nearest found = tree.nearest(p, hint);
    EXPECT_EQ(found.place.squared_distance, least);
    EXPECT_EQ(found.triangle, first) << "of several the first, whatever the hint";
    const auto& t = mesh.triangles[found.triangle];
    const Vector3d place = found.place.weights[0] * mesh.vertices[t[0]] + found.place.weights[1] * mesh.vertices[t[1]] +
                           found.place.weights[2] * mesh.vertices[t[2]];
    EXPECT_NEAR((place - p).squaredNorm(), least, 1e-12);
    EXPECT_NEAR(found.place.weights.sum(), 1.0, 1e-12);
    EXPECT_GE(found.place.weights.minCoeff(), 0.0);
    EXPECT_TRUE(tree.is_within(p, std::sqrt(least) * (1.0 + 1e-9)));
    EXPECT_FALSE(tree.is_within(p, std::sqrt(least) * (1.0 - 1e-9)));
  }
}

TEST(SurfaceDistance, OfNestedBoxesIsKnown) {
  const TriangleMesh inner_mesh = box(0.2, 0.2, 0.2), outer_mesh = box(0.24, 0.24, 0.24);
  const SurfaceTree inner(inner_mesh), outer(outer_mesh);
  // From the inner surface it is 20 mm straight out, everywhere but for rounding; from the outer one's corners more.
  const double out = largest_distance(inner_mesh, outer, 0.01), in = largest_distance(outer_mesh, inner, 0.01);
  EXPECT_GE(out, 0.02 - 1e-12);
  EXPECT_LE(out, 0.02 * 1.01 + 1e-4 * 0.36);
  EXPECT_GE(in, 0.02 * std::sqrt(3.0) - 1e-12);
  EXPECT_LE(in, 0.02 * std::sqrt(3.0) * 1.01 + 1e-4 * 0.42);
  EXPECT_EQ(surface_distance(inner, outer, 0.01), std::max(in, out));
  EXPECT_LE(surface_distance(inner, inner, 0.01), 1e-4 * 0.36);
}

TEST(SurfaceDistance, IsFoundWithinTrianglesToo) {
  // All corners of the large triangle lie on the other surface; its middle is above a pit.
  TriangleMesh plain;
  plain.vertices = {{-1, -1, 0}, {3, -1, 0}, {-1, 3, 0}};
  plain.triangles = {{0, 1, 2}};
  TriangleMesh pit = plain;
  pit.vertices.push_back({0.0, 0.0, -0.5});
  pit.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const double found = largest_distance(plain, SurfaceTree(pit), 0.01);
  double sampled = 0.0;
  const SurfaceTree tree(pit);
  for (const SurfacePoint& p : sample_surface(plain, 200'000, 3))
    sampled = std::max(sampled, std::sqrt(tree.nearest(p.position).place.squared_distance));
  EXPECT_GT(sampled, 0.3);
  EXPECT_GE(found, sampled);
  EXPECT_LE(found, sampled * 1.02);
}

TEST(SurfaceDistance, IsABoundThatIsNearlyMet) {
  const TriangleMesh fine = make_mesh(Sphere{0.1}, 48);
  const SurfaceTree fine_tree(fine);
  for (const int triangles : {40, 100, 300}) {
    const TriangleMesh coarse = simplified(fine, triangles);
    const SurfaceTree coarse_tree(coarse);
    const double bound = surface_distance(fine_tree, coarse_tree, 0.1);
    double sampled = 0.0;
    for (const SurfacePoint& p : sample_surface(fine, 50'000, 5))
      sampled = std::max(sampled, coarse_tree.nearest(p.position).place.squared_distance);
    for (const SurfacePoint& p : sample_surface(coarse, 50'000, 6))
      sampled = std::max(sampled, fine_tree.nearest(p.position).place.squared_distance);
    EXPECT_GE(bound, std::sqrt(sampled));
    EXPECT_LE(bound, 1.2 * std::sqrt(sampled)) << "0.1 of it is allowed, the rest is what no sample found";
  }
}

}  // namespace
}  // namespace prescene::geometry
