// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/random.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/triangle_distance.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/generators.h"

namespace prescene::collision::pack_spheres_test {
namespace {

using geometry::Vector3d;
using ::testing::HasSubstr;

std::shared_ptr<const Mesh> to_mesh(const geometry::TriangleMesh& mesh) { return *Mesh::make(mesh, "body"); }

double distance_to_surface(const Mesh& mesh, const Vector3d& p) {
  double squared = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const auto [a, b, c] = mesh.corners(i);
    squared = std::min(squared,
                       geometry::squared_distance_to_triangle(p, a.cast<double>(), b.cast<double>(), c.cast<double>()));
  }
  return std::sqrt(squared);
}

// By solid angles, which the packing does not use.
double winding(const Mesh& mesh, const Vector3d& p) {
  double angle = 0.0;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const auto corners = mesh.corners(i);
    const Vector3d a = corners[0].cast<double>() - p;
    const Vector3d b = corners[1].cast<double>() - p;
    const Vector3d c = corners[2].cast<double>() - p;
    const double below =
        a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm();
    angle += 2.0 * std::atan2(a.dot(b.cross(c)), below);
  }
  return angle / (4.0 * std::numbers::pi);
}

double separation(const PackedSphere& a, const PackedSphere& b) {
  return (a.centre.cast<double>() - b.centre.cast<double>()).norm() - static_cast<double>(a.radius) -
         static_cast<double>(b.radius);
}

void expect_apart(const SpherePacking& packing) {
  for (std::uint32_t i = 0; i < packing.size(); ++i) {
    for (std::uint32_t k = 0; k < i; ++k)
      ASSERT_GE(separation(packing.spheres()[i], packing.spheres()[k]), 0.0) << i << " " << k;
  }
}

TEST(PackSpheres, SpheresLieInsideAndApart) {
  core::ThreadPool pool(2);
  EXPECT_TRUE(tests::check_law([&] {
    const auto mesh = to_mesh(*tests::closed_meshes());
    const auto packed = pack_spheres(*mesh, {.max_spheres = 12, .layouts = 2}, pool);
    RC_ASSERT(packed.ok());
    const SpherePacking& packing = *packed->packing;
    RC_ASSERT(packing.size() <= 12U);
    RC_ASSERT(packed->report.share() > 0.0 && packed->report.share() < 1.0);
    for (std::uint32_t i = 0; i < packing.size(); ++i) {
      const PackedSphere& sphere = packing.spheres()[i];
      const Vector3d centre = sphere.centre.cast<double>();
      const double distance = distance_to_surface(*mesh, centre);
      RC_ASSERT(static_cast<double>(sphere.radius) <= distance * (1.0 + 1e-12));
      RC_ASSERT(winding(*mesh, centre) > 0.5);
      for (std::uint32_t k = 0; k < i; ++k) RC_ASSERT(separation(sphere, packing.spheres()[k]) >= 0.0);
      // The anchor is the nearest place, and the way there leads out.
      const SurfaceAnchor& anchor = packing.anchors()[i];
      const Vector3d way = anchor.point.cast<double>() - centre;
      RC_ASSERT(std::abs(way.norm() - distance) < 1e-6);
      RC_ASSERT((way.normalized() - anchor.normal.cast<double>()).norm() < 1e-3);
    }
  }));
}

TEST(PackSpheres, IsTheSameForAnyNumberOfThreads) {
  const auto mesh = to_mesh(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2));
  const PackingOptions options{.max_spheres = 400, .edge_fidelity = 0.002};
  core::ThreadPool one(1);
  const auto expected = pack_spheres(*mesh, options, one);
  ASSERT_TRUE(expected.ok()) << expected.status().message();
  for (const int threads : {2, 3}) {
    core::ThreadPool pool(threads);
    const auto packed = pack_spheres(*mesh, options, pool);
    EXPECT_TRUE(std::ranges::equal(packed->packing->spheres(), expected->packing->spheres()));
    EXPECT_TRUE(std::ranges::equal(packed->packing->anchors(), expected->packing->anchors()));
    EXPECT_EQ(packed->report, expected->report);
  }
}

TEST(PackSpheres, FirstIsTheLargestThatFits) {
  core::ThreadPool pool(2);
  const auto packed = pack_spheres(*to_mesh(geometry::make_mesh(geometry::BoxShape{{0.3, 0.2, 0.4}})), {}, pool);
  ASSERT_TRUE(packed.ok());
  EXPECT_NEAR(packed->packing->spheres()[0].radius, 0.1, 1e-4);
  EXPECT_EQ(packed->packing->size(), 5000U);
  expect_apart(*packed->packing);
}

TEST(PackSpheres, EndsAtTheShareOfTheVolume) {
  core::ThreadPool pool(2);
  const auto mesh = to_mesh(geometry::make_mesh(geometry::Cylinder{0.05, 0.2}));
  const auto packed = pack_spheres(*mesh, {.volume_share = 0.8}, pool);
  EXPECT_GE(packed->report.share(), 0.8);
  EXPECT_LT(packed->report.share(), 0.805);
  EXPECT_NEAR(packed->report.packed_volume, packed->packing->volume(), 1e-12);
  EXPECT_THAT(packed->report.text(), HasSubstr("spheres fill 80"));
}

TEST(PackSpheres, StopsAtTheSmallestRadius) {
  core::ThreadPool pool(2);
  const auto mesh = to_mesh(geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.1}}));
  const auto packed = pack_spheres(*mesh, {.smallest_radius = 0.01}, pool);
  ASSERT_TRUE(packed.ok());
  // One in the middle, one in each of the eight corners: r (1 + sqrt(3)) = 0.05 (sqrt(3) - 1), and none between them.
  EXPECT_EQ(packed->packing->size(), 9U);
  EXPECT_NEAR(packed->packing->spheres()[8].radius, 0.0134, 2e-4);
}

TEST(PackSpheres, FillsHouseholdObjects) {
  core::ThreadPool pool;
  for (const char* name : {"ycb_master_chef_can", "ycb_mustard_bottle", "ycb_cracker_box", "ycb_mug"}) {
    const auto mesh = tests::read_recorded_mesh("household/" + std::string(name) + ".ply");
    if (!mesh) GTEST_SKIP() << tests::missing_meshes_message();
    const auto packed = pack_spheres(**Mesh::make(*mesh, name), {.max_spheres = 1000}, pool);
    ASSERT_TRUE(packed.ok()) << packed.status().message();
    EXPECT_NEAR(packed->report.body_volume, geometry::signed_volume(*mesh), 1e-5 * packed->report.body_volume);
    EXPECT_GE(packed->report.share(), std::string_view(name) == "ycb_mug" ? 0.5 : 0.75) << name;
  }
}

TEST(PackSpheres, FillsConvexHouseholdObjectsByDefault) {
  core::ThreadPool pool;
  // The brick is the worst of the household's boxes.
  for (const auto& [name, share] : {std::pair("ycb_tomato_soup_can", 0.85), std::pair("ycb_bleach_cleanser", 0.85),
                                    std::pair("ycb_foam_brick", 0.845)}) {
    const auto mesh = tests::read_recorded_mesh("household/" + std::string(name) + ".ply");
    if (!mesh) GTEST_SKIP() << tests::missing_meshes_message();
    const auto packed = pack_spheres(**Mesh::make(*mesh, name), {}, pool);
    ASSERT_TRUE(packed.ok()) << packed.status().message();
    EXPECT_EQ(packed->packing->size(), 5000U);
    EXPECT_GE(packed->report.share(), share) << name;
  }
}

TEST(PackSpheres, FillsBoxesFromTheirCorners) {
  core::ThreadPool pool(2);
  const auto mesh = to_mesh(geometry::make_mesh(geometry::BoxShape{{0.039, 0.054, 0.075}}));
  const auto packed = pack_spheres(*mesh, {.max_spheres = 2000}, pool);
  EXPECT_GE(packed->report.share(), 0.83);
  // The largest sphere touches five walls: all but two opposite ones, between which it fits once, have a gap to share.
  const Vector3f& centre = packed->packing->spheres()[0].centre;
  EXPECT_NEAR(std::abs(centre.y()), 0.027 - 0.0195, 1e-5);
  EXPECT_NEAR(std::abs(centre.z()), 0.0375 - 0.0195, 1e-5);
}

TEST(PackSpheres, TriesLayoutsForAFullerOne) {
  core::ThreadPool pool(2);
  const auto mesh = to_mesh(geometry::make_mesh(geometry::BoxShape{{0.06, 0.16, 0.21}}));
  const auto plain = pack_spheres(*mesh, {.max_spheres = 1000, .layouts = 1}, pool);
  const auto best = pack_spheres(*mesh, {.max_spheres = 1000, .layouts = 16}, pool);
  EXPECT_GT(best->report.share(), plain->report.share() + 0.005);
}

// Where a body tapers, spheres that are pulled towards its thin end must not all end there.
TEST(PackSpheres, FillsBodiesThatTaper) {
  core::ThreadPool pool(2);
  for (const double radius : {0.3, 0.1, 0.03}) {
    const auto mesh = to_mesh(geometry::make_mesh(geometry::Cone{radius, 1.0}));
    const auto packed = pack_spheres(*mesh, {.max_spheres = 300, .layouts = 6}, pool);
    ASSERT_TRUE(packed.ok());
    EXPECT_GT(packed->report.share(), 0.7) << radius;
  }
}

TEST(PackSpheres, RefusesOpenMeshesWithTheHolesPlace) {
  core::ThreadPool pool(2);
  geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{2.0, 2.0, 2.0}});
  box.triangles.pop_back();
  const auto refused = pack_spheres(*to_mesh(box), {}, pool);
  EXPECT_THAT(refused.status().message(), HasSubstr("mesh 'body'"));
  EXPECT_THAT(refused.status().message(), HasSubstr("3 open edges, one at ("));
  EXPECT_THAT(refused.status().message(), HasSubstr("close_holes"));
}

TEST(PackSpheres, ClosesHolesWhenAsked) {
  core::ThreadPool pool(2);
  const geometry::TriangleMesh cylinder = geometry::make_mesh(geometry::Cylinder{0.05, 0.1}, 24);
  geometry::TriangleMesh open = cylinder;
  std::erase_if(open.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return open.vertices[v].z() > 0.049; });
  });
  ASSERT_LT(open.triangles.size(), cylinder.triangles.size());
  const auto packed = pack_spheres(*to_mesh(open), {.max_spheres = 50, .close_holes = true}, pool);
  ASSERT_TRUE(packed.ok()) << packed.status().message();
  EXPECT_EQ(packed->report.closed_holes, 1);
  EXPECT_EQ(packed->report.open_edges, 24);
  EXPECT_NEAR(packed->report.body_volume, geometry::signed_volume(cylinder), 1e-9);
  for (const PackedSphere& sphere : packed->packing->spheres()) EXPECT_LE(sphere.centre.z() + sphere.radius, 0.05F);
}

TEST(PackSpheres, RefusesWhatHasNoInside) {
  core::ThreadPool pool(2);
  geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{2.0, 2.0, 2.0}});
  for (auto& t : box.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(pack_spheres(*to_mesh(box), {}, pool).status().message(), HasSubstr("counter-clockwise"));
  geometry::TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_THAT(pack_spheres(*to_mesh(sheet), {}, pool).status().message(), HasSubstr("encloses a volume of 0"));
  EXPECT_THAT(pack_spheres(*to_mesh(sheet), {.close_holes = true}, pool).status().message(), HasSubstr("volume of 0"));
}

TEST(PackSpheres, RefusesBadOptions) {
  core::ThreadPool pool(1);
  const auto mesh = to_mesh(geometry::make_mesh(geometry::Cylinder{1.0, 2.0}));
  const auto message = [&](const PackingOptions& options) {
    return pack_spheres(*mesh, options, pool).status().message();
  };
  EXPECT_THAT(message({.max_spheres = 0}), HasSubstr("max_spheres"));
  EXPECT_THAT(message({.volume_share = 0.0}), HasSubstr("volume_share"));
  EXPECT_THAT(message({.layouts = 0}), HasSubstr("layouts"));
  EXPECT_THAT(message({.smallest_radius = -1.0}), HasSubstr("smallest_radius"));
  EXPECT_THAT(message({.edge_fidelity = std::nan("")}), HasSubstr("edge_fidelity"));
  EXPECT_THAT(message({.smallest_radius = 2.0}), HasSubstr("no sphere with a radius of 2"));
  EXPECT_THAT(message({.max_spheres = 20, .edge_fidelity = 1e-3}), HasSubstr("allow more spheres"));
  EXPECT_THAT(message({.max_spheres = 20, .smallest_radius = 1e-3, .edge_fidelity = 1e-4}), HasSubstr("it is thinner"));
}

TEST(PackSpheres, EndsForTinyHugeAndFarBodies) {
  core::ThreadPool pool(2);
  for (const double scale : {1e-38, 1e-30, 1e-10, 1e8}) {
    geometry::TriangleMesh box = geometry::scaled(geometry::make_mesh(geometry::BoxShape{{1.0, 2.0, 3.0}}), scale);
    const auto packed = pack_spheres(*to_mesh(box), {.max_spheres = 50, .edge_fidelity = 0.01 * scale}, pool);
    ASSERT_TRUE(packed.ok()) << packed.status().message();
    EXPECT_NEAR(packed->report.body_volume, 6.0 * std::pow(scale, 3), 1e-5 * std::pow(scale, 3));
    EXPECT_GT(packed->report.share(), 0.5);
  }
  const auto speck = geometry::scaled(geometry::make_mesh(geometry::BoxShape{{1.0, 1.0, 1.0}}), 1e-44);
  EXPECT_THAT(pack_spheres(*to_mesh(speck), {}, pool).status().message(), HasSubstr("scale it"));
  // Ten thousand times its size away, single precision still has room for some spheres; a million times, for none.
  for (const double away : {1e4, 1e6}) {
    geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{1.0, 2.0, 3.0}});
    for (Vector3d& v : box.vertices) v.x() += away;
    const auto packed = pack_spheres(*to_mesh(box), {.max_spheres = 50}, pool);
    if (packed.ok()) {
      expect_apart(*packed->packing);
    } else {
      EXPECT_THAT(packed.status().message(), HasSubstr("too far from its origin"));
    }
  }
}

// How much further the body reaches in a direction than its packing does, at most over many directions.
double largest_lack(const Mesh& mesh, const SpherePacking& packing) {
  core::RandomStream stream(1, core::Purpose::kTest);
  double largest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double z = stream.normal(), y = stream.normal(), x = stream.normal();
    const Vector3d u = Vector3d(x, y, z).normalized();
    double body = -1e9;
    for (const Vector3f& v : mesh.vertices()) body = std::max(body, u.dot(v.cast<double>()));
    double spheres = -1e9;
    for (const PackedSphere& s : packing.spheres())
      spheres = std::max(spheres, u.dot(s.centre.cast<double>()) + static_cast<double>(s.radius));
    largest = std::max(largest, body - spheres);
  }
  return largest;
}

TEST(PackSpheresWithEdges, HullReachesAsFarAsTheBody) {
  core::ThreadPool pool(2);
  const double fidelity = 0.001;
  const std::vector<geometry::Primitive> shapes = {geometry::BoxShape{{0.06, 0.16, 0.21}},
                                                   geometry::Cylinder{0.05, 0.14}, geometry::Cone{0.04, 0.1},
                                                   geometry::Sphere{0.05}};
  for (const geometry::Primitive& shape : shapes) {
    const auto mesh = to_mesh(geometry::make_mesh(shape));
    const auto packed = pack_spheres(*mesh, {.max_spheres = 1000, .edge_fidelity = fidelity}, pool);
    ASSERT_TRUE(packed.ok()) << packed.status().message();
    EXPECT_LE(largest_lack(*mesh, *packed->packing), fidelity);
    EXPECT_LE(packed->report.edge_gap, fidelity);
    EXPECT_GE(packed->report.edge_gap, largest_lack(*mesh, *packed->packing) * (1.0 - 1e-6));
    EXPECT_GT(packed->report.share(), 0.7);
    expect_apart(*packed->packing);
  }
}

TEST(PackSpheresWithEdges, VerticesWithoutTrianglesDoNotCount) {
  core::ThreadPool pool(2);
  geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.06, 0.16, 0.21}});
  const PackingOptions options{.max_spheres = 400, .edge_fidelity = 0.001, .layouts = 1};
  const auto plain = pack_spheres(*to_mesh(box), options, pool);
  box.vertices.emplace_back(1.0, 1.0, 1.0);
  const auto packed = pack_spheres(*to_mesh(box), options, pool);
  ASSERT_TRUE(packed.ok()) << packed.status().message();
  EXPECT_LE(packed->report.edge_gap, 0.001);
  EXPECT_EQ(packed->report.edge_spheres, plain->report.edge_spheres);
}

// Finer than the hull's distance is computed.
TEST(PackSpheresWithEdges, EndsWithTheFinestFidelity) {
  core::ThreadPool pool(2);
  for (const geometry::Primitive& shape :
       std::vector<geometry::Primitive>{geometry::BoxShape{{1.0, 0.7, 0.9}}, geometry::Cone{0.5, 1.0}}) {
    for (const double fidelity : {3e-6, 1e-6, 4e-7, 1e-7}) {
      const auto packed =
          pack_spheres(*to_mesh(geometry::make_mesh(shape)),
                       {.max_spheres = 600, .smallest_radius = 1e-9, .edge_fidelity = fidelity, .layouts = 1}, pool);
      if (packed.ok()) {
        EXPECT_LE(packed->report.edge_gap, fidelity);
      } else {
        EXPECT_THAT(packed.status().message(), HasSubstr("it is thinner"));
      }
    }
  }
}

// Where the lowest point of the packing changes side of the centre of mass while a box is tilted about an edge.
double tipping_angle(const SpherePacking& packing) {
  const auto stands = [&](double angle) {  // About y: the edge at +x goes down.
    double lowest = 1e9;
    double at = 0.0;
    for (const PackedSphere& s : packing.spheres()) {
      const Vector3d c = s.centre.cast<double>();
      const double height = std::cos(angle) * c.z() - std::sin(angle) * c.x() - static_cast<double>(s.radius);
      if (height < lowest) {
        lowest = height;
        at = std::cos(angle) * c.x() + std::sin(angle) * c.z();
      }
    }
    return at > 0.0;  // The centre of mass is the origin.
  };
  double low = 0.01;
  double high = 1.5;
  EXPECT_TRUE(stands(low));
  EXPECT_FALSE(stands(high));
  while (high - low > 1e-6) (stands(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

TEST(PackSpheresWithEdges, BoxTipsAtItsAngle) {
  core::ThreadPool pool(2);
  for (const Vector3d& size : {Vector3d(0.06, 0.16, 0.21), Vector3d(0.03, 0.1, 0.15), Vector3d(0.1, 0.1, 0.1)}) {
    const auto mesh = to_mesh(geometry::make_mesh(geometry::BoxShape{size}));
    const auto packed = pack_spheres(*mesh, {.max_spheres = 1000, .edge_fidelity = 0.001}, pool);
    ASSERT_TRUE(packed.ok());
    const double expected = std::atan2(size.x(), size.z());
    EXPECT_NEAR(tipping_angle(*packed->packing), expected, 0.5 * std::numbers::pi / 180.0);
  }
}

}  // namespace
}  // namespace prescene::collision::pack_spheres_test
