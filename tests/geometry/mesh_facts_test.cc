// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/mesh_facts.h"

#include <gtest/gtest.h>

#include <memory>

#include "prescene/geometry/primitives.h"

namespace prescene::geometry {
namespace {

std::shared_ptr<const TriangleMesh> shared_box(double size) {
  return std::make_shared<const TriangleMesh>(
      transformed(make_mesh(BoxShape{{size, size, size}}), Pose::from_translation({1.0, 0.0, 0.0})));
}

TEST(MeshFacts, AreThoseOfTheMesh) {
  const auto mesh = shared_box(0.2);
  const MeshFacts facts = facts_of(mesh);
  EXPECT_EQ(facts.content, content_hash(*mesh));
  EXPECT_TRUE(facts.box.isApprox(bounding_box(*mesh)));
  EXPECT_EQ(facts.radius, radius_about(*mesh, facts.box.center()));
  EXPECT_EQ(facts.reach, radius_about(*mesh, Vector3d::Zero()));
  EXPECT_EQ(facts_of(std::make_shared<const TriangleMesh>()).radius, 0.0);
}

TEST(MeshFacts, AreWorkedOutOnce) {
  const auto mesh = shared_box(0.3);
  const std::size_t before = mesh_facts_made();
  for (int i = 0; i < 5; ++i) facts_of(mesh);
  EXPECT_EQ(mesh_facts_made(), before + 1);
}

TEST(MeshFacts, OfWhatComesWhereAnotherMeshWasAreItsOwn) {
  // Most of these are where one before was; those that are gone are forgotten, now and then.
  for (int i = 1; i < 500; ++i) {
    const double size = 0.001 * i;
    const auto mesh = shared_box(size);
    EXPECT_NEAR(facts_of(mesh).box.sizes().x(), size, 1e-12);
  }
}

TEST(MeshFacts, OfTwoMeshesOfOneOwnerAreTheirOwn) {
  struct Pair {
    TriangleMesh small = make_mesh(BoxShape{{0.1, 0.1, 0.1}}), large = make_mesh(BoxShape{{0.4, 0.4, 0.4}});
  };
  const auto pair = std::make_shared<const Pair>();
  const std::shared_ptr<const TriangleMesh> small(pair, &pair->small), large(pair, &pair->large);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(facts_of(small).box.sizes().x(), 0.1, 1e-12);
    EXPECT_NEAR(facts_of(large).box.sizes().x(), 0.4, 1e-12);
  }
  const std::shared_ptr<const TriangleMesh> nobodys(std::shared_ptr<void>(), &pair->small);
  EXPECT_NEAR(facts_of(nobodys).box.sizes().x(), 0.1, 1e-12);
}

}  // namespace
}  // namespace prescene::geometry
