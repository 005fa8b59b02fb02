// SPDX-License-Identifier: Apache-2.0
// The exact tests against linear programmes solved in rational arithmetic.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>

#include "nasty_triangles.h"
#include "prescene/collision/exact_triangles.h"
#include "rational_reference.h"

namespace prescene::collision::exact_triangles_reference_test {
namespace {

constexpr int kPairsOfAKind = 3000;

std::string text(const Triangle& t) {
  std::ostringstream out;
  out << std::hexfloat;
  for (const Vector3f& p : t) out << "(" << p.x() << ", " << p.y() << ", " << p.z() << ") ";
  return out.str();
}

bool rational_degenerate(const Triangle& t) {
  // The corners are in a line when, seen along each axis, they are: with a fourth point lifted along it.
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3f lifted = t[0] + Vector3f::Unit(axis) * 4.0F * kLargestCoordinate;
    if (rational_orientation(t[0], t[1], t[2], lifted) != 0) return false;
  }
  return true;
}

class ExactTriangles : public testing::TestWithParam<Nastiness> {};

TEST_P(ExactTriangles, AgreeWithRationalNumbers) {
  core::RandomStream random(17, core::Purpose::kTest, static_cast<std::uint64_t>(GetParam()));
  int meeting = 0;
  int degenerate = 0;
  for (int i = 0; i < kPairsOfAKind; ++i) {
    const auto [a, b] = nasty_pair(GetParam(), random);
    const bool expected = rational_hulls_meet(a, b);
    meeting += expected ? 1 : 0;
    ASSERT_EQ(triangles_intersect(a, b), expected) << text(a) << " and " << text(b);
    ASSERT_EQ(triangles_intersect(b, a), expected) << text(a) << " and " << text(b);
    const std::array<Vector3f, 2> edge = {a[0], a[1]};
    ASSERT_EQ(segment_meets_triangle(edge[0], edge[1], b), rational_hulls_meet(edge, b)) << text(a) << text(b);
    const std::array<Vector3f, 1> corner = {a[2]};
    ASSERT_EQ(segment_meets_triangle(a[2], a[2], b), rational_hulls_meet(corner, b)) << text(a) << text(b);
    for (const Triangle& t : {a, b}) {
      ASSERT_EQ(is_degenerate(t), rational_degenerate(t)) << text(t);
      degenerate += is_degenerate(t) ? 1 : 0;
    }
  }
  RecordProperty("meeting", meeting);
  RecordProperty("degenerate", degenerate);
  std::printf("%s: %d of %d pairs meet, %d degenerate triangles\n", std::string(to_string(GetParam())).c_str(), meeting,
              kPairsOfAKind, degenerate);
}

INSTANTIATE_TEST_SUITE_P(Pairs, ExactTriangles, testing::ValuesIn(kAllNastiness), [](const auto& kind) {
  std::string name(to_string(kind.param));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

TEST(ExactTriangles, AnswerWhatIsKnown) {
  const Triangle t = {Vector3f(0, 0, 0), Vector3f(1, 0, 0), Vector3f(0, 1, 0)};
  const auto moved = [&t](float x, float y, float z) {
    return Triangle{t[0] + Vector3f(x, y, z), t[1] + Vector3f(x, y, z), t[2] + Vector3f(x, y, z)};
  };
  EXPECT_TRUE(triangles_intersect(t, t));
  EXPECT_TRUE(triangles_intersect(t, moved(1, 0, 0)));        // A corner on a corner.
  EXPECT_TRUE(triangles_intersect(t, moved(0.5F, 0.5F, 0)));  // A corner on an edge.
  EXPECT_FALSE(triangles_intersect(t, moved(0, 0, 1e-45F)));  // The smallest number above.
  EXPECT_FALSE(triangles_intersect(t, moved(0.5F, 0.5000001F, 0)));
  EXPECT_FALSE(is_degenerate(t));
  EXPECT_TRUE(is_degenerate({t[0], t[1], t[1]}));
  EXPECT_FALSE(is_degenerate({t[0], t[1], Vector3f(2, 1e-45F, 0)}));
}

}  // namespace
}  // namespace prescene::collision::exact_triangles_reference_test
