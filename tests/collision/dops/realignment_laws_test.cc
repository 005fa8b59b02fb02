// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/realignment.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include "prescene/core/check.h"
#include "prescene/core/random.h"

namespace prescene::collision {
namespace {

TEST(HalfPrecision, RoundsUp) {
  // All finite halves, and numbers between neighbours.
  for (std::uint32_t bits = 0; bits < 0x7C00; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const auto value = static_cast<double>(from_half(half));
    ASSERT_EQ(round_up_to_half(value), half);
    if (bits > 0) {
      ASSERT_EQ(from_half(round_up_to_half(-value)), -from_half(half));
      const auto before = static_cast<double>(from_half(static_cast<std::uint16_t>(bits - 1)));
      ASSERT_GT(value, before);
      for (const double share : {1e-9, 0.5, 0.999}) {
        const double between = before + share * (value - before);
        ASSERT_EQ(round_up_to_half(between), half);
        ASSERT_EQ(static_cast<double>(from_half(round_up_to_half(-between))), -before);
      }
    }
  }
}

TEST(SinglePrecision, RoundsUp) {
  core::RandomStream random(1, core::Purpose::kTest);
  for (int i = 0; i < 10'000; ++i) {
    const double mantissa = random.normal();
    const double value = mantissa * std::pow(10.0, random.uniform(-30.0, 30.0));
    ASSERT_GE(static_cast<double>(round_up(value)), value);
    ASSERT_LT(static_cast<double>(std::nextafter(round_up(value), -std::numeric_limits<float>::infinity())), value);
  }
}

std::shared_ptr<const Mesh> cloud(core::RandomStream& random, double size, double offset) {
  std::vector<Vector3f> vertices;
  const double shift_y = random.uniform(-offset, offset), shift_x = random.uniform(-offset, offset);
  const Eigen::Vector3d shift(shift_x, shift_y, offset);
  for (int i = 0; i < 30; ++i) {
    const double z = random.normal(), y = random.normal(), x = random.normal();
    vertices.push_back((shift + size * Eigen::Vector3d(x, y, z)).cast<float>());
  }
  std::vector<TriangleIndices> triangles;
  for (std::uint32_t i = 0; i + 2 < 30; i += 3) triangles.push_back({i, i + 1, i + 2});
  const auto made = Mesh::make(std::move(vertices), std::move(triangles), "cloud");
  PRESCENE_CHECK(made.ok());
  return *made;
}

// The bound along each of A's directions is below every vertex of B that was placed with rounding, and for all k but
// the smallest not much below.
TEST(Realignment, BoundsPlacedVertices) {
  core::RandomStream random(2, core::Purpose::kTest);
  core::ThreadPool pool(1);
  for (const int k : kDopSizes) {
    const DopDirections& directions = DopDirections::of(k);
    double slack = 0.0;
    int bounds = 0;
    for (int round = 0; round < 300; ++round) {
      const double size_a = std::pow(10.0, random.uniform(-3.0, 3.0));
      const double size_b = round % 3 == 0 ? std::pow(10.0, random.uniform(-12.0, 5.0)) : size_a;
      const double offset = round % 2 == 0 ? 0.0 : std::pow(10.0, random.uniform(-3.0, 5.0));
      const auto a = cloud(random, size_a, 0.0);
      const auto b = cloud(random, size_b, offset);
      const DopSpace space_a = DopSpace::of(*a);
      const DopSpace space_b = DopSpace::of(*b);
      geometry::Pose X;
      const double turn_z = random.normal(), turn_y = random.normal(), turn_x = random.normal(),
                   turn_w = random.normal();
      X.rotation = Eigen::Quaterniond(turn_w, turn_x, turn_y, turn_z).normalized();
      const double z = random.normal(), y = random.normal(), x = random.normal();
      X.translation = Eigen::Vector3d(x, y, z) * (size_a + offset);
      const Transform X_AB = *to_transform(X);
      Hierarchy shape;
      for (std::uint32_t i = 0; i < b->triangle_count(); ++i) shape.order.push_back(i);
      shape.nodes.push_back({.begin = 0, .end = b->triangle_count()});
      const std::vector<float> planes = fit_planes(directions, space_b, *b, shape, pool);
      const Realignment realignment(directions, space_a, space_b, X_AB);
      const double extent = static_cast<double>(b->size()) * static_cast<double>(space_a.inverse_length);
      for (std::size_t p = 0; p < static_cast<std::size_t>(k); ++p) {
        const auto bound = static_cast<double>(realigned(realignment.directions[p], planes.data()));
        double lowest = std::numeric_limits<double>::infinity();
        for (const Vector3f& vertex : b->vertices()) {
          const Vector3f q = X_AB * vertex;
          double along = 0.0;
          for (std::size_t c = 0; c < 3; ++c) {
            along += directions.direction(p)[c] *
                     (static_cast<double>(q[static_cast<int>(c)]) - static_cast<double>(space_a.centre[c]));
          }
          lowest = std::min(lowest, along * static_cast<double>(space_a.inverse_length));
        }
        ASSERT_LE(bound, lowest) << "k " << k << ", direction " << p;
        if (round % 2 == 0 && size_a == size_b) {
          slack += (lowest - bound) / extent;
          ++bounds;
        }
      }
    }
    std::printf("k %d: realigned planes are %.3f of the size away on average\n", k, slack / bounds);
    EXPECT_LT(slack / bounds, k == 6 ? 0.35 : 0.15);
  }
}

}  // namespace
}  // namespace prescene::collision
