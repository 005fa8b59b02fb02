// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/refine.h"
#include "prescene/geometry/sampling.h"
#include "prescene/geometry/triangle_mesh.h"
#include "tests/support/generators.h"

namespace prescene::geometry::mesh_laws_test {
namespace {

using tests::closed_meshes;
using tests::poses;

double size_of(const TriangleMesh& mesh) { return bounding_box(mesh).sizes().maxCoeff(); }

TEST(MeshLaws, GeneratedMeshesAreClosedAndTurnedOutwards) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const MeshTopology topology = mesh_topology(mesh);
    RC_ASSERT(topology.watertight() && topology.oriented() && topology.bounds_volume());
    RC_ASSERT(topology.components == 1);
    RC_ASSERT(signed_volume(mesh) > 0.0);
  }));
}

TEST(MeshLaws, RigidMotionsKeepAreaVolumeAndRadius) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const Pose X = *poses();
    const TriangleMesh moved = transformed(mesh, X);
    const double size = size_of(mesh);
    RC_ASSERT(std::abs(surface_area(moved) - surface_area(mesh)) < 1e-12 * size * size);
    RC_ASSERT(std::abs(signed_volume(moved) - signed_volume(mesh)) < 1e-12 * size * size * size);
    const Vector3d q = *tests::vectors();
    RC_ASSERT(std::abs(radius_about(moved, X * q) - radius_about(mesh, q)) < 1e-12);
  }));
}

TEST(MeshLaws, RepairIsIdempotentWhateverTheInput) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    // A closed mesh with damage: indices changed, vertices made NaN, merged or put into a line.
    TriangleMesh mesh = *closed_meshes();
    core::RandomStream stream(seed, core::Purpose::kTest);
    const auto any = [&](std::size_t count) { return static_cast<std::uint32_t>(stream.uniform_below(count)); };
    for (int i = *rc::gen::inRange(0, 8); i > 0; --i) {
      const std::uint32_t v = any(mesh.vertices.size());
      const std::uint32_t w = any(mesh.vertices.size());
      auto& triangle = mesh.triangles[any(mesh.triangles.size())];
      switch (any(5)) {
        case 0:
          triangle[any(3)] = any(2 * mesh.vertices.size());
          break;
        case 1:
          mesh.vertices[v].x() = std::numeric_limits<double>::quiet_NaN();
          break;
        case 2:
          mesh.vertices[v] = mesh.vertices[w];
          break;
        case 3:
          mesh.triangles.push_back(triangle);
          break;
        default:
          if (triangle[2] < mesh.vertices.size() && triangle[0] < mesh.vertices.size() &&
              triangle[1] < mesh.vertices.size()) {
            mesh.vertices[triangle[2]] = 0.5 * (mesh.vertices[triangle[0]] + mesh.vertices[triangle[1]]);
          }
      }
    }
    MeshRepairReport report;
    const auto once = repair_mesh(mesh, &report);
    RC_PRE(once.ok());
    for (const auto& t : once->triangles) {
      RC_ASSERT(std::max({t[0], t[1], t[2]}) < once->vertices.size());
      RC_ASSERT(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    }
    RC_ASSERT(
        std::all_of(once->vertices.begin(), once->vertices.end(), [](const Vector3d& p) { return p.allFinite(); }));
    const auto twice = repair_mesh(*once, &report);
    RC_ASSERT(twice.ok());
    RC_ASSERT(*twice == *once);
  }));
}

TEST(MeshLaws, ComponentsAddUp) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh a = *closed_meshes();
    const TriangleMesh b = transformed(*closed_meshes(), Pose::from_translation({20.0, 0.0, 0.0}));
    const TriangleMesh both = joined(a, b);
    RC_ASSERT(std::abs(surface_area(both) - surface_area(a) - surface_area(b)) < 1e-10);
    const auto parts = connected_components(both);
    RC_ASSERT(parts.size() == 2);
    RC_ASSERT(parts[0] == a);
    RC_ASSERT(parts[1] == b);
  }));
}

// Height of the farthest of some points above the planes of a mesh, and whether the mesh is convex.
double farthest_outside(const TriangleMesh& hull, const std::vector<Vector3d>& points) {
  double worst = -HUGE_VAL;
  for (const auto& t : hull.triangles) {
    const Vector3d& a = hull.vertices[t[0]];
    const Vector3d normal = (hull.vertices[t[1]] - a).cross(hull.vertices[t[2]] - a).normalized();
    for (const Vector3d& p : points) worst = std::max(worst, normal.dot(p - a));
  }
  return worst;
}

// Random points of different kinds: in a ball, on a sphere, on a grid (many in a plane), on a turned grid, clustered.
std::vector<Vector3d> point_cloud(int kind, int count, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  const Quaterniond turn = uniform_rotation(stream);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    switch (kind) {
      case 0:
        points.push_back(normal_vector(stream));
        break;
      case 1:
        points.push_back(uniform_direction(stream));
        break;
      case 2:
      case 3: {
        Vector3d p;
        for (int k = 0; k < 3; ++k) p[k] = 0.1 * static_cast<double>(stream.uniform_below(4));
        points.push_back(kind == 2 ? p : turn * p);
        break;
      }
      default: {
        const Vector3d direction = uniform_direction(stream);
        points.push_back(std::pow(10.0, stream.uniform(-9.0, 0.0)) * direction);
      }
    }
  }
  return points;
}

rc::Gen<std::vector<Vector3d>> point_clouds() {
  return rc::gen::map(
      rc::gen::tuple(rc::gen::inRange(0, 5), rc::gen::inRange(4, 300), rc::gen::arbitrary<std::uint64_t>()),
      [](const std::tuple<int, int, std::uint64_t>& v) {
        return point_cloud(std::get<0>(v), std::get<1>(v), std::get<2>(v));
      });
}

TEST(ConvexHullLaws, HoldsAllPointsAndIsClosedAndConvex) {
  EXPECT_TRUE(tests::check_law([] {
    const std::vector<Vector3d> points = *point_clouds();
    const auto hull = convex_hull(points);
    RC_PRE(hull.ok());
    const MeshTopology topology = mesh_topology(*hull);
    RC_ASSERT(topology.watertight() && topology.oriented() && topology.components == 1);
    RC_ASSERT(signed_volume(*hull) > 0.0);
    // Euler's formula of a sphere: V - E + F = 2 with E = 3 F / 2.
    RC_ASSERT(2 * hull->vertices.size() == hull->triangles.size() + 4);
    RC_ASSERT(farthest_outside(*hull, points) < 1e-8 * size_of(*hull));
    RC_ASSERT(std::all_of(hull->vertices.begin(), hull->vertices.end(), [&](const Vector3d& v) {
      return std::find(points.begin(), points.end(), v) != points.end();
    }));
  }));
}

TEST(ConvexHullLaws, DependsOnTheSetOfPointsOnly) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    std::vector<Vector3d> points = *point_clouds();
    const auto hull = convex_hull(points);
    RC_PRE(hull.ok());
    core::RandomStream(seed, core::Purpose::kTest).shuffle(std::span(points));
    points.push_back(points.front());
    const auto again = convex_hull(points);
    RC_ASSERT(again.ok());
    RC_ASSERT(*again == *hull);
  }));
}

TEST(ConvexHullLaws, HullOfAHullIsTheHull) {
  EXPECT_TRUE(tests::check_law([] {
    const auto hull = convex_hull(*point_clouds());
    RC_PRE(hull.ok());
    const auto again = convex_hull(hull->vertices);
    RC_ASSERT(again.ok());
    RC_ASSERT(*again == *hull);
  }));
}

TEST(ConvexHullLaws, MovesWithThePoints) {
  EXPECT_TRUE(tests::check_law([] {
    const std::vector<Vector3d> points = *point_clouds();
    const auto hull = convex_hull(points);
    RC_PRE(hull.ok());
    const Pose X = *poses();
    std::vector<Vector3d> moved = points;
    for (Vector3d& p : moved) p = X * p;
    const auto moved_hull = convex_hull(moved);
    RC_ASSERT(moved_hull.ok());
    const double volume = signed_volume(*hull);
    RC_ASSERT(std::abs(signed_volume(*moved_hull) - volume) < 1e-7 * std::pow(size_of(*hull), 3));
  }));
}

TEST(ConvexHull, CornersOnlyOfAGrid) {
  for (const bool turned : {false, true}) {
    std::vector<Vector3d> points;
    const Quaterniond turn = turned ? exp_rotation({0.3, -0.8, 0.5}) : Quaterniond::Identity();
    for (int i = 0; i < 6 * 7 * 8; ++i)
      points.push_back(turn * Vector3d(0.1 * (i % 6), 0.1 * (i / 6 % 7), 0.1 * (i / 42)));
    const auto hull = convex_hull(points);
    ASSERT_TRUE(hull.ok());
    EXPECT_EQ(hull->vertices.size(), 8U);
    EXPECT_EQ(hull->triangles.size(), 12U);
    EXPECT_NEAR(signed_volume(*hull), 0.5 * 0.6 * 0.7, 1e-12);
  }
}

TEST(ConvexHull, FlatInputIsAnError) {
  core::RandomStream stream(1, core::Purpose::kTest);
  const Quaterniond turn = uniform_rotation(stream);
  std::vector<Vector3d> plane, line;
  for (int i = 0; i < 50; ++i) {
    Vector3d p = normal_vector(stream);
    p.z() = 0.7;
    plane.push_back(turn * p);
    line.push_back(turn * Vector3d(p.x(), 0.1, 0.2));
  }
  EXPECT_EQ(convex_hull(plane).status().code(), core::StatusCode::kInvalidInput);
  EXPECT_FALSE(convex_hull(line).ok());
  EXPECT_FALSE(convex_hull({}).ok());
  EXPECT_FALSE(convex_hull(std::vector<Vector3d>(5, Vector3d(1.0, 2.0, 3.0))).ok());
  plane.emplace_back(std::nan(""), 0.0, 0.0);
  EXPECT_FALSE(convex_hull(plane).ok());
}

TEST(SimplifiedLaws, KeepsClosedSurfacesClosed) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const int wanted = *rc::gen::inRange(4, 200);
    const TriangleMesh coarse = simplified(mesh, wanted);
    RC_ASSERT(coarse.triangles.size() <= static_cast<std::size_t>(wanted));
    RC_ASSERT(mesh_topology(coarse).bounds_volume());
    if (mesh.triangles.size() <= static_cast<std::size_t>(wanted)) RC_ASSERT(coarse == mesh);
    RC_ASSERT(simplified(mesh, wanted) == coarse);
    // No vertex leaves the neighbourhood of the mesh.
    const double size = size_of(mesh);
    Box box = bounding_box(mesh);
    box.extend(Vector3d(box.min() - Vector3d::Constant(0.2 * size)));
    box.extend(Vector3d(box.max() + Vector3d::Constant(0.2 * size)));
    for (const Vector3d& p : coarse.vertices) RC_ASSERT(box.contains(p));
  }));
}

TEST(MeshLaws, RefiningKeepsTheSurfaceAndItsSeamsAndMakesNoSlivers) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const double size = size_of(mesh);
    const double longest = 0.01 * *rc::gen::inRange(15, 120) * size;
    const std::size_t most = 20000;
    const TriangleMesh fine = refined(mesh, longest, most);
    RC_ASSERT(fine.triangles.size() <= std::max(most, mesh.triangles.size()));
    RC_ASSERT(mesh_topology(fine).watertight() && mesh_topology(fine).oriented());
    RC_ASSERT(std::abs(surface_area(fine) - surface_area(mesh)) < 1e-12 * size * size);
    RC_ASSERT(std::abs(signed_volume(fine) - signed_volume(mesh)) < 1e-12 * size * size * size);
    // Halving edges makes angles smaller, but no triangle without area out of one that has some.
    const auto least_area = [](const TriangleMesh& m) {
      double least = std::numeric_limits<double>::infinity();
      for (const auto& t : m.triangles) {
        const Vector3d& a = m.vertices[t[0]];
        least = std::min(least, (m.vertices[t[1]] - a).cross(m.vertices[t[2]] - a).norm());
      }
      return least;
    };
    const double pieces = static_cast<double>(fine.triangles.size());
    RC_ASSERT(least_area(fine) > 0.1 * least_area(mesh) / (pieces * pieces));
    for (const auto& t : fine.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        RC_ASSERT((fine.vertices[t[k]] - fine.vertices[t[(k + 1) % 3]]).norm() <= longest);
      }
    }
  }));
}

TEST(Simplified, KeepsTheShapeOfAFineSphere) {
  const TriangleMesh sphere = make_mesh(Sphere{0.5}, 96);
  ASSERT_GT(sphere.triangles.size(), 8000U);
  const TriangleMesh coarse = simplified(sphere, 400);
  EXPECT_LE(coarse.triangles.size(), 400U);
  EXPECT_TRUE(mesh_topology(coarse).watertight());
  EXPECT_TRUE(mesh_topology(coarse).oriented());
  // An even triangulation of 400 triangles lies within about 2 % of the radius of the sphere.
  for (const Vector3d& p : coarse.vertices) EXPECT_NEAR(p.norm(), 0.5, 0.01);
  EXPECT_NEAR(signed_volume(coarse) / signed_volume(sphere), 1.0, 0.02);
}

TEST(Simplified, FlatSidesCostNothing) {
  // A box whose sides are cut into 16 x 16 squares comes back as a box.
  TriangleMesh box;
  constexpr int kSteps = 16;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const double sign = side % 2 == 0 ? 1.0 : -1.0;
    const auto first = static_cast<std::uint32_t>(box.vertices.size());
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        Vector3d p;
        p[axis] = sign;
        p[(axis + 1) % 3] = sign * (2.0 * i / kSteps - 1.0);
        p[(axis + 2) % 3] = 2.0 * j / kSteps - 1.0;
        box.vertices.push_back(p.cwiseProduct(Vector3d(0.3, 0.2, 0.1)));
      }
    }
    for (std::uint32_t i = 0; i < kSteps; ++i) {
      for (std::uint32_t j = 0; j < kSteps; ++j) {
        const std::uint32_t a = first + i * (kSteps + 1) + j;
        const std::uint32_t b = a + kSteps + 1;
        box.triangles.push_back({a, b, b + 1});
        box.triangles.push_back({a, b + 1, a + 1});
      }
    }
  }
  const auto closed = repair_mesh(box, nullptr);
  ASSERT_TRUE(closed.ok());
  ASSERT_TRUE(mesh_topology(*closed).watertight());
  ASSERT_NEAR(signed_volume(*closed), 8.0 * 0.006, 1e-12);
  const TriangleMesh coarse = simplified(*closed, 60);
  EXPECT_LE(coarse.triangles.size(), 60U);
  EXPECT_NEAR(signed_volume(coarse) / signed_volume(*closed), 1.0, 0.01);
  EXPECT_NEAR(surface_area(coarse) / surface_area(*closed), 1.0, 0.01);
}

TEST(Simplified, KeepsTheBorderOfAnOpenSurface) {
  TriangleMesh sheet;
  constexpr std::uint32_t kSteps = 20;
  for (std::uint32_t i = 0; i <= kSteps; ++i) {
    for (std::uint32_t j = 0; j <= kSteps; ++j) sheet.vertices.emplace_back(0.05 * i, 0.05 * j, 0.0);
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    for (std::uint32_t j = 0; j < kSteps; ++j) {
      const std::uint32_t a = i * (kSteps + 1) + j;
      sheet.triangles.push_back({a, a + kSteps + 1, a + kSteps + 2});
      sheet.triangles.push_back({a, a + kSteps + 2, a + 1});
    }
  }
  const TriangleMesh coarse = simplified(sheet, 20);
  EXPECT_LE(coarse.triangles.size(), 20U);
  EXPECT_NEAR(surface_area(coarse), 1.0, 0.01);
}

}  // namespace
}  // namespace prescene::geometry::mesh_laws_test
