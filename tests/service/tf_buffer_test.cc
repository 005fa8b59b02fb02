// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tf_buffer.h"

#include <gtest/gtest.h>

#include <numbers>

namespace prescene::service {
namespace {

using core::StatusCode;
using geometry::Pose;
using geometry::Vector3d;

constexpr core::TimeNs kSecond = 1'000'000'000;

Pose turned_z(double angle, const Vector3d& p) { return {geometry::exp_rotation({0.0, 0.0, angle}), p}; }

TEST(TfBuffer, ComposesAlongTheTreeInBothDirections) {
  TfBuffer tf;
  const Pose X_WB = turned_z(0.3, {1.0, 2.0, 0.1});
  const Pose X_BC = turned_z(-1.1, {0.2, 0.0, 0.7});
  const Pose X_BG = turned_z(2.0, {0.5, -0.4, 0.3});
  ASSERT_TRUE(tf.add("world", "base", 0, X_WB, true).ok());
  ASSERT_TRUE(tf.add("base", "/camera", 0, X_BC, true).ok());
  ASSERT_TRUE(tf.add("base", "gripper", 0, X_BG, true).ok());
  const auto X_CG = tf.lookup("camera", "gripper", 5 * kSecond);
  ASSERT_TRUE(X_CG.ok()) << X_CG.status().message();
  const Vector3d p_GQ(0.1, 0.2, 0.3);
  EXPECT_LT(((X_WB * X_BG) * p_GQ - (X_WB * X_BC) * (*X_CG * p_GQ)).norm(), 1e-12);
  const auto X_GC = tf.lookup("gripper", "camera", 0);
  ASSERT_TRUE(X_GC.ok());
  EXPECT_LT((*X_CG * (*X_GC * p_GQ) - p_GQ).norm(), 1e-12);
}

TEST(TfBuffer, NamesTheFramesOnTheWay) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("world", "base", 0, Pose(), true).ok());
  ASSERT_TRUE(tf.add("base", "mast", 0, Pose(), true).ok());
  ASSERT_TRUE(tf.add("mast", "camera", 0, Pose(), true).ok());
  ASSERT_TRUE(tf.add("base", "hand", 0, Pose(), true).ok());
  ASSERT_TRUE(tf.add("other", "alone", 0, Pose(), true).ok());
  using Names = std::vector<std::string>;
  EXPECT_EQ(tf.chain("world", "/camera"), (Names{"camera", "mast", "base", "world"}));
  EXPECT_EQ(tf.chain("camera", "world"), (Names{"world", "base", "mast", "camera"}));
  EXPECT_EQ(tf.chain("hand", "camera"), (Names{"camera", "mast", "base", "hand"}));
  EXPECT_EQ(tf.chain("base", "base"), Names{"base"});
  EXPECT_EQ(tf.chain("world", "alone"), Names());
  EXPECT_EQ(tf.chain("world", "unknown"), Names());
}

TEST(TfBuffer, CountsWhatCameTooLate) {
  TfBuffer tf({.history_s = 1.0});
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(tf.add("world", "hand", 100 * kSecond + i, Pose(), false).ok());
  EXPECT_EQ(tf.late(), 0u);
  ASSERT_TRUE(tf.add("world", "hand", 90 * kSecond, Pose(), false).ok());
  ASSERT_TRUE(tf.add("world", "hand", 101 * kSecond, Pose(), false).ok());
  ASSERT_TRUE(tf.add("world", "hand", 91 * kSecond, Pose(), false).ok());
  EXPECT_EQ(tf.late(), 2u);
  EXPECT_EQ(tf.forgotten(), 0u);
}

TEST(TfBuffer, InterpolatesBetweenSamplesAndRefusesTimesOutside) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("world", "hand", 1 * kSecond, turned_z(0.0, {0.0, 0.0, 0.0}), false).ok());
  ASSERT_TRUE(tf.add("world", "hand", 2 * kSecond, turned_z(std::numbers::pi / 2, {1.0, 0.0, 0.0}), false).ok());
  const auto middle = tf.lookup("world", "hand", 1 * kSecond + kSecond / 4);
  ASSERT_TRUE(middle.ok());
  EXPECT_NEAR(middle->translation.x(), 0.25, 1e-12);
  EXPECT_NEAR(geometry::log_rotation(middle->rotation).z(), std::numbers::pi / 8, 1e-12);
  EXPECT_EQ(tf.lookup("world", "hand", 0).status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(tf.lookup("world", "hand", 3 * kSecond).status().code(), StatusCode::kUnavailable);
}

TEST(TfBuffer, AMovingEdgeAboveTheCommonAncestorIsNotNeeded) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("world", "base", 0, turned_z(1.0, {1.0, 0.0, 0.0}), false).ok());
  ASSERT_TRUE(tf.add("base", "camera", 0, turned_z(0.2, {0.0, 1.0, 0.0}), true).ok());
  ASSERT_TRUE(tf.add("base", "hand", 0, turned_z(0.5, {0.0, 0.0, 1.0}), true).ok());
  EXPECT_TRUE(tf.lookup("camera", "hand", 9 * kSecond).ok());
  EXPECT_FALSE(tf.lookup("world", "hand", 9 * kSecond).ok());
}

TEST(TfBuffer, RefusesWhatIsNoTreeAndStaysAsItWas) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("a", "b", 0, Pose::identity(), true).ok());
  ASSERT_TRUE(tf.add("b", "c", 0, Pose::identity(), true).ok());
  EXPECT_EQ(tf.add("c", "a", 0, Pose::identity(), true).code(), StatusCode::kInvalidInput);
  EXPECT_EQ(tf.add("d", "d", 0, Pose::identity(), true).code(), StatusCode::kInvalidInput);
  EXPECT_EQ(tf.add("", "d", 0, Pose::identity(), true).code(), StatusCode::kInvalidInput);
  EXPECT_EQ(tf.add("other", "c", 0, Pose::identity(), true).code(), StatusCode::kInvalidInput);
  Pose broken;
  broken.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(tf.add("a", "e", 0, broken, true).code(), StatusCode::kInvalidInput);
  EXPECT_TRUE(tf.lookup("a", "c", 0).ok());
  EXPECT_FALSE(tf.knows("d"));
  EXPECT_FALSE(tf.knows("other"));
}

TEST(TfBuffer, UnknownAndUnconnectedFramesAreNamed) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("a", "b", 0, Pose::identity(), true).ok());
  ASSERT_TRUE(tf.add("c", "d", 0, Pose::identity(), true).ok());
  EXPECT_NE(tf.lookup("a", "nowhere", 0).status().message().find("nowhere"), std::string::npos);
  EXPECT_EQ(tf.lookup("b", "d", 0).status().code(), StatusCode::kNotFound);
}

TEST(TfBuffer, AFrameMayChangeItsParentOnceItsOldTransformsHaveExpired) {
  TfBuffer tf({.history_s = 2.0});
  ASSERT_TRUE(tf.add("table", "cup", 0, Pose::identity(), false).ok());
  EXPECT_FALSE(tf.add("hand", "cup", 1 * kSecond, Pose::identity(), false).ok());
  EXPECT_TRUE(tf.add("hand", "cup", 3 * kSecond, Pose::identity(), false).ok());
  EXPECT_TRUE(tf.lookup("hand", "cup", 3 * kSecond).ok());
  EXPECT_FALSE(tf.knows("table"));
}

TEST(TfBuffer, ACycleOpensOnceAWrongTransformHasExpired) {
  TfBuffer tf;
  const Pose here = Pose::identity();
  ASSERT_TRUE(tf.add("hand", "base", 0, here, false).ok());  // parent and child exchanged
  ASSERT_TRUE(tf.add("camera", "hand", 0, here, true).ok());
  EXPECT_EQ(tf.add("base", "camera", 1 * kSecond, here, false).code(), StatusCode::kInvalidInput);
  EXPECT_TRUE(tf.add("base", "camera", 60 * kSecond, here, false).ok());
  EXPECT_TRUE(tf.lookup("base", "hand", 60 * kSecond).ok());
  EXPECT_EQ(tf.add("hand", "base", 61 * kSecond, here, false).code(), StatusCode::kInvalidInput);
  EXPECT_EQ(tf.add("hand", "camera", 600 * kSecond, here, false).code(), StatusCode::kInvalidInput);  // never expires
}

TEST(TfBuffer, OneStampFromTheFutureDoesNotBlockAFrameForEver) {
  TfBuffer tf;
  ASSERT_TRUE(tf.add("world", "camera", 1 * kSecond, turned_z(0.1, {1.0, 0.0, 0.0}), false).ok());
  ASSERT_TRUE(tf.add("world", "camera", 2'000'000'000 * kSecond, turned_z(0.1, {9.0, 0.0, 0.0}), false).ok());
  for (core::TimeNs s = 2; s <= 5; ++s)
    ASSERT_TRUE(tf.add("world", "camera", s * kSecond, turned_z(0.1, {2.0, 0.0, 0.0}), false).ok());
  const auto X_WC = tf.lookup("world", "camera", 5 * kSecond);
  ASSERT_TRUE(X_WC.ok()) << X_WC.status().message();
  EXPECT_DOUBLE_EQ(X_WC->translation.x(), 2.0);
}

TEST(TfBuffer, KeepsBoundedHistoryAndFrames) {
  TfBuffer tf({.history_s = 1.0, .max_frames = 2});
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(tf.add("world", "hand", i * kSecond / 10, turned_z(0.0, {i * 0.1, 0.0, 0.0}), false).ok());
  }
  EXPECT_FALSE(tf.lookup("world", "hand", 1 * kSecond).ok());
  EXPECT_TRUE(tf.lookup("world", "hand", 9 * kSecond).ok());
  ASSERT_TRUE(tf.add("world", "camera", 0, Pose::identity(), true).ok());
  EXPECT_EQ(tf.add("world", "third", 0, Pose::identity(), true).code(), StatusCode::kResourceExhausted);
  tf.forget_moving();
  EXPECT_FALSE(tf.knows("hand"));
  EXPECT_TRUE(tf.knows("camera"));
}

TEST(TfBuffer, SharesItsRoomAmongTheEdgesAndCountsWhatItForgetsEarly) {
  TfBuffer tf({.history_s = 1e6, .max_samples = 2000});
  const auto add = [&](const std::string& child, int i) {
    ASSERT_TRUE(tf.add("world", child, i * kSecond / 1000, Pose::identity(), false).ok());
  };
  for (int i = 0; i < 3000; ++i) add("hand", i);
  EXPECT_EQ(tf.sample_count(), 2000u) << "alone it has all the room";
  EXPECT_EQ(tf.forgotten(), 1000u);
  for (int i = 0; i < 3000; ++i) {
    for (int child = 0; child < 9; ++child) add("link" + std::to_string(child), i);
    add("hand", 3000 + i);
  }
  EXPECT_EQ(tf.sample_count(), 2000u);
  EXPECT_TRUE(tf.lookup("world", "link3", 2999 * kSecond / 1000).ok());
  EXPECT_TRUE(tf.lookup("world", "link3", 2801 * kSecond / 1000).ok());
  EXPECT_FALSE(tf.lookup("world", "link3", 2799 * kSecond / 1000).ok());
  tf.forget_moving();
  EXPECT_EQ(tf.sample_count(), 0u);
}

TEST(TfBuffer, EachOfManyEdgesKeepsEnoughForTheFramesThatWait) {
  TfBuffer tf({.max_samples = 10});
  for (int i = 0; i < 300; ++i) {
    for (int child = 0; child < 20; ++child) {
      ASSERT_TRUE(tf.add("world", std::to_string(child), i * kSecond / 30, Pose::identity(), false).ok());
    }
  }
  EXPECT_TRUE(tf.lookup("world", "7", 201 * kSecond / 30).ok()) << "a hundred of each";
  EXPECT_EQ(tf.sample_count(), 2000u);
}

TEST(TfBuffer, CountsItsTransformsThroughEveryChange) {
  TfBuffer tf({.history_s = 1.0});
  const auto add = [&](const char* parent, const char* child, core::TimeNs stamp_ns, bool is_static) {
    return tf.add(parent, child, stamp_ns, Pose::identity(), is_static).ok();
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(add("world", "hand", i * kSecond / 10, false));
  EXPECT_EQ(tf.sample_count(), 5u);
  EXPECT_TRUE(add("world", "hand", 4 * kSecond / 10, false)) << "the same stamp again";
  EXPECT_EQ(tf.sample_count(), 5u);
  EXPECT_TRUE(add("other", "hand", 10 * kSecond, false)) << "the old parent has expired";
  EXPECT_EQ(tf.sample_count(), 1u);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(add("other", "hand", kSecond + i, false)) << "the clock went back";
  EXPECT_EQ(tf.sample_count(), 1u);
  EXPECT_TRUE(add("other", "hand", kSecond + 7, false));
  EXPECT_TRUE(add("other", "hand", 0, true)) << "it is static now";
  EXPECT_EQ(tf.sample_count(), 1u);
}

}  // namespace
}  // namespace prescene::service
