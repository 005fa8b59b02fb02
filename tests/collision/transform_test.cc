// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/transform.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/generators.h"

namespace prescene::collision::transform_test {
namespace {

using ::testing::HasSubstr;

TEST(Transform, AgreesWithThePosesInTheWorld) {
  EXPECT_TRUE(tests::check_law([] {
    const geometry::Pose X_WA = normalized(*tests::poses());
    const geometry::Pose X_WB = normalized(*tests::poses());
    const geometry::Vector3d p_BQ = *tests::vectors();
    const auto X_AB = relative_transform(X_WA, X_WB);
    RC_ASSERT(X_AB.ok());
    const geometry::Vector3d expected = X_WA.inverse() * (X_WB * p_BQ);
    const geometry::Vector3d p_AQ = (*X_AB * Vector3f(p_BQ.cast<float>())).cast<double>();
    RC_ASSERT((p_AQ - expected).norm() < 1e-5);
    const geometry::Vector3d back = (inverse(*X_AB) * (*X_AB * Vector3f(p_BQ.cast<float>()))).cast<double>();
    RC_ASSERT((back - p_BQ).norm() < 1e-5);
  }));
}

TEST(Transform, RefusesWhatIsNotRigid) {
  geometry::Pose X;
  X.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(to_transform(X).status().message(), HasSubstr("not finite"));
  EXPECT_THAT(relative_transform(geometry::Pose(), X).status().message(), HasSubstr("X_WB is not finite"));
  X = {};
  X.rotation.coeffs() *= 1.01;
  EXPECT_THAT(to_transform(X).status().message(), HasSubstr("length 1.01"));
  EXPECT_THAT(to_transform(geometry::Pose::from_translation({2e9, 0, 0})).status().message(), HasSubstr("1e9 m"));

  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  EXPECT_TRUE(to_transform(matrix).ok());
  matrix(0, 0) = -1.0;
  EXPECT_THAT(to_transform(matrix).status().message(), HasSubstr("mirrors"));
  matrix(0, 0) = 1.1;
  EXPECT_THAT(to_transform(matrix).status().message(), HasSubstr("not a rotation"));
  matrix = Eigen::Matrix4d::Identity();
  matrix(3, 0) = 1.0;
  EXPECT_THAT(to_transform(matrix).status().message(), HasSubstr("last row"));
}

}  // namespace
}  // namespace prescene::collision::transform_test
