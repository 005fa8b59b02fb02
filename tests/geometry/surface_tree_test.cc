// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/surface_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"

namespace prescene::geometry {
namespace {

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

}  // namespace
}  // namespace prescene::geometry
