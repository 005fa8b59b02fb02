// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_queries.h"

#include <gmock/gmock.h>

#include <hwy/highway.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <vector>

#include "prescene/collision/spheres/scalar_sphere_queries.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/allocations.h"
#include "tests/support/generators.h"

namespace prescene::collision::sphere_queries_test {
namespace {

using Eigen::Vector3d;
using Tree = std::shared_ptr<const SphereTree>;

constexpr std::array<int, 3> kBranchings = {4, 8, 16};

core::ThreadPool& pool() {
  static core::ThreadPool threads(2);
  return threads;
}

std::shared_ptr<const SpherePacking> to_packing(std::vector<PackedSphere> spheres) {
  const SurfaceAnchor anchor{Vector3f::UnitZ(), Vector3f::UnitZ()};
  std::vector<SurfaceAnchor> anchors(spheres.size(), anchor);
  return *SpherePacking::make(std::move(spheres), std::move(anchors), "spheres");
}

Tree to_tree(const std::shared_ptr<const SpherePacking>& packing, int branching = 16) {
  return *SphereTree::make(packing, {.branching = branching}, pool());
}

std::shared_ptr<const SpherePacking> packed(const geometry::Primitive& primitive, int spheres) {
  return pack_spheres(**Mesh::make(geometry::make_mesh(primitive), "body"), {.max_spheres = spheres}, pool())->packing;
}

// Not a packing, for the spheres may overlap each other: queries don't mind.
std::shared_ptr<const SpherePacking> random_packing(std::size_t count, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<PackedSphere> spheres(count);
  for (PackedSphere& sphere : spheres) {
    for (int axis = 0; axis < 3; ++axis) sphere.centre[axis] = static_cast<float>(stream.uniform(-1.0, 1.0));
    sphere.radius = static_cast<float>(stream.uniform(1e-3, 0.15));
  }
  return to_packing(std::move(spheres));
}

std::vector<Transform> random_transforms(int count, std::uint64_t seed, double reach) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<Transform> transforms = {Transform()};
  while (static_cast<int>(transforms.size()) < count) {
    geometry::Pose X;
    const double z = stream.normal(), y = stream.normal(), x = stream.normal(), w = stream.normal();
    const Eigen::Vector4d q(w, x, y, z);
    X.rotation = geometry::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    for (int axis = 0; axis < 3; ++axis) X.translation[axis] = stream.uniform(-reach, reach);
    transforms.push_back(*to_transform(X));
  }
  return transforms;
}

// Runs `body` with each instruction set that this processor has.
void on_each_target(const std::function<void()>& body) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (target == HWY_SSSE3) continue;  // The library has no code for it.
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    SCOPED_TRACE(hwy::TargetName(target));
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

// Over all pairs.
struct BruteForce {
  std::set<SpherePair> pairs;
  double volume = 0.0;
  double distance = std::numeric_limits<double>::infinity();
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  double energy = 0.0;
};
BruteForce brute_force(const SpherePacking& a, const SpherePacking& b, const Transform& X_AB, const Vector3d& p_AP) {
  BruteForce result;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    for (std::uint32_t k = 0; k < b.size(); ++k) {
      const PackedSphere& s = a.spheres()[i];
      const PackedSphere t{X_AB * b.spheres()[k].centre, b.spheres()[k].radius};
      const Vector3f apart = t.centre - s.centre;
      const float squared = (apart.x() * apart.x() + apart.y() * apart.y()) + apart.z() * apart.z();
      const float reach = s.radius + t.radius;
      const Vector3d away = s.centre.cast<double>() - t.centre.cast<double>();
      const double d = away.norm();
      const double gap = d - static_cast<double>(s.radius) - static_cast<double>(t.radius);
      result.distance = std::min(result.distance, gap);
      if (!(squared <= reach * reach)) continue;
      result.pairs.insert({i, k});
      result.volume += lens_volume(static_cast<double>(s.radius), static_cast<double>(t.radius), d);
      const double half = 0.5 * std::max(0.0, -gap);
      const Vector3d push = d > 0.0 ? Vector3d(away / d * half) : Vector3d(Vector3d::Zero());
      result.force += push;
      result.torque += (s.centre.cast<double>() - p_AP).cross(push);
      result.energy += half * half;
    }
  }
  return result;
}

std::set<SpherePair> pairs_of(const std::vector<SphereContact>& contacts) {
  std::set<SpherePair> pairs;
  for (const SphereContact& contact : contacts) pairs.insert(contact.pair);
  return pairs;
}

void expect_agreement(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch) {
  const Vector3d p_AP(0.1, -0.2, 0.3);
  const PenaltyOptions options{.stiffness = 10.0, .p_AP = p_AP};
  const BruteForce expected = brute_force(a.packing(), b.packing(), X_AB, p_AP);
  EXPECT_EQ(overlap(a, b, X_AB, scratch), !expected.pairs.empty());
  EXPECT_EQ(scalar::overlap(a, b, X_AB, scratch), !expected.pairs.empty());
  for (const bool vectors : {true, false}) {
    const SphereOverlap volume =
        vectors ? overlap_volume(a, b, X_AB, scratch) : scalar::overlap_volume(a, b, X_AB, scratch);
    EXPECT_EQ(volume.pairs, expected.pairs.size());
    EXPECT_NEAR(volume.volume, expected.volume, 2e-5 * expected.volume + 1e-12);
    const PenaltyWrench push =
        vectors ? penalty_wrench(a, b, X_AB, options, scratch) : scalar::penalty_wrench(a, b, X_AB, options, scratch);
    const double scale = 10.0 * std::sqrt(expected.energy * static_cast<double>(expected.pairs.size()));
    EXPECT_LE((push.force - 10.0 * expected.force).norm(), 1e-5 * scale);
    EXPECT_LE((push.torque - 10.0 * expected.torque).norm(), 2e-5 * scale);
    EXPECT_NEAR(push.energy, 10.0 * expected.energy, 2e-5 * push.energy + 1e-12);
    EXPECT_EQ(push.pairs, expected.pairs.size());
    std::vector<SphereContact> all;
    EXPECT_TRUE(vectors ? contacts(a, b, X_AB, 1'000'000, &all, scratch)
                        : scalar::contacts(a, b, X_AB, 1'000'000, &all, scratch));
    EXPECT_EQ(all.size(), expected.pairs.size());
    EXPECT_EQ(pairs_of(all), expected.pairs);
    const auto nearest = vectors ? distance(a, b, X_AB, scratch) : scalar::distance(a, b, X_AB, scratch);
    ASSERT_TRUE(nearest.has_value());
    EXPECT_NEAR(nearest->distance, expected.distance, 1e-6);
  }
}

TEST(SphereQueries, AgreeWithBruteForceOnEveryTarget) {
  const auto a = random_packing(90, 1);
  const auto b = random_packing(150, 2);
  SphereScratch scratch;
  on_each_target([&] {
    for (const int branching : kBranchings) {
      const Tree tree_a = to_tree(a, branching);
      const Tree tree_b = to_tree(b, branching);
      for (const Transform& X_AB : random_transforms(12, 3, 2.2)) expect_agreement(*tree_a, *tree_b, X_AB, scratch);
      // One inside of itself: lanes that are not used must not meet.
      expect_agreement(*tree_a, *tree_a, Transform(), scratch);
    }
  });
}

TEST(SphereQueries, AgreeForSmallTreesAndDifferentBranchings) {
  SphereScratch scratch;
  for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{20}}) {
    for (const int branching_a : kBranchings) {
      for (const int branching_b : kBranchings) {
        const Tree a = to_tree(random_packing(count, 5), branching_a);
        const Tree b = to_tree(random_packing(60, 6), branching_b);
        for (const Transform& X_AB : random_transforms(5, count, 1.0)) {
          expect_agreement(*a, *b, X_AB, scratch);
          expect_agreement(*b, *a, X_AB, scratch);
        }
      }
    }
  }
}

TEST(SphereQueries, GiveTheSameBitsOnEveryTarget) {
  for (const int branching : kBranchings) {
    const Tree a = to_tree(packed(geometry::BoxShape{{0.1, 0.2, 0.3}}, 600), branching);
    const Tree b = to_tree(packed(geometry::Cylinder{0.1, 0.2}, 600), branching);
    SphereScratch scratch;
    const Transform X_AB = random_transforms(2, 8, 0.1)[1];
    std::vector<std::array<double, 9>> answers;
    on_each_target([&] {
      const SphereOverlap volume = overlap_volume(*a, *b, X_AB, scratch);
      const PenaltyWrench push = penalty_wrench(*a, *b, X_AB, {}, scratch);
      EXPECT_GT(volume.pairs, 100U);
      answers.push_back({volume.volume, push.force.x(), push.force.y(), push.force.z(), push.torque.x(),
                         push.torque.y(), push.torque.z(), push.energy, distance(*a, *b, X_AB, scratch)->distance});
    });
    for (const auto& answer : answers) EXPECT_EQ(answer, answers[0]);
  }
}

TEST(SphereQueries, TouchingSpheresOverlap) {
  const Tree a = to_tree(to_packing({{Vector3f(0, 0, 0), 1.0F}}));
  const Tree b = to_tree(to_packing({{Vector3f(0, 0, 0), 2.0F}}));
  SphereScratch scratch;
  Transform X_AB;
  X_AB.translation = {0, 3, 0};
  EXPECT_TRUE(overlap(*a, *b, X_AB, scratch));
  EXPECT_EQ(distance(*a, *b, X_AB, scratch)->distance, 0.0);
  EXPECT_EQ(overlap_volume(*a, *b, X_AB, scratch).volume, 0.0);
  X_AB.translation = {0, std::nextafter(3.0F, 4.0F), 0};
  EXPECT_FALSE(overlap(*a, *b, X_AB, scratch));
  EXPECT_GT(distance(*a, *b, X_AB, scratch)->distance, 0.0);
}

TEST(SphereQueries, ContactOfTwoSpheresByHand) {
  const Tree a = to_tree(to_packing({{Vector3f(0, 0, 0), 2.0F}}));
  const Tree b = to_tree(to_packing({{Vector3f(0, 0, 0), 1.0F}}));
  SphereScratch scratch;
  Transform X_AB;
  X_AB.translation = {2.5F, 0, 0};
  std::vector<SphereContact> found;
  EXPECT_TRUE(contacts(*a, *b, X_AB, 5, &found, scratch));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].position, Vector3f(1.75F, 0, 0));  // The overlap reaches from 1.5 to 2.
  EXPECT_EQ(found[0].normal, Vector3f(1, 0, 0));
  EXPECT_EQ(found[0].depth, 0.5F);
  const PenaltyWrench push = penalty_wrench(*a, *b, X_AB, {.stiffness = 8.0, .p_AP = Vector3d(0, -1, 0)}, scratch);
  EXPECT_TRUE(push.force.isApprox(Vector3d(-2.0, 0, 0)));
  EXPECT_TRUE(push.torque.isApprox(Vector3d(0, 0, 2.0)));
  EXPECT_NEAR(push.energy, 0.5, 1e-12);
  // Centres that fall together: no direction, hence no force; the contact points as A's anchor does.
  X_AB.translation = {0, 0, 0};
  EXPECT_EQ(penalty_wrench(*a, *b, X_AB, {}, scratch).force, Vector3d::Zero());
  found.clear();
  EXPECT_TRUE(contacts(*a, *b, X_AB, 5, &found, scratch));
  EXPECT_EQ(found[0].normal, Vector3f(0, 0, 1));
}

TEST(LensVolume, ClosedForms) {
  const double ball = 4.0 / 3.0 * std::numbers::pi;
  EXPECT_EQ(lens_volume(1.0, 1.0, 2.0), 0.0);
  EXPECT_NEAR(lens_volume(1.0, 1.0, 0.0), ball, 1e-12);
  EXPECT_NEAR(lens_volume(3.0, 1.0, 1.5), ball, 1e-12);  // Inside.
  EXPECT_NEAR(lens_volume(3.0, 1.0, 2.0), ball, 1e-9);   // Inside, touching.
  EXPECT_NEAR(lens_volume(1.0, 1.0, 1.0), 5.0 / 12.0 * std::numbers::pi, 1e-12);
  // Two caps of height h1 and h2 about the plane of intersection.
  const double x = (2.0 * 2.0 + 1.5 * 1.5 - 1.0) / (2.0 * 2.0);
  const auto cap = [](double r, double h) { return std::numbers::pi * h * h * (3.0 * r - h) / 3.0; };
  EXPECT_NEAR(lens_volume(1.5, 1.0, 2.0), cap(1.5, 1.5 - x) + cap(1.0, 1.0 - (2.0 - x)), 1e-12);
}

TEST(OverlapVolume, TendsToTheVolumeThatTheBoxesShare) {
  const geometry::BoxShape box{{0.2, 0.2, 0.2}};
  Transform X_AB;
  X_AB.translation = {0.1F, 0.05F, 0.0F};
  const double shared = 0.1 * 0.15 * 0.2;
  double before = 0.0;
  SphereScratch scratch;
  for (const int spheres : {50, 500, 5000}) {
    const Tree tree = to_tree(packed(box, spheres));
    const double volume = overlap_volume(*tree, *tree, X_AB, scratch).volume;
    EXPECT_GT(volume, before);
    EXPECT_LT(volume, shared);
    before = volume;
  }
  EXPECT_GT(before, 0.6 * shared);  // About the square of the share that is filled.
}

TEST(Contacts, StopAtTheLimit) {
  const Tree tree = to_tree(packed(geometry::BoxShape{{0.2, 0.2, 0.2}}, 300));
  SphereScratch scratch;
  std::vector<SphereContact> found;
  EXPECT_FALSE(contacts(*tree, *tree, Transform(), 10, &found, scratch));
  EXPECT_EQ(found.size(), 10U);
  EXPECT_FALSE(scalar::contacts(*tree, *tree, Transform(), 10, &found, scratch));
  EXPECT_EQ(found.size(), 20U);
}

TEST(Distance, TakesASeedAndALimit) {
  const Tree a = to_tree(random_packing(300, 11));
  const Tree b = to_tree(random_packing(300, 12));
  SphereScratch scratch;
  Transform X_AB;
  X_AB.translation = {3.0F, 0.4F, 0.0F};
  const auto nearest = distance(*a, *b, X_AB, scratch);
  ASSERT_TRUE(nearest.has_value());
  EXPECT_EQ(distance(*a, *b, X_AB, scratch, nearest->distance), std::nullopt);
  EXPECT_EQ(scalar::distance(*a, *b, X_AB, scratch, nearest->distance), std::nullopt);
  EXPECT_EQ(distance(*a, *b, X_AB, scratch, nearest->distance + 1e-6)->pair, nearest->pair);
  // Also with one of other bodies, that these have no such spheres for.
  for (const SpherePair& seed :
       {nearest->pair, SpherePair{5, 7}, SpherePair{5, 1'000'000}, SpherePair{4'000'000'000, 0}}) {
    EXPECT_NEAR(distance(*a, *b, X_AB, scratch, 100.0, seed)->distance, nearest->distance, 1e-6);
    EXPECT_NEAR(scalar::distance(*a, *b, X_AB, scratch, 100.0, seed)->distance, nearest->distance, 1e-6);
  }
}

TEST(SphereQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations can't be counted in this build";
  const Tree a = to_tree(random_packing(400, 21));
  const Tree b = to_tree(random_packing(400, 22));
  SphereScratch scratch;
  std::vector<SphereContact> found;
  const std::vector<Transform> transforms = random_transforms(20, 23, 1.5);
  const auto ask = [&] {
    for (const Transform& X_AB : transforms) {
      overlap(*a, *b, X_AB, scratch);
      overlap_volume(*a, *b, X_AB, scratch);
      penalty_wrench(*a, *b, X_AB, {}, scratch);
      distance(*a, *b, X_AB, scratch);
      found.clear();
      contacts(*a, *b, X_AB, 1'000'000, &found, scratch);
      scalar::overlap_volume(*a, *b, X_AB, scratch);
      scalar::distance(*a, *b, X_AB, scratch);
    }
  };
  ask();
  const std::uint64_t before = tests::allocation_count();
  ask();
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::sphere_queries_test
