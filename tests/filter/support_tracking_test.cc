// SPDX-License-Identifier: Apache-2.0
// A table that is seen by a camera that moves, against where it is.
#include "prescene/filter/proposals/support_tracking.h"

#include <gtest/gtest.h>

#include "filter_fixture.h"
#include "prescene/geometry/angles.h"

namespace prescene::filter_tests {
namespace {

using geometry::kDegree;

class TableOnTheMove : public ::testing::Test {
 protected:
  SampledDepth see(const Pose& X_WC) {
    SimulatedSequence sequence =
        still_sequence({box_model("box", {0.08, 0.08, 0.1})}, {Pose::from_translation({0.05, 0.0, 0.05})});
    sequence.X_WC = X_WC;
    const belief::Observation observation = sequence.observe(3, *backends_.renderer);
    return sample_depth(*observation.frame.depth, observation.frame.camera, {});
  }
  static Pose moved_camera(double angle) {
    return Pose{geometry::exp_rotation({0.0, 0.0, angle}), Vector3d::Zero()} * test_camera_pose();
  }

  Backends backends_;
};

TEST(FoundSupports, AreKnownByTheirNamesAndNoOtherIs) {
  EXPECT_TRUE(is_found_support("support_plane"));
  EXPECT_TRUE(is_found_support("support_plane_2"));
  EXPECT_TRUE(is_found_support("support_plane_13"));
  for (const char* other : {"", "table", "support", "support_planet", "support_plane_", "support_plane_left",
                            "support_plane_2b", "my_support_plane"})
    EXPECT_FALSE(is_found_support(other)) << other;
}

TEST_F(TableOnTheMove, IsMeasuredWhereItIs) {
  for (const double angle : {-0.4, 0.0, 0.7}) {
    const Pose X_WC = moved_camera(angle);
    const auto measured = measure_support(see(X_WC), X_WC, table());
    ASSERT_TRUE(measured.has_value());
    EXPECT_LT(measured->tilt, 0.6 * kDegree);
    EXPECT_NEAR(measured->height, 0.0, 0.003);
    EXPECT_NEAR(measured->p_WQ.z(), 0.0, 0.003);
    EXPECT_GT(measured->share, 0.8);
    EXPECT_GT(measured->plane_W.normal.z(), 0.99);
  }
}

TEST_F(TableOnTheMove, ASupportBelievedElsewhereIsMeasuredThereAndMovedThere) {
  belief::Support support = table();
  support.X_WS = Pose{geometry::exp_rotation({0.012, -0.01, 0.0}), {0.01, 0.0, -0.006}};
  const Pose X_WC = moved_camera(0.0);
  const SampledDepth sampled = see(X_WC);
  const auto measured = measure_support(sampled, X_WC, support);
  ASSERT_TRUE(measured.has_value());
  EXPECT_NEAR(measured->height, 0.006, 0.002);
  EXPECT_NEAR(measured->tilt, std::hypot(0.012, 0.01), 0.5 * kDegree);
  belief::Support half = support;
  correct_support(*measured, 0.5, half);
  correct_support(*measured, 1.0, support);
  const auto after_half = measure_support(sampled, X_WC, half);
  const auto after = measure_support(sampled, X_WC, support);
  ASSERT_TRUE(after_half.has_value() && after.has_value());
  EXPECT_NEAR(after_half->height, 0.5 * measured->height, 0.0005);
  EXPECT_NEAR(after_half->tilt, 0.5 * measured->tilt, 0.1 * kDegree);
  EXPECT_NEAR(after->height, 0.0, 0.0005);
  EXPECT_LT(after->tilt, 0.1 * kDegree);
}

TEST_F(TableOnTheMove, IsNotMeasuredFromBelowOutOfViewOrWhereItIsNot) {
  const Pose X_WC = moved_camera(0.0);
  const SampledDepth sampled = see(X_WC);
  Pose away = X_WC;
  away.rotation = away.rotation * geometry::exp_rotation({0.0, 3.14159, 0.0});
  EXPECT_FALSE(measure_support(sampled, away, table()).has_value());
  belief::Support above = table();
  above.X_WS.translation.z() = 0.1;
  EXPECT_FALSE(measure_support(sampled, X_WC, above).has_value());
  belief::Support upside_down = table();
  upside_down.X_WS = Pose{geometry::exp_rotation({3.14159265, 0.0, 0.0}), {0.0, 0.0, -0.04}};
  EXPECT_FALSE(measure_support(sampled, X_WC, upside_down).has_value());
}

TEST_F(TableOnTheMove, IsFoundAndFollowedByTheFilter) {
  // A scene without supports, gravity known; the camera goes round by 3 degrees a frame.
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "nothing known";
  SimulatedSequence sequence =
      still_sequence({box_model("box", {0.08, 0.08, 0.1})}, {Pose::from_translation({0.05, 0.0, 0.05})});
  ParticleFilter filter = backends_.make_filter();
  belief::Belief belief = filter.start(scene, 1);
  for (int frame = 0; frame < 12; ++frame) {
    sequence.X_WC = moved_camera(3.0 * kDegree * frame);
    StepResult result = filter.step(belief, sequence.observe(frame, *backends_.renderer), {});
    belief = std::move(result.belief);
    ASSERT_EQ(result.supports.size(), 1u) << frame;
    EXPECT_EQ(result.supports[0].support, kFoundSupport);
    EXPECT_NEAR(result.supports[0].p_WQ.z(), 0.0, 0.004) << frame;
    EXPECT_LT(std::acos(std::min(1.0, result.supports[0].plane_W.normal.z())), 0.7 * kDegree) << frame;
  }
  ASSERT_EQ(belief.scene->supports.size(), 1u);
  const Vector3d up = belief.scene->supports[0].X_WS.rotation * Vector3d::UnitZ();
  EXPECT_LT(std::acos(std::min(1.0, up.z())), 0.3 * kDegree);
}

TEST(SampleDepth, TakesANeighbourWhereAPixelIsMissingAtItsOwnPlace) {
  const geometry::PinholeCamera camera{640, 480, 600.0, 600.0, 319.5, 239.5};
  geometry::DepthImage depth(640, 480);
  // One pixel in nine is measured, as in depth that was registered to a colour camera.
  const geometry::Plane plane{Vector3d(0.0, -0.6, -0.8), 0.5};
  for (int y = 0; y < 480; y += 3)
    for (int x = 0; x < 640; x += 3) {
      const Vector3d ray = camera.unproject(x, y, 1.0);
      depth(x, y) = static_cast<float>(-plane.offset / plane.normal.dot(ray));
    }
  const SampledDepth sampled = sample_depth(depth, camera, {});
  int measured = 0;
  for (const Vector3d& p : sampled.points_C) {
    if (p.z() == 0.0) continue;
    ++measured;
    EXPECT_NEAR(plane.signed_distance(p), 0.0, 1e-6);
  }
  EXPECT_GT(measured, 160 * 120 / 2);
}

}  // namespace
}  // namespace prescene::filter_tests
