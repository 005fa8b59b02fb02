// SPDX-License-Identifier: Apache-2.0
// Distances in double precision against rational arithmetic.
#include "prescene/collision/triangle_pair_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "nasty_triangles.h"
#include "rational_reference.h"

namespace prescene::collision::triangle_pair_distance_reference_test {
namespace {

constexpr int kPairsOfAKind = 250;

double extent(const Triangle& a, const Triangle& b) {
  Eigen::AlignedBox3d box;
  for (const Triangle& t : {a, b}) {
    for (const Vector3f& p : t) box.extend(p.cast<double>());
  }
  return box.sizes().maxCoeff();
}

// How far p is from t: as a triangle of no size, by the reference.
double off(const Triangle& t, const Eigen::Vector3d& p) {
  const Vector3f rounded = p.cast<float>();
  return rational_distance(t, {rounded, rounded, rounded});
}

TEST(TrianglePairDistance, AgreesWithRationalNumbers) {
  for (const Nastiness nastiness : kAllNastiness) {
    core::RandomStream random(5, core::Purpose::kTest, static_cast<std::uint64_t>(nastiness));
    double worst = 0.0;
    for (int i = 0; i < kPairsOfAKind; ++i) {
      const auto [a, b] = nasty_pair(nastiness, random);
      const TriangleDistance found = triangle_pair_distance(a, b);
      const double expected = rational_distance(a, b);
      const double size = extent(a, b);
      ASSERT_EQ(found.distance == 0.0, triangles_intersect(a, b));
      ASSERT_LE(std::abs(found.distance - expected), 1e-13 * size) << to_string(nastiness) << " " << i;
      if (size > 0.0) worst = std::max(worst, std::abs(found.distance - expected) / size);
      const double coordinate = std::max(found.p_A.cwiseAbs().maxCoeff(), found.p_B.cwiseAbs().maxCoeff());
      ASSERT_NEAR((found.p_A - found.p_B).norm(), found.distance, 1e-13 * size + 1e-15 * coordinate);
      if (i % 8 != 0) continue;  // The points are checked up to single precision, and of them some.
      ASSERT_LE(off(a, found.p_A), 1e-7 * coordinate + 1e-14 * size + 1e-44) << to_string(nastiness) << " " << i;
      ASSERT_LE(off(b, found.p_B), 1e-7 * coordinate + 1e-14 * size + 1e-44) << to_string(nastiness) << " " << i;
    }
    std::printf("%s: off by at most %.2g of the size\n", std::string(to_string(nastiness)).c_str(), worst);
  }
}

}  // namespace
}  // namespace prescene::collision::triangle_pair_distance_reference_test
