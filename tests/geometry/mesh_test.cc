// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/triangle_mesh.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "prescene/geometry/cancellable.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/matchers.h"

namespace prescene::geometry {
namespace {

using testing::HasSubstr;
using tests::is_near;

TriangleMesh unit_cube() { return make_mesh(BoxShape{{1.0, 1.0, 1.0}}); }

// Every triangle with corners of its own, as STL files have them.
TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TEST(MeshTopology, CubeIsClosed) {
  const MeshTopology topology = mesh_topology(unit_cube());
  EXPECT_TRUE(topology.watertight());
  EXPECT_TRUE(topology.oriented());
  EXPECT_TRUE(topology.bounds_volume());
  EXPECT_EQ(topology.components, 1);
}

TEST(MeshTopology, WeldsVerticesByPosition) {
  EXPECT_TRUE(mesh_topology(soup_of(unit_cube())).watertight());
  EXPECT_EQ(mesh_topology(soup_of(unit_cube())).components, 1);
}

TEST(MeshTopology, CountsWhatIsWrong) {
  TriangleMesh open = unit_cube();
  open.triangles.pop_back();
  EXPECT_EQ(mesh_topology(open).open_edges, 3);
  EXPECT_FALSE(mesh_topology(open).bounds_volume());

  TriangleMesh turned = unit_cube();
  std::swap(turned.triangles[4][0], turned.triangles[4][1]);
  EXPECT_TRUE(mesh_topology(turned).watertight());
  EXPECT_EQ(mesh_topology(turned).inconsistent_edges, 3);
  EXPECT_EQ(mesh_topology(turned).unbalanced_edges, 3);

  // Two cubes that share an edge: it has four triangles, but they still bound a volume.
  const TriangleMesh touching = joined(unit_cube(), transformed(unit_cube(), Pose::from_translation({1.0, 1.0, 0.0})));
  EXPECT_EQ(mesh_topology(soup_of(touching)).non_manifold_edges, 1);
  EXPECT_TRUE(mesh_topology(soup_of(touching)).bounds_volume());
  EXPECT_EQ(mesh_topology(soup_of(touching)).components, 1);
  // By their own indices they are two closed cubes.
  EXPECT_TRUE(mesh_topology(touching).watertight());
  EXPECT_EQ(mesh_topology(touching).components, 2);
  EXPECT_EQ(connected_components(touching).size(), 2U);

  const TriangleMesh apart = joined(unit_cube(), transformed(unit_cube(), Pose::from_translation({3.0, 0.0, 0.0})));
  EXPECT_EQ(mesh_topology(apart).components, 2);
}

TEST(ConnectedComponents, ComeInTheOrderOfTheirFirstTriangle) {
  const TriangleMesh cube = unit_cube();
  const TriangleMesh cone = transformed(make_mesh(Cone{0.5, 1.0}, 8), Pose::from_translation({4.0, 0.0, 0.0}));
  const auto parts = connected_components(joined(cube, cone));
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0], cube);
  EXPECT_EQ(parts[1], cone);
  EXPECT_EQ(connected_components(soup_of(cube)).size(), 1U);
  EXPECT_TRUE(connected_components(TriangleMesh{}).empty());
}

TEST(RepairMesh, LeavesAGoodMeshAlone) {
  MeshRepairReport report;
  const auto repaired = repair_mesh(unit_cube(), &report);
  ASSERT_TRUE(repaired.ok());
  EXPECT_EQ(*repaired, unit_cube());
  EXPECT_FALSE(report.changed());
  EXPECT_EQ(report.text(), "");
  EXPECT_TRUE(repair_mesh(unit_cube(), nullptr).ok());
}

TEST(RepairMesh, ReportsWhatItDropped) {
  TriangleMesh mesh = soup_of(unit_cube());
  mesh.vertices.emplace_back(std::nan(""), 0.0, 0.0);  // Vertex 36.
  mesh.vertices.emplace_back(5.0, 5.0, 5.0);           // Vertex 37, unused.
  mesh.triangles.push_back({0, 1, 36});                // NaN.
  mesh.triangles.push_back({0, 1, 999});               // Out of range.
  mesh.triangles.push_back({0, 0, 1});                 // Twice the same corner.
  MeshRepairReport report;
  const auto repaired = repair_mesh(mesh, &report);
  ASSERT_TRUE(repaired.ok());
  EXPECT_EQ(report.non_finite_vertices, 1);
  EXPECT_EQ(report.out_of_range_triangles, 1);
  EXPECT_EQ(report.degenerate_triangles, 1);
  EXPECT_EQ(report.duplicate_vertices, 28);
  EXPECT_EQ(report.unused_vertices, 1);
  EXPECT_TRUE(report.changed());
  EXPECT_THAT(report.text(), HasSubstr("1 vertices with NaN"));
  EXPECT_THAT(report.text(), HasSubstr("28 vertices at the same place made one"));
  EXPECT_EQ(repaired->vertices.size(), 8U);
  EXPECT_EQ(repaired->triangles.size(), 12U);
  EXPECT_NEAR(signed_volume(*repaired), 1.0, 1e-14);
}

TEST(RepairMesh, FlipsTheEdgeOfThreeCornersInALine) {
  // The cube's top is cut along a diagonal with a vertex in the middle of it that only one side uses: the gap is filled
  // by a triangle without area.
  TriangleMesh mesh = unit_cube();
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto top = mesh.triangles[10];  // {4, 5, 6}; its edge 6 -> 4 is the diagonal.
  mesh.vertices.push_back(0.5 * (mesh.vertices[top[0]] + mesh.vertices[top[2]]));
  mesh.triangles[10] = {top[0], top[1], middle};
  mesh.triangles.push_back({top[1], top[2], middle});
  mesh.triangles.push_back({top[0], middle, top[2]});
  ASSERT_TRUE(mesh_topology(mesh).watertight());
  MeshRepairReport report;
  const auto repaired = repair_mesh(mesh, &report);
  ASSERT_TRUE(repaired.ok());
  EXPECT_EQ(report.flipped_edges, 1);
  EXPECT_TRUE(mesh_topology(*repaired).watertight());
  EXPECT_TRUE(mesh_topology(*repaired).oriented());
  EXPECT_NEAR(signed_volume(*repaired), 1.0, 1e-14);
  EXPECT_NEAR(surface_area(*repaired), 6.0, 1e-13);
  for (const auto& t : repaired->triangles) {
    const Vector3d a = repaired->vertices[t[0]];
    EXPECT_GT((repaired->vertices[t[1]] - a).cross(repaired->vertices[t[2]] - a).norm(), 0.1);
  }
}

TEST(RepairMesh, DoesNotOpenASurfaceThatTouchesItself) {
  // Two closed cubes whose corners and an edge coincide: welding them would leave an edge with four triangles.
  const TriangleMesh touching = joined(unit_cube(), transformed(unit_cube(), Pose::from_translation({1.0, 1.0, 0.0})));
  MeshRepairReport report;
  const auto repaired = repair_mesh(touching, &report);
  ASSERT_TRUE(repaired.ok());
  EXPECT_FALSE(report.changed());
  EXPECT_TRUE(mesh_topology(*repaired).watertight());
}

TEST(RepairMesh, FailsWhenNothingIsLeft) {
  TriangleMesh line;
  line.vertices = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}};
  line.triangles = {{0, 1, 2}};
  MeshRepairReport report;
  const auto repaired = repair_mesh(line, &report);
  EXPECT_EQ(repaired.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(repaired.status().message(), HasSubstr("1 triangles without area"));
  EXPECT_EQ(report.degenerate_triangles, 1);
  EXPECT_FALSE(repair_mesh(TriangleMesh{}, nullptr).ok());
}

TEST(Mesh, BoxRadiusAndArea) {
  const TriangleMesh mesh = transformed(make_mesh(BoxShape{{2.0, 4.0, 6.0}}), Pose::from_translation({1.0, 0.0, 0.0}));
  EXPECT_THAT(bounding_box(mesh).min(), is_near(Vector3d(0.0, -2.0, -3.0), 1e-15));
  EXPECT_THAT(bounding_box(mesh).max(), is_near(Vector3d(2.0, 2.0, 3.0), 1e-15));
  EXPECT_NEAR(radius_about(mesh, {1.0, 0.0, 0.0}), std::sqrt(14.0), 1e-14);
  EXPECT_NEAR(surface_area(mesh), 88.0, 1e-12);
}

TEST(Mesh, ScalingByANegativeFactorKeepsTheOutsideOut) {
  EXPECT_NEAR(signed_volume(scaled(unit_cube(), 2.0)), 8.0, 1e-13);
  EXPECT_NEAR(signed_volume(scaled(unit_cube(), -2.0)), 8.0, 1e-13);
}

TEST(ContentHash, ChangesWithEveryNumber) {
  const TriangleMesh mesh = unit_cube();
  EXPECT_EQ(content_hash(mesh), content_hash(unit_cube()));
  TriangleMesh other = mesh;
  other.vertices[3].z() = std::nextafter(other.vertices[3].z(), 1.0);
  EXPECT_NE(content_hash(mesh), content_hash(other));
  other = mesh;
  std::swap(other.triangles[0], other.triangles[1]);
  EXPECT_NE(content_hash(mesh), content_hash(other));
}

TEST(Primitives, MeshesHaveTheSizesAsked) {
  const auto size_of = [](const TriangleMesh& mesh) { return bounding_box(mesh).sizes().eval(); };
  EXPECT_THAT(size_of(make_mesh(Sphere{0.3}, 32)), is_near(Vector3d(0.6, 0.6, 0.6), 1e-15));
  EXPECT_THAT(size_of(make_mesh(BoxShape{{0.1, 0.2, 0.3}})), is_near(Vector3d(0.1, 0.2, 0.3), 1e-15));
  EXPECT_THAT(size_of(make_mesh(Cylinder{0.1, 0.5}, 32)), is_near(Vector3d(0.2, 0.2, 0.5), 1e-15));
  EXPECT_THAT(size_of(make_mesh(Capsule{0.1, 0.5}, 32)), is_near(Vector3d(0.2, 0.2, 0.7), 1e-15));
  EXPECT_THAT(size_of(make_mesh(Cone{0.1, 0.5}, 32)), is_near(Vector3d(0.2, 0.2, 0.5), 1e-15));
  EXPECT_THAT(bounding_box(make_mesh(Cone{0.1, 0.5}, 32)).max().z(), testing::DoubleEq(0.25));
}

TEST(Primitives, BinIsHollow) {
  const TriangleMesh bin = make_open_bin({0.4, 0.3, 0.2}, 0.01);
  EXPECT_THAT(bounding_box(bin).min(), is_near(Vector3d(-0.21, -0.16, 0.0), 1e-15));
  EXPECT_THAT(bounding_box(bin).max(), is_near(Vector3d(0.21, 0.16, 0.21), 1e-15));
  EXPECT_NEAR(signed_volume(bin), 0.42 * 0.32 * 0.21 - 0.4 * 0.3 * 0.2, 1e-15);
  EXPECT_EQ(mesh_topology(bin).components, 1);
}

TEST(Primitives, CartonHasARoofAndAFin) {
  const TriangleMesh carton = make_gable_carton(0.07, 0.08, 0.2, 0.26);
  EXPECT_THAT(bounding_box(carton).max(), is_near(Vector3d(0.035, 0.04, 0.13), 1e-15));
  EXPECT_THAT(bounding_box(carton).min(), is_near(Vector3d(-0.035, -0.04, -0.13), 1e-15));
  // Base block, trapezoid roof of 4 cm, fin of 2 cm; the fin is 0.04 * 8 cm thick.
  const double profile = 0.08 * 0.2 + 0.5 * (0.08 + 0.0032) * 0.04 + 0.0032 * 0.02;
  EXPECT_NEAR(signed_volume(carton), 0.07 * profile, 1e-15);
}

// Points that crowd closer together than the hull's tolerance are passed over and looked at again in the end. That must
// not cost a look at every face of the hull for each of them: it would be 10^10 looks here, and the time limit of a
// test.
TEST(ConvexHull, TakesCrowdsOfPointsOnASphere) {
  constexpr int kSpread = 60'000;
  constexpr int kCrowded = 40'000;
  const double golden = M_PI * (3.0 - std::sqrt(5.0));
  const auto on_sphere = [&](double z, int turn) {
    const double r = std::sqrt(1.0 - z * z);
    return Vector3d(r * std::cos(golden * turn), r * std::sin(golden * turn), z);
  };
  std::vector<Vector3d> points;
  for (int i = 0; i < kSpread; ++i) points.push_back(on_sphere(1.0 - (2.0 * i + 1.0) / kSpread, i));
  for (int i = 0; i < kCrowded; ++i) points.push_back(on_sphere(1.0 - 1e-10 * (i + 1.0) / kCrowded, i));
  const auto hull = convex_hull(points);
  ASSERT_TRUE(hull.ok()) << hull.status().message();
  EXPECT_TRUE(mesh_topology(*hull).watertight());
  EXPECT_GT(hull->vertices.size(), 0.99 * kSpread);
  EXPECT_NEAR(signed_volume(*hull), 4.0 / 3.0 * M_PI, 1e-3);
  const auto again = convex_hull(hull->vertices);
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(*again == *hull);
}

TEST(Cancellation, StopsARepairAndAHull) {
  core::Cancellation cancellation;
  const TriangleMesh ball = make_mesh(Sphere{1.0}, 48);
  EXPECT_TRUE(*repair_mesh(ball, nullptr, &cancellation) == *repair_mesh(ball, nullptr));
  EXPECT_TRUE(*convex_hull(ball.vertices, &cancellation) == *convex_hull(ball.vertices));
  cancellation.request();
  EXPECT_EQ(repair_mesh(ball, nullptr, &cancellation).status().code(), core::StatusCode::kCancelled);
  EXPECT_EQ(convex_hull(ball.vertices, &cancellation).status().code(), core::StatusCode::kCancelled);
}

TEST(Primitives, LatheClosesItsProfileOnTheAxis) {
  // A cup: outer wall up, inner wall down to the floor.
  const TriangleMesh cup = make_lathe({{0.04, 0.0}, {0.04, 0.1}, {0.037, 0.1}, {0.037, 0.003}}, 64);
  EXPECT_TRUE(mesh_topology(cup).watertight());
  EXPECT_TRUE(mesh_topology(cup).oriented());
  const double polygon = 32.0 * std::sin(M_PI / 32.0);  // Area of the 64-gon in the unit circle.
  EXPECT_NEAR(signed_volume(cup), polygon * (0.04 * 0.04 * 0.1 - 0.037 * 0.037 * 0.097), 1e-15);
}

}  // namespace
}  // namespace prescene::geometry
