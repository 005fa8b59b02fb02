// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/mesh.h"

#include <gmock/gmock.h>

#include <limits>

#include "prescene/geometry/primitives.h"

namespace prescene::collision::mesh_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

geometry::TriangleMesh cube() { return geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}}); }

std::string refusal(const geometry::TriangleMesh& mesh) {
  const auto made = Mesh::make(mesh, "cup");
  EXPECT_FALSE(made.ok());
  EXPECT_EQ(made.status().code(), core::StatusCode::kInvalidInput);
  return made.status().message();
}

TEST(Mesh, RoundsToSinglePrecision) {
  const auto mesh = Mesh::make(cube(), "cube");
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ((*mesh)->triangle_count(), 12U);
  EXPECT_EQ((*mesh)->report(), MeshReport());
  EXPECT_EQ((*mesh)->report().text(), "");
  EXPECT_FLOAT_EQ((*mesh)->size(), std::sqrt(0.01F + 0.04F + 0.09F));
}

TEST(Mesh, NamesWhatItRefuses) {
  EXPECT_THAT(refusal({}), AllOf(HasSubstr("'cup'"), HasSubstr("no triangles")));

  geometry::TriangleMesh mesh = cube();
  mesh.triangles[5][1] = 99;
  EXPECT_THAT(refusal(mesh), AllOf(HasSubstr("triangle 5"), HasSubstr("vertex 99"), HasSubstr("repair_mesh")));

  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    mesh = cube();
    mesh.vertices[3].y() = bad;
    EXPECT_THAT(refusal(mesh), AllOf(HasSubstr("vertex 3"), HasSubstr("not finite")));
  }
  mesh = cube();
  mesh.vertices[3].y() = 1e30;
  EXPECT_THAT(refusal(mesh), AllOf(HasSubstr("vertex 3"), HasSubstr("1e9 m")));
}

TEST(Mesh, ReportsTrianglesWithoutAreaAndDuplicates) {
  geometry::TriangleMesh mesh = cube();
  mesh.triangles.push_back(mesh.triangles[4]);
  mesh.triangles.push_back({mesh.triangles[7][1], mesh.triangles[7][2], mesh.triangles[7][0]});
  mesh.triangles.push_back({0, 1, 1});
  const auto made = Mesh::make(mesh, "cup");
  ASSERT_TRUE(made.ok());
  EXPECT_EQ((*made)->report().duplicate_triangles, 2);
  EXPECT_EQ((*made)->report().degenerate_triangles, 1);
  EXPECT_EQ((*made)->report().text(), "1 triangles without area, 2 duplicate triangles");
}

TEST(Mesh, KeepsTinyCoordinates) {
  geometry::TriangleMesh mesh = geometry::scaled(cube(), 1e-30);
  const auto made = Mesh::make(mesh, "speck");
  ASSERT_TRUE(made.ok());
  EXPECT_EQ((*made)->report().degenerate_triangles, 0);
  EXPECT_GT((*made)->size(), 0.0F);
}

TEST(Mesh, HashesItsContentAndNotItsName) {
  const auto a = Mesh::make(cube(), "a");
  const auto b = Mesh::make(cube(), "b");
  geometry::TriangleMesh other = cube();
  other.vertices[0].x() += 1e-6;
  const auto c = Mesh::make(other, "a");
  ASSERT_TRUE(a.ok() && b.ok() && c.ok());
  EXPECT_EQ((*a)->content_hash(), (*b)->content_hash());
  EXPECT_NE((*a)->content_hash(), (*c)->content_hash());
}

}  // namespace
}  // namespace prescene::collision::mesh_test
