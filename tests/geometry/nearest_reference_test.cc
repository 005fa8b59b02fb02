// SPDX-License-Identifier: Apache-2.0
// Nearest points and pose errors against brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "prescene/geometry/point_tree.h"
#include "prescene/geometry/pose_error.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/allocations.h"
#include "tests/support/generators.h"

namespace prescene::geometry {
namespace {

// In the order of additions that the tree keeps, so that equal means equal.
double squared_distance(const Vector3d& p, const Vector3d& q) {
  const Eigen::Array3d squares = (p - q).array().square();
  return squares[0] + (squares[1] + squares[2]);
}

double squared_to_nearest(const std::vector<Vector3d>& points, const Vector3d& q) {
  double best = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) best = std::min(best, squared_distance(p, q));
  return best;
}

double adds_by_definition(const std::vector<Vector3d>& points, const Pose& X_estimate, const Pose& X_truth) {
  std::vector<Vector3d> estimated;
  for (const Vector3d& p : points) estimated.push_back(X_estimate * p);
  double sum = 0.0;
  for (const Vector3d& p : points) sum += std::sqrt(squared_to_nearest(estimated, X_truth * p));
  return sum / static_cast<double>(points.size());
}

double add_by_definition(const std::vector<Vector3d>& points, const Pose& X_estimate, const Pose& X_truth) {
  double sum = 0.0;
  for (const Vector3d& p : points) sum += (X_estimate * p - X_truth * p).norm();
  return sum / static_cast<double>(points.size());
}

std::vector<Vector3d> surface_points(int count, std::uint64_t seed) {
  std::vector<Vector3d> points;
  for (const SurfacePoint& p : sample_surface(make_mesh(BoxShape{{0.06, 0.16, 0.21}}), count, seed)) {
    points.push_back(p.position);
  }
  return points;
}

TEST(PointTree, FindsWhatBruteForceFinds) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    // Clouds with many equal coordinates and equal points too.
    const int count = *rc::gen::inRange(1, 200);
    const bool grid = *rc::gen::arbitrary<bool>();
    std::vector<Vector3d> points;
    for (int i = 0; i < count; ++i) {
      Vector3d p = normal_vector(stream);
      if (grid) p = p.array().round();
      points.push_back(p);
    }
    const PointTree tree(points);
    RC_ASSERT(tree.size() == points.size());
    for (int i = 0; i < 20; ++i) {
      const Vector3d q = 2.0 * normal_vector(stream);
      const double expected = squared_to_nearest(points, q);
      const PointTree::Nearest found = tree.nearest(q);
      RC_ASSERT(found.squared_distance == expected);
      RC_ASSERT(squared_distance(points[found.index], q) == expected);
      const auto hint = static_cast<std::uint32_t>(stream.uniform_below(points.size()));
      RC_ASSERT(tree.nearest(q, hint).squared_distance == expected);
    }
  }));
}

TEST(PointTree, OrderIsAPermutation) {
  const std::vector<Vector3d> points = surface_points(777, 1);
  const PointTree tree(points);
  std::vector<bool> seen(points.size(), false);
  for (const std::uint32_t i : tree.order()) seen[i] = true;
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 777);
}

TEST(PoseError, MatchesItsDefinition) {
  const std::vector<Vector3d> points = surface_points(300, 2);
  const AddsEvaluator evaluator(points);
  EXPECT_TRUE(tests::check_law([&] {
    const Pose X_truth = *tests::poses();
    Vector6d d = *tests::pose_errors();
    d *= std::pow(10.0, *tests::numbers(-5.0, 0.0));
    const Pose X_estimate = box_plus(X_truth, d);
    const double add = add_by_definition(points, X_estimate, X_truth);
    const double adds = adds_by_definition(points, X_estimate, X_truth);
    RC_ASSERT(std::abs(evaluator.add(X_estimate, X_truth) - add) < 1e-13);
    RC_ASSERT(std::abs(evaluator.add(X_estimate, X_truth) - add) < 1e-13);
    RC_ASSERT(std::abs(evaluator.adds(X_estimate, X_truth) - adds) < 1e-13);
    RC_ASSERT(std::abs(evaluator.adds(X_estimate, X_truth) - adds) < 1e-13);
    RC_ASSERT(adds <= add + 1e-13);
  }));
}

TEST(PoseError, LargeSetsOfPointsMatchToo) {
  const std::vector<Vector3d> points = surface_points(2600, 3);
  const AddsEvaluator evaluator(points);
  core::RandomStream stream(4, core::Purpose::kTest);
  for (const double scale : {0.001, 0.01, 0.1, 1.0}) {
    const Pose X_truth{uniform_rotation(stream), normal_vector(stream)};
    Vector6d d;
    d << 10.0 * scale * normal_vector(stream), scale * normal_vector(stream);
    const Pose X_estimate = box_plus(X_truth, d);
    EXPECT_NEAR(evaluator.adds(X_estimate, X_truth), adds_by_definition(points, X_estimate, X_truth), 1e-13);
  }
}

TEST(PoseError, AnEvaluatorAllocatesNothing) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "this build brings its own allocator";
  const AddsEvaluator evaluator(surface_points(500, 6));
  const Pose X_truth{exp_rotation({0.2, 0.7, -0.4}), {0.3, 0.2, 0.9}};
  const std::uint64_t before = tests::allocation_count();
  const double error = evaluator.adds(Pose(), X_truth) + evaluator.add(Pose(), X_truth);
  EXPECT_EQ(tests::allocation_count(), before);
  EXPECT_GT(error, 0.0);
}

TEST(PoseError, TranslationAloneIsItsLength) {
  const AddsEvaluator evaluator(surface_points(100, 5));
  const Pose X{exp_rotation({0.2, 0.7, -0.4}), {0.3, 0.2, 0.9}};
  const Pose moved{X.rotation, X.translation + Vector3d(0.003, 0.004, 0.0)};
  EXPECT_NEAR(evaluator.add(moved, X), 0.005, 1e-15);
  EXPECT_NEAR(evaluator.adds(X, X), 0.0, 1e-15);
}

}  // namespace
}  // namespace prescene::geometry
