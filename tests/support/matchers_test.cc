// SPDX-License-Identifier: Apache-2.0
#include "tests/support/matchers.h"

#include <cmath>

namespace prescene::tests {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;
using testing::Not;

template <class Value, class Matcher>
std::string explanation(const Matcher& matcher, const Value& value) {
  testing::StringMatchResultListener listener;
  EXPECT_FALSE(matcher.MatchAndExplain(value, &listener));
  return listener.str();
}

TEST(PoseMatcher, TellsRotationAndTranslationApart) {
  const Pose X{geometry::exp_rotation({0.1, 0.2, 0.3}), {1.1, -0.7, 0.3}};
  Pose turned = X;
  turned.rotation = turned.rotation * geometry::exp_rotation({0.0, 0.01, 0.0});
  EXPECT_THAT(X, is_near(X, 0.0, 0.0));
  EXPECT_THAT(turned, is_near(X, 0.011, 0.0));
  EXPECT_THAT(turned, Not(is_near(X, 0.009, 1.0)));
  Pose negated = X;
  negated.rotation.coeffs() *= -1.0;
  EXPECT_THAT(negated, is_near(X, 1e-12, 0.0));
  Pose scaled = X;
  scaled.rotation.coeffs() *= 1.1;
  EXPECT_THAT(explanation(is_near(X, 1.0, 1.0), scaled), HasSubstr("norm 1.1"));
}

TEST(EigenMatcher, NamesTheWorstElement) {
  const Vector3d v(1.0, 2.0, 3.0);
  EXPECT_THAT(v, is_near(v, 0.0));
  EXPECT_THAT(explanation(is_near(v, 0.4), Vector3d(1.0, 2.5, 3.1)), HasSubstr("(1, 0) is off by 0.5"));
  EXPECT_THAT(Vector3d(1.0, std::nan(""), 3.0), Not(is_near(v, 1e9)));
}

TEST(ImageMatcher, NamesTheWorstPixelsAndAllowsAShare) {
  const geometry::DepthImage expected(10, 10, 1.0F);
  geometry::DepthImage actual = expected;
  actual(3, 4) = 1.5F;
  EXPECT_THAT(actual, is_near(expected, 0.6F));
  EXPECT_THAT(actual, is_near(expected, 0.1F, 0.01));
  EXPECT_THAT(explanation(is_near(expected, 0.1F), actual), HasSubstr("1 of 100 pixels differ, most at (3, 4): 0.5"));
  actual(0, 0) = std::nanf("");
  EXPECT_THAT(actual, Not(is_near(expected, 0.6F)));
  EXPECT_THAT(geometry::DepthImage(9, 10), Not(is_near(expected, 100.0F)));
}

}  // namespace
}  // namespace prescene::tests
