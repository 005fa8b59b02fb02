// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/generators.h"

namespace prescene::collision::sphere_queries_laws_test {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using Tree = std::shared_ptr<const SphereTree>;

core::ThreadPool& pool() {
  static core::ThreadPool threads(2);
  return threads;
}

Tree packed(const geometry::Primitive& primitive) {
  const auto mesh = *Mesh::make(geometry::make_mesh(primitive), "body");
  return *SphereTree::make(pack_spheres(*mesh, {.max_spheres = 300}, pool())->packing, {}, pool());
}

// A bottle-like and a box-like body of about a decimetre.
struct Bodies {
  Tree a = packed(geometry::Capsule{0.03, 0.1});
  Tree b = packed(geometry::BoxShape{{0.1, 0.07, 0.05}});
};
const Bodies& bodies() {
  static const Bodies kBodies;
  return kBodies;
}

Pose near_pose() { return *tests::poses(0.08); }

constexpr double kRounding = 2e-6;  // m, of poses of a decimetre in single precision, with room.

TEST(SphereQueriesLaw, SymmetricInTheBodies) {
  EXPECT_TRUE(tests::check_law([] {
    const auto& [a, b] = bodies();
    SphereScratch scratch;
    const Pose X_AB = near_pose();
    const Transform there = *to_transform(X_AB);
    const Transform back = *to_transform(X_AB.inverse());
    const auto forth_distance = distance(*a, *b, there, scratch);
    RC_ASSERT(std::abs(forth_distance->distance - distance(*b, *a, back, scratch)->distance) < kRounding);
    if (std::abs(forth_distance->distance) > kRounding)
      RC_ASSERT(overlap(*a, *b, there, scratch) == overlap(*b, *a, back, scratch));
    RC_ASSERT(overlap(*a, *b, there, scratch) == (forth_distance->distance <= 0.0) ||
              std::abs(forth_distance->distance) < kRounding);
    const double volume = overlap_volume(*a, *b, there, scratch).volume;
    RC_ASSERT(std::abs(volume - overlap_volume(*b, *a, back, scratch).volume) < 1e-3 * volume + 1e-10);
    // Each body gets the opposite of what the other gets.
    const PenaltyWrench on_a = penalty_wrench(*a, *b, there, {}, scratch);
    const PenaltyWrench on_b = penalty_wrench(*b, *a, back, {.p_AP = X_AB.inverse().translation}, scratch);
    const Eigen::Matrix3d R_AB = X_AB.rotation.toRotationMatrix();
    const double scale = 1e-3 * std::sqrt(on_a.energy) + 1e-4;
    RC_ASSERT((on_a.force + R_AB * on_b.force).norm() < scale);
    RC_ASSERT((on_a.torque + R_AB * on_b.torque).norm() < scale);
  }));
}

// The same spheres, described in another frame.
Tree moved(const Tree& tree, const Pose& X_MB) {
  std::vector<PackedSphere> spheres(tree->packing().spheres().begin(), tree->packing().spheres().end());
  for (PackedSphere& sphere : spheres) sphere.centre = (X_MB * Vector3d(sphere.centre.cast<double>())).cast<float>();
  std::vector<SurfaceAnchor> anchors(tree->packing().anchors().begin(), tree->packing().anchors().end());
  for (SurfaceAnchor& anchor : anchors) {
    anchor.point = (X_MB * Vector3d(anchor.point.cast<double>())).cast<float>();
    anchor.normal = (X_MB.rotation * Vector3d(anchor.normal.cast<double>())).cast<float>();
  }
  return *SphereTree::make(*SpherePacking::make(std::move(spheres), std::move(anchors), "moved"), {}, pool());
}

TEST(SphereQueriesLaw, FramesOfTheBodiesDoNotMatter) {
  EXPECT_TRUE(tests::check_law([] {
    const auto& [a, b] = bodies();
    SphereScratch scratch;
    const Pose X_MA = *tests::poses(0.1);
    const Pose X_NB = *tests::poses(0.1);
    const Tree other_a = moved(a, X_MA);
    const Tree other_b = moved(b, X_NB);
    const Pose X_AB = near_pose();
    const Transform here = *to_transform(X_AB);
    const Transform there = *to_transform(X_MA * X_AB * X_NB.inverse());
    RC_ASSERT(std::abs(distance(*a, *b, here, scratch)->distance -
                       distance(*other_a, *other_b, there, scratch)->distance) < kRounding);
    const double volume = overlap_volume(*a, *b, here, scratch).volume;
    RC_ASSERT(std::abs(volume - overlap_volume(*other_a, *other_b, there, scratch).volume) < 1e-3 * volume + 1e-10);
    const Vector3d p_AP = *tests::vectors(0.05);
    const PenaltyWrench push = penalty_wrench(*a, *b, here, {.p_AP = p_AP}, scratch);
    const PenaltyWrench other = penalty_wrench(*other_a, *other_b, there, {.p_AP = X_MA * p_AP}, scratch);
    const double scale = 1e-3 * std::sqrt(push.energy) + 1e-4;
    RC_ASSERT((X_MA.rotation * push.force - other.force).norm() < scale);
    RC_ASSERT((X_MA.rotation * push.torque - other.torque).norm() < scale);
    if (std::abs(distance(*a, *b, here, scratch)->distance) > kRounding)
      RC_ASSERT(overlap(*a, *b, here, scratch) == overlap(*other_a, *other_b, there, scratch));
  }));
}

TEST(SphereQueriesLaw, DistanceChangesByAtMostTheWay) {
  EXPECT_TRUE(tests::check_law([] {
    const auto& [a, b] = bodies();
    SphereScratch scratch;
    Pose X_AB = near_pose();
    const double before = distance(*a, *b, *to_transform(X_AB), scratch)->distance;
    const Vector3d way = *tests::vectors(0.1);
    X_AB.translation += way;
    const double after = distance(*a, *b, *to_transform(X_AB), scratch)->distance;
    RC_ASSERT(std::abs(after - before) <= way.norm() + kRounding);
  }));
}

TEST(SphereQueriesLaw, SharedVolumeIsAtMostEitherVolume) {
  EXPECT_TRUE(tests::check_law([] {
    const auto& [a, b] = bodies();
    SphereScratch scratch;
    const double volume = overlap_volume(*a, *b, *to_transform(near_pose()), scratch).volume;
    RC_ASSERT(volume >= 0.0);
    RC_ASSERT(volume <= std::min(a->packing().volume(), b->packing().volume()) * (1.0 + 1e-5));
  }));
}

TEST(SphereQueriesLaw, MoreSpheresShareMoreVolume) {
  const auto mesh = *Mesh::make(geometry::make_mesh(geometry::Capsule{0.03, 0.1}), "body");
  const auto all = pack_spheres(*mesh, {.max_spheres = 200}, pool())->packing;
  const auto first = [&](std::ptrdiff_t count) {
    return *SphereTree::make(*SpherePacking::make({all->spheres().begin(), all->spheres().begin() + count},
                                                  {all->anchors().begin(), all->anchors().begin() + count}, "first"),
                             {}, pool());
  };
  const Tree few = first(40);
  const Tree many = first(200);
  EXPECT_TRUE(tests::check_law([&] {
    SphereScratch scratch;
    const Transform X_AB = *to_transform(near_pose());
    RC_ASSERT(overlap_volume(*few, *bodies().b, X_AB, scratch).volume <=
              overlap_volume(*many, *bodies().b, X_AB, scratch).volume * (1.0 + 1e-6));
    RC_ASSERT(distance(*few, *bodies().b, X_AB, scratch)->distance >=
              distance(*many, *bodies().b, X_AB, scratch)->distance - 1e-9);
  }));
}

TEST(SphereQueriesLaw, ForceAndTorqueAreTheGradientOfTheEnergy) {
  EXPECT_TRUE(tests::check_law([] {
    const Tree& a = bodies().a;
    const Tree& b = bodies().b;
    SphereScratch scratch;
    const Pose X_WB = near_pose();
    // A stands at the world's origin, and its frame's origin is the point of the torque.
    const PenaltyWrench push = penalty_wrench(*a, *b, *to_transform(X_WB), {.stiffness = 1e6}, scratch);
    const double step = 2e-5;
    const auto energy = [&](const Pose& X_WA) {
      return penalty_wrench(*a, *b, *relative_transform(X_WA, X_WB), {.stiffness = 1e6}, scratch).energy;
    };
    const double scale = std::sqrt(1e6 * static_cast<double>(push.pairs) * push.energy) + 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d unit = Vector3d::Unit(axis);
      const double slope =
          (energy(Pose::from_translation(step * unit)) - energy(Pose::from_translation(-step * unit))) / (2.0 * step);
      RC_ASSERT(std::abs(push.force[axis] + slope) < 0.02 * scale);
      Pose turned;
      turned.rotation = geometry::Quaterniond(Eigen::AngleAxisd(step, unit));
      Pose back;
      back.rotation = turned.rotation.conjugate();
      const double turn_slope = (energy(turned) - energy(back)) / (2.0 * step);
      RC_ASSERT(std::abs(push.torque[axis] + turn_slope) < 0.02 * 0.1 * scale);
    }
  }));
}

}  // namespace
}  // namespace prescene::collision::sphere_queries_laws_test
