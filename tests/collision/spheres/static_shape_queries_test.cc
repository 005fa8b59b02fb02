// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/static_shape_queries.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "every_shape.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"
#include "tests/support/generators.h"

namespace prescene::collision::static_shape_queries_test {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using Tree = std::shared_ptr<const SphereTree>;

core::ThreadPool& pool() {
  static core::ThreadPool threads(2);
  return threads;
}

Tree packed(const geometry::Primitive& primitive, const PackingOptions& options) {
  const auto packing = pack_spheres(**Mesh::make(geometry::make_mesh(primitive), "body"), options, pool());
  return *SphereTree::make(packing->packing, {}, pool());
}

// Asks each sphere on its own.
void expect_agreement(const SphereTree& tree, const StaticShape& shape, const Pose& X_AB, SphereScratch& scratch) {
  const Transform transform = *to_transform(X_AB);
  std::set<std::uint32_t> expected;
  double nearest = std::numeric_limits<double>::infinity();
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  const Vector3d p_AP(0.01, 0.02, -0.03);
  for (std::uint32_t i = 0; i < tree.packing().size(); ++i) {
    const PackedSphere& sphere = tree.packing().spheres()[i];
    const auto radius = static_cast<double>(sphere.radius);
    const auto at = shape.nearest(X_AB.inverse() * sphere.centre.cast<double>(), 1e9);
    nearest = std::min(nearest, at->distance - radius);
    if (at->distance > radius) continue;
    expected.insert(i);
    const Vector3d push = X_AB.rotation * at->normal * (50.0 * (radius - at->distance));
    force += push;
    torque += (sphere.centre.cast<double>() - p_AP).cross(push);
  }
  if (std::abs(nearest) > 1e-6) RC_ASSERT(overlap(tree, shape, transform, scratch) == (nearest < 0.0));
  const auto found = distance(tree, shape, transform, scratch);
  RC_ASSERT(found.has_value() && std::abs(found->distance - nearest) < 1e-6);
  RC_ASSERT(!distance(tree, shape, transform, scratch, nearest - 1e-6).has_value());
  std::vector<ShapeContact> all;
  RC_ASSERT(contacts(tree, shape, transform, 100000, &all, scratch));
  std::set<std::uint32_t> touched;
  for (const ShapeContact& contact : all) touched.insert(contact.sphere);
  RC_ASSERT(touched.size() == all.size());
  // Spheres that just touch may differ by the rounding of the transform.
  RC_ASSERT(std::max(touched.size(), expected.size()) - std::min(touched.size(), expected.size()) <= 2U);
  const PenaltyWrench push = penalty_wrench(tree, shape, transform, {.stiffness = 100.0, .p_AP = p_AP}, scratch);
  RC_ASSERT((push.force - force).norm() < 1e-4 * force.norm() + 1e-3);
  RC_ASSERT((push.torque - torque).norm() < 1e-4 * force.norm() + 1e-3);
  const SphereOverlap shared = overlap_volume(tree, shape, transform, scratch);
  double volume = 0.0;
  for (const ShapeContact& contact : all) volume += static_cast<double>(contact.volume);
  RC_ASSERT(shared.pairs == all.size() && std::abs(shared.volume - volume) <= 1e-6 * volume);
}

TEST(StaticShapeQueries, AgreeWithEachSphereOnItsOwn) {
  const Tree tree = packed(geometry::Capsule{0.02, 0.06}, {.max_spheres = 150});
  SphereScratch scratch;
  for (const std::unique_ptr<StaticShape>& shape : every_shape())
    EXPECT_TRUE(tests::check_law([&] { expect_agreement(*tree, *shape, *tests::poses(0.1), scratch); }));
}

TEST(StaticShapeQueries, VolumeBehindAHalfSpaceIsExact) {
  const Tree tree = packed(geometry::Sphere{0.1}, {.max_spheres = 1});
  const auto radius = static_cast<double>(tree->packing().spheres()[0].radius);
  const Vector3d centre = tree->packing().spheres()[0].centre.cast<double>();
  const auto floor = *HalfSpace::make({0, 0, 1}, centre.z());
  SphereScratch scratch;
  std::vector<ShapeContact> found;
  EXPECT_TRUE(contacts(*tree, floor, Transform(), 10, &found, scratch));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].volume, 2.0 / 3.0 * std::numbers::pi * std::pow(radius, 3), 1e-8);
  EXPECT_NEAR(found[0].depth, radius, 1e-6);
  EXPECT_NEAR(found[0].position.z(), centre.z() - 0.5 * radius, 1e-6);
  EXPECT_EQ(found[0].normal, Vector3f(0, 0, -1));  // Into the floor.
}

// Against points drawn in the spheres.
TEST(StaticShapeQueries, VolumeIsThatOfTheHalfSpaceAndAtLeastThatOfAConvexSolid) {
  const Tree tree = packed(geometry::Capsule{0.02, 0.06}, {.max_spheres = 60});
  SphereScratch scratch;
  core::RandomStream stream(12, core::Purpose::kTest);
  const auto drawn = [&](const StaticShape& shape, const Pose& X_AB) {
    constexpr int kDraws = 1000;
    double volume = 0.0;
    for (const PackedSphere& sphere : tree->packing().spheres()) {
      const auto radius = static_cast<double>(sphere.radius);
      const Vector3d centre = X_AB.inverse() * sphere.centre.cast<double>();
      int inside = 0;
      for (int i = 0; i < kDraws;) {
        const double z = stream.uniform(-1, 1), y = stream.uniform(-1, 1), x = stream.uniform(-1, 1);
        const Vector3d q(x, y, z);
        if (q.squaredNorm() > 1.0) continue;
        ++i;
        inside += shape.is_within(centre + radius * q, 0.0) ? 1 : 0;
      }
      volume += 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) * inside / kDraws;
    }
    return volume;
  };
  const auto half_space = *HalfSpace::make({0.1, -0.2, 1}, 0.005);
  const auto box = *PrimitiveShape::make(geometry::BoxShape{{0.2, 0.2, 0.2}});
  const auto ball = *PrimitiveShape::make(geometry::Sphere{0.05});
  for (int i = 0; i < 10; ++i) {
    Pose X_AB;
    X_AB.rotation = geometry::exp_rotation({stream.uniform(-1, 1), stream.uniform(-1, 1), stream.uniform(-1, 1)});
    X_AB.translation = {stream.uniform(-0.02, 0.02), stream.uniform(-0.02, 0.02), stream.uniform(-0.02, 0.02)};
    const auto volume = [&](const StaticShape& shape) {
      return overlap_volume(*tree, shape, *to_transform(X_AB), scratch).volume;
    };
    EXPECT_NEAR(volume(half_space), drawn(half_space, X_AB), 0.02 * tree->packing().volume());
    X_AB.translation += X_AB.rotation * Vector3d(0.0, 0.0, 0.1);
    EXPECT_NEAR(volume(box), drawn(box, X_AB), 0.02 * tree->packing().volume());  // reaches over no edge
    X_AB.translation -= X_AB.rotation * Vector3d(0.0, 0.0, 0.05);
    const double of_ball = drawn(ball, X_AB);
    EXPECT_GE(volume(ball), of_ball - 0.01 * tree->packing().volume());
    EXPECT_LE(volume(ball), 1.5 * of_ball + 0.01 * tree->packing().volume());
  }
}

// A box that leans on its edge: the half-space's force turns it back or over.
TEST(StaticShapeQueries, PackedBoxTipsAtItsAngle) {
  SphereScratch scratch;
  const auto floor = *HalfSpace::make({0, 0, 1}, 0.0);
  for (const Vector3d& size : {Vector3d(0.06, 0.16, 0.21), Vector3d(0.05, 0.1, 0.1)}) {
    const Tree tree = packed(geometry::BoxShape{size}, {.max_spheres = 1000, .edge_fidelity = 0.001});
    const auto turns_back = [&](double angle) {
      Pose X_WA;
      X_WA.rotation = geometry::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY()));
      const double nearest = distance(*tree, floor, *relative_transform(X_WA, Pose()), scratch)->distance;
      X_WA.translation.z() = -nearest - 1e-5;  // Just into the floor.
      const PenaltyWrench push = penalty_wrench(*tree, floor, *relative_transform(X_WA, Pose()), {}, scratch);
      EXPECT_GT(push.pairs, 0U);
      return push.torque.y() < 0.0;
    };
    double low = 0.01;
    double high = 1.5;
    EXPECT_TRUE(turns_back(low));
    EXPECT_FALSE(turns_back(high));
    while (high - low > 1e-5) (turns_back(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    EXPECT_NEAR(low, std::atan2(size.x(), size.z()), 0.5 * std::numbers::pi / 180.0);
  }
}

TEST(StaticShapeQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations can't be counted in this build";
  const Tree tree = packed(geometry::Capsule{0.02, 0.06}, {.max_spheres = 150});
  const auto all = every_shape();
  SphereScratch scratch;
  std::vector<ShapeContact> found;
  const auto ask = [&] {
    for (const std::unique_ptr<StaticShape>& shape : all) {
      overlap(*tree, *shape, Transform(), scratch);
      overlap_volume(*tree, *shape, Transform(), scratch);
      distance(*tree, *shape, Transform(), scratch);
      penalty_wrench(*tree, *shape, Transform(), {}, scratch);
      found.clear();
      contacts(*tree, *shape, Transform(), 100000, &found, scratch);
    }
  };
  ask();
  const std::uint64_t before = tests::allocation_count();
  ask();
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::static_shape_queries_test
