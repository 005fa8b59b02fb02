// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "filter_fixture.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/matchers.h"

namespace prescene::filter_tests {
namespace {

using belief::Particle;

TEST(Drift, TurnsAboutTheGivenPoint) {
  Particle particle;
  particle.X_WO.rotation = geometry::exp_rotation({0.3, -0.2, 0.5});
  const Vector3d p_OQ(0.0, 0.4, 0.1);
  const Vector3d p_WQ = particle.X_WO * p_OQ;
  // Q stands still while the body turns about it.
  particle.V_WO.angular = Vector3d(0.5, 1.0, -2.0);
  particle.V_WO = geometry::shifted(particle.V_WO, Vector3d::Zero());
  particle.V_WO.linear = -particle.V_WO.angular.cross(particle.X_WO.rotation * p_OQ);
  const geometry::Quaterniond before = particle.X_WO.rotation;
  drift(particle, p_OQ, 0.1, 1.0, {0.0, 0.0, 0.0, 0.0});
  EXPECT_THAT(Vector3d(particle.X_WO * p_OQ), tests::is_near(p_WQ, 1e-12));
  EXPECT_NEAR(geometry::angle_between(before, particle.X_WO.rotation), 0.1 * Vector3d(0.5, 1.0, -2.0).norm(), 1e-9);
  // And goes on standing still.
  EXPECT_THAT(geometry::shifted(particle.V_WO, particle.X_WO.rotation * p_OQ).linear,
              tests::is_near(Vector3d(0.0, 0.0, 0.0), 1e-12));
}

// The covariance of many drifted samples about the drifted mean, against the propagated one.
TEST(DriftStatistics, CovarianceIsThatOfDriftedSamples) {
  core::RandomStream stream(11, core::Purpose::kTest);
  Particle mean;
  mean.X_WO.rotation = geometry::exp_rotation({0.7, 0.1, -0.4});
  mean.X_WO.translation = Vector3d(0.1, 0.2, 0.3);
  mean.V_WO.linear = Vector3d(0.2, -0.1, 0.05);
  mean.covariance.diagonal() << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(4e-6),
      Eigen::Vector3d::Constant(4e-2), Eigen::Vector3d::Constant(1e-2);
  const MotionNoise none{0.0, 0.0, 0.0, 0.0};
  Particle moved = mean;
  drift(moved, Vector3d::Zero(), 0.1, 0.8, none);
  using Vector12d = Eigen::Matrix<double, 12, 1>;
  belief::Matrix12d sampled = belief::Matrix12d::Zero();
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    Particle sample = mean;
    Vector12d d;
    for (int k = 0; k < 12; ++k) d[k] = std::sqrt(mean.covariance(k, k)) * stream.normal();
    sample.X_WO = geometry::box_plus(mean.X_WO, d.head<6>());
    sample.V_WO.angular += d.segment<3>(6);
    sample.V_WO.linear += d.tail<3>();
    drift(sample, Vector3d::Zero(), 0.1, 0.8, none);
    Vector12d e;
    e.head<6>() = geometry::box_minus(sample.X_WO, moved.X_WO);
    e.segment<3>(6) = sample.V_WO.angular - moved.V_WO.angular;
    e.tail<3>() = sample.V_WO.linear - moved.V_WO.linear;
    sampled += e * e.transpose() / kSamples;
  }
  // A sample covariance of n draws is off by sqrt(2 / n) = 2.2 %; five of those.
  const Vector12d scale = moved.covariance.diagonal().cwiseSqrt();
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      EXPECT_NEAR(sampled(i, j), moved.covariance(i, j), 0.12 * scale[i] * scale[j]) << i << ", " << j;
}

}  // namespace
}  // namespace prescene::filter_tests
