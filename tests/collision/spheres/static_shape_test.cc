// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/static_shape.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <vector>

#include "every_shape.h"
#include "prescene/core/random.h"
#include "prescene/geometry/triangle_distance.h"
#include "tests/support/generators.h"

namespace prescene::collision::static_shape_test {
namespace {

using geometry::Vector3d;
using ::testing::HasSubstr;

constexpr double kFar = 1e9;

std::shared_ptr<const Mesh> to_mesh(const geometry::TriangleMesh& mesh) { return *Mesh::make(mesh, "shelf"); }

// The distance is that of the place that it names, grows by as much as one moves along the normal, and changes by at
// most the way; a limit only hides what lies beyond it.
void check_laws(const StaticShape& shape, const Vector3d& p, const Vector3d& way) {
  const auto here = shape.nearest(p, kFar);
  RC_ASSERT(here.has_value());
  RC_ASSERT(std::abs(here->normal.norm() - 1.0) < 1e-9);
  const auto surface = shape.nearest(p - here->distance * here->normal, kFar);
  RC_ASSERT(std::abs(surface->distance) < 1e-6);
  const auto there = shape.nearest(p + way, kFar);
  RC_ASSERT(std::abs(there->distance - here->distance) <= way.norm() + 1e-6);
  const auto limited = shape.nearest(p, here->distance + 1e-3);
  RC_ASSERT(limited.has_value() && std::abs(limited->distance - here->distance) < 1e-9);
  RC_ASSERT(!shape.nearest(p, here->distance).has_value());
  RC_ASSERT(shape.is_within(p, here->distance + 1e-9) && !shape.is_within(p, here->distance - 1e-9));
}

TEST(PrimitiveShape, DistancesObeyTheirLaws) {
  EXPECT_TRUE(tests::check_law(
      [] { check_laws(*PrimitiveShape::make(*tests::primitives()), *tests::vectors(1.0), *tests::vectors(0.2)); }));
}

TEST(PrimitiveShape, AgreesWithItsMesh) {
  // Of shapes with flat faces, exactly.
  const geometry::BoxShape box{{0.2, 0.3, 0.4}};
  const auto shape = *PrimitiveShape::make(box);
  const auto solid = *TriangleSurface::make(to_mesh(geometry::make_mesh(box)), SurfaceSide::kSolid, shape_pool());
  EXPECT_TRUE(tests::check_law([&] {
    const Vector3d p = *tests::vectors(0.4);
    RC_ASSERT(std::abs(shape.nearest(p, kFar)->distance - solid.nearest(p, kFar)->distance) < 1e-6);
  }));
  // Of round ones, up to the height of their facets.
  for (const geometry::Primitive& round :
       std::vector<geometry::Primitive>{geometry::Cylinder{0.2, 0.3}, geometry::Cone{0.2, 0.3},
                                        geometry::Capsule{0.1, 0.3}, geometry::Sphere{0.2}}) {
    const auto exact = *PrimitiveShape::make(round);
    const auto facets =
        *TriangleSurface::make(to_mesh(geometry::make_mesh(round, 256)), SurfaceSide::kSolid, shape_pool());
    core::RandomStream stream(4, core::Purpose::kTest);
    for (int i = 0; i < 200; ++i) {
      const double z = stream.uniform(-0.4, 0.4), y = stream.uniform(-0.4, 0.4), x = stream.uniform(-0.4, 0.4);
      const Vector3d p(x, y, z);
      EXPECT_NEAR(exact.nearest(p, kFar)->distance, facets.nearest(p, kFar)->distance, 1e-4);
    }
  }
}

TEST(HalfSpace, ByHand) {
  const auto floor = *HalfSpace::make({0, 0, 2}, 0.5);
  EXPECT_EQ(floor.nearest({7, 8, 0.75}, kFar)->distance, 0.25);
  EXPECT_EQ(floor.nearest({7, 8, 0.0}, 0.0)->distance, -0.5);
  EXPECT_EQ(floor.nearest({7, 8, 0.0}, 0.0)->normal, Vector3d(0, 0, 1));
  EXPECT_FALSE(floor.nearest({7, 8, 0.75}, 0.25).has_value());
}

TEST(TriangleSurface, SheetPushesToBothSides) {
  geometry::TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}};
  const auto surface = *TriangleSurface::make(to_mesh(sheet), SurfaceSide::kBoth, shape_pool());
  EXPECT_EQ(surface.nearest({0.2, 0.2, 0.1}, kFar)->normal, Vector3d(0, 0, 1));
  EXPECT_EQ(surface.nearest({0.2, 0.2, -0.1}, kFar)->normal, Vector3d(0, 0, -1));
  EXPECT_EQ(surface.nearest({0.2, 0.2, 0.0}, kFar)->normal, Vector3d(0, 0, 1));
  EXPECT_FALSE(surface.nearest({0.2, 0.2, 0.1}, 0.05).has_value());
  EXPECT_THAT(TriangleSurface::make(to_mesh(sheet), SurfaceSide::kSolid, shape_pool()).status().message(),
              HasSubstr("mesh 'shelf': it is open"));
}

TEST(TriangleSurface, KnowsWhereItIsFlat) {
  // A sheet of many triangles with a hole in the middle, and a step at x = 1.
  geometry::TriangleMesh sheet;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 10; ++j) sheet.vertices.push_back({0.1 * i, 0.1 * j, i > 10 ? 0.05 : 0.0});
  }
  for (std::uint32_t i = 0; i < 20; ++i) {
    for (std::uint32_t j = 0; j < 10; ++j) {
      const std::uint32_t a = 11 * i + j;
      if (i == 3 && j == 5) continue;
      sheet.triangles.push_back({a, a + 11, a + 12});
      sheet.triangles.push_back({a, a + 12, a + 1});
    }
  }
  const auto surface = *TriangleSurface::make(to_mesh(sheet), SurfaceSide::kBoth, shape_pool());
  const auto flat = [&](double x, double y, double radius) {
    return surface.is_flat_about({x, y, x > 1.1 ? 0.05 : 0.0}, Vector3d::UnitZ(), radius, 1e-6);
  };
  core::RandomStream stream(6, core::Purpose::kTest);
  int yes = 0;
  for (int i = 0; i < 2000; ++i) {
    const double x = stream.uniform(0.02, 1.98);
    const double y = stream.uniform(0.02, 0.98);
    if (std::max(std::abs(x - 0.35), std::abs(y - 0.55)) < 0.051 || (x > 0.999 && x < 1.101)) continue;
    const double to_hole =
        std::hypot(std::max(std::abs(x - 0.35) - 0.05, 0.0), std::max(std::abs(y - 0.55) - 0.05, 0.0));
    const double room = std::min({x, 2.0 - x, y, 1.0 - y, to_hole, x < 1.0 ? 1.0 - x : x - 1.1});
    EXPECT_FALSE(flat(x, y, room + 1e-4));
    EXPECT_TRUE(flat(x, y, room - 1e-4));
    ++yes;
  }
  EXPECT_GT(yes, 1500);
  EXPECT_FALSE(surface.is_flat_about({0.8, 0.2, 0.0}, Vector3d(0.1, 0, 1).normalized(), 0.05, 1e-6));
  // Facing the other way, and folded onto itself.
  EXPECT_TRUE(surface.is_flat_about({0.8, 0.2, 0.0}, -Vector3d::UnitZ(), 0.05, 1e-6));
  geometry::TriangleMesh folded;
  folded.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.9, 0}};
  folded.triangles = {{0, 1, 2}, {1, 0, 3}};
  const auto fold = *TriangleSurface::make(to_mesh(folded), SurfaceSide::kBoth, shape_pool());
  EXPECT_FALSE(fold.is_flat_about({0.3, 0.05, 0.0}, Vector3d::UnitZ(), 0.1, 1e-6));
}

TEST(TriangleSurface, SharesATreeThatCameFromAFile) {
  const auto mesh = to_mesh(geometry::make_open_bin({0.3, 0.2, 0.1}, 0.01));
  const TriangleTree built = TriangleTree::build(mesh, {}, shape_pool());
  const auto loaded = TriangleTree::from_bytes(built.bytes(), mesh, {});
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  const auto tree = std::make_shared<const TriangleTree>(*loaded);
  const auto shared = *TriangleSurface::make(tree, SurfaceSide::kSolid);
  const auto own = *TriangleSurface::make(mesh, SurfaceSide::kSolid, shape_pool());
  EXPECT_EQ(shared.tree(), tree);
  core::RandomStream stream(5, core::Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    const double z = stream.uniform(-0.1, 0.3), y = stream.uniform(-0.3, 0.3), x = stream.uniform(-0.3, 0.3);
    const Vector3d p(x, y, z);
    EXPECT_EQ(shared.nearest(p, kFar)->distance, own.nearest(p, kFar)->distance);
  }
}

TEST(TriangleSurface, DistancesObeyTheirLaws) {
  EXPECT_TRUE(tests::check_law([] {
    const auto mesh = to_mesh(*tests::closed_meshes());
    const Vector3d p = *tests::vectors(1.0);
    const Vector3d way = *tests::vectors(0.2);
    check_laws(*TriangleSurface::make(mesh, SurfaceSide::kSolid, shape_pool()), p, way);
    check_laws(*TriangleSurface::make(mesh, SurfaceSide::kBoth, shape_pool()), p, way);
  }));
}

HeightField::Grid hills(int columns, int rows) {
  HeightField::Grid grid{columns, rows, 0.1, 0.07, {}};
  core::RandomStream stream(9, core::Purpose::kTest);
  for (int i = 0; i < columns * rows; ++i) grid.heights.push_back(static_cast<float>(stream.uniform(-0.2, 0.2)));
  return grid;
}

TEST(HeightField, DistancesObeyTheirLaws) {
  const auto field = *HeightField::make(hills(9, 12), "hills");
  EXPECT_TRUE(tests::check_law([&] {
    const Vector3d p = Vector3d(0.4, 0.4, 0.0) + *tests::vectors(0.9);
    check_laws(field, p, *tests::vectors(0.2));
  }));
}

TEST(HeightField, AgreesWithItsTriangles) {
  const HeightField::Grid grid = hills(9, 12);
  const auto field = *HeightField::make(grid, "hills");
  const auto point = [&](int c, int r) {
    return Vector3d(c * grid.spacing_x, r * grid.spacing_y,
                    static_cast<double>(grid.heights[static_cast<std::size_t>(r * grid.columns + c)]));
  };
  core::RandomStream stream(10, core::Purpose::kTest);
  int above = 0;
  for (int i = 0; i < 500; ++i) {
    const double z = stream.uniform(-0.1, 0.4), y = stream.uniform(0.2, 0.55), x = stream.uniform(0.2, 0.6);
    const Vector3d p(x, y, z);
    double squared = std::numeric_limits<double>::infinity();
    for (int r = 0; r + 1 < grid.rows; ++r) {
      for (int c = 0; c + 1 < grid.columns; ++c) {
        squared = std::min(
            {squared, geometry::squared_distance_to_triangle(p, point(c, r), point(c + 1, r), point(c + 1, r + 1)),
             geometry::squared_distance_to_triangle(p, point(c, r), point(c + 1, r + 1), point(c, r + 1))});
      }
    }
    const bool inside = p.z() < *field.height(p.x(), p.y());
    const auto nearest = field.nearest(p, kFar);
    if (!inside) {
      ++above;
      EXPECT_NEAR(nearest->distance, std::sqrt(squared), 1e-12);
    } else if (std::sqrt(squared) < 0.2) {
      EXPECT_NEAR(nearest->distance, -std::sqrt(squared), 1e-12);
    }
  }
  EXPECT_GT(above, 100);
  EXPECT_LT(above, 450);
}

TEST(HeightField, HasSidesAndNoBottom) {
  const auto field = *HeightField::make({2, 2, 1.0, 1.0, {0, 0, 0, 0}}, "block");
  EXPECT_NEAR(field.nearest({1.5, 0.5, -0.25}, kFar)->distance, 0.5, 1e-12);
  EXPECT_TRUE(field.nearest({1.5, 0.5, -0.25}, kFar)->normal.isApprox(Vector3d(1, 0, 0)));
  EXPECT_NEAR(field.nearest({0.9, 0.5, -7.0}, kFar)->distance, -0.1, 1e-12);
  EXPECT_NEAR(field.nearest({0.5, 0.5, -0.1}, kFar)->distance, -0.1, 1e-12);
  EXPECT_TRUE(field.nearest({0.5, 0.5, -0.1}, kFar)->normal.isApprox(Vector3d(0, 0, 1)));
  EXPECT_EQ(field.height(0.5, 0.5), 0.0);
  EXPECT_EQ(field.height(1.5, 0.5), std::nullopt);
}

TEST(StaticShapes, RefuseBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(HalfSpace::make({0, 0, 0}, 1.0).status().message(), HasSubstr("normal is zero"));
  EXPECT_THAT(HalfSpace::make({0, 0, 1}, nan).status().message(), HasSubstr("not finite"));
  EXPECT_THAT(PrimitiveShape::make(geometry::Cone{0.0, 1.0}).status().message(), HasSubstr("not positive"));
  EXPECT_THAT(PrimitiveShape::make(geometry::BoxShape{{1, nan, 1}}).status().message(), HasSubstr("not positive"));
  const auto message = [](HeightField::Grid grid) {
    return HeightField::make(std::move(grid), "field").status().message();
  };
  EXPECT_THAT(message({1, 2, 1.0, 1.0, {0, 0}}), HasSubstr("height field 'field': 1 x 2 points"));
  EXPECT_THAT(message({2, 2, 1.0, 1.0, {0, 0}}), HasSubstr("2 heights for 2 x 2"));
  EXPECT_THAT(message({2, 2, 0.0, 1.0, {0, 0, 0, 0}}), HasSubstr("a spacing of 0"));
  EXPECT_THAT(message({2, 2, 1.0, 1.0, {0, 0, static_cast<float>(nan), 0}}), HasSubstr("point (0, 1)"));
}

}  // namespace
}  // namespace prescene::collision::static_shape_test
