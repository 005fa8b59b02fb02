// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "prescene/geometry/polygon.h"

namespace prescene::geometry {
namespace {

std::vector<Vector2d> points_in_square(int count, std::mt19937& random) {
  std::uniform_real_distribution<double> in(-1.0, 1.0);
  std::vector<Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double y = in(random), x = in(random);
    points.emplace_back(x, y);
  }
  return points;
}

double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// A point is a corner of the hull when some line through it has all others on one side: the definition, in n^3 time.
bool is_corner(const std::vector<Vector2d>& points, std::size_t i) {
  for (std::size_t j = 0; j < points.size(); ++j) {
    if (j == i) continue;
    bool others_left = true;
    for (std::size_t k = 0; k < points.size(); ++k)
      others_left = others_left && (k == i || k == j || turn(points[i], points[j], points[k]) > 0.0);
    if (others_left) return true;
  }
  return false;
}

/// Distance to the polygon's boundary, from 2000 points on each side.
double distance_to_sides(const std::vector<Vector2d>& corners, const Vector2d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (int s = 0; s <= 2000; ++s)
      least = std::min(least, (corners[i] + s / 2000.0 * (corners[(i + 1) % corners.size()] - corners[i]) - p).norm());
  return least;
}

TEST(ConvexPolygonLaws, CornersAreThoseOfTheDefinition) {
  std::mt19937 random(11);
  for (int round = 0; round < 100; ++round) {
    const auto points = points_in_square(3 + round % 20, random);
    const auto corners = convex_polygon(points);
    std::size_t expected = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool found = std::find(corners.begin(), corners.end(), points[i]) != corners.end();
      EXPECT_EQ(found, is_corner(points, i));
      expected += found ? 1 : 0;
    }
    ASSERT_EQ(corners.size(), expected) << "a corner twice";
    for (std::size_t i = 0; i < corners.size(); ++i) {
      EXPECT_GT(turn(corners[i], corners[(i + 1) % corners.size()], corners[(i + 2) % corners.size()]), 0.0);
      EXPECT_GE(corners[i].x(), corners[0].x());
    }
  }
}

TEST(ConvexPolygonLaws, DependsOnTheSetOfPointsOnly) {
  std::mt19937 random(12);
  for (int round = 0; round < 50; ++round) {
    auto points = points_in_square(12, random);
    const auto corners = convex_polygon(points);
    points.insert(points.end(), points.begin(), points.begin() + 5);
    points.push_back(0.5 * (corners[0] + corners[1]) * 0.999);
    std::shuffle(points.begin(), points.end(), random);
    EXPECT_EQ(convex_polygon(points), corners);
    EXPECT_EQ(convex_polygon(corners), corners);
  }
}

TEST(ConvexPolygonLaws, DistancesAreThoseToTheSides) {
  std::mt19937 random(13);
  for (int round = 0; round < 20; ++round) {
    const auto corners = convex_polygon(points_in_square(8, random));
    for (const Vector2d& p : points_in_square(20, random)) {
      const double sides = distance_to_sides(corners, p);
      const double inside = distance_inside(corners, p), outside = distance_outside(corners, p);
      EXPECT_EQ(inside >= 0.0, outside == 0.0);
      EXPECT_NEAR(inside >= 0.0 ? inside : outside, sides, 1e-3);
      EXPECT_LE(-inside, outside + 1e-12) << "to a line it is no farther than to its side";
    }
  }
}

TEST(ConvexPolygon, OfPointsWithoutAnAreaIsWhatTheySpan) {
  EXPECT_TRUE(convex_polygon({}).empty());
  const Vector2d a(1.0, 2.0), b(3.0, 2.0), middle(2.0, 2.0);
  EXPECT_EQ(convex_polygon({a}), std::vector<Vector2d>{a});
  EXPECT_EQ(convex_polygon({a, a, a}), std::vector<Vector2d>{a});
  const std::vector<Vector2d> ends{a, b};
  EXPECT_EQ(convex_polygon({b, a}), ends);
  EXPECT_EQ(convex_polygon({b, middle, a, middle}), ends);
  const std::vector<Vector2d> upright{{0.0, -1.0}, {0.0, 1.0}};
  EXPECT_EQ(convex_polygon({{0.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}), upright);
  EXPECT_EQ(distance_inside(ends, middle), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(distance_outside(ends, {2.0, 5.0}), 3.0);
  EXPECT_EQ(distance_outside(ends, {7.0, 2.0}), 4.0);
  EXPECT_EQ(distance_outside(std::vector{a}, {1.0, 0.0}), 2.0);
  EXPECT_EQ(distance_outside({}, a), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace prescene::geometry
