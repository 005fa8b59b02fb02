// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/ros_messages/conversions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector3d;
using geometry::Vector6d;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Stamps, ConvertBothWays) {
  EXPECT_EQ(*to_stamp_ns({1700000000, 999999999}), 1700000000999999999);
  EXPECT_EQ(to_ros_time(1700000000999999999), (RosTime{1700000000, 999999999}));
  EXPECT_EQ(*to_stamp_ns({0, 0}), 0);
  EXPECT_THAT(to_stamp_ns({0, 1000000000}).status().message(), HasSubstr("nanosec is 1000000000; it must be below"));
  EXPECT_EQ(to_stamp_ns({-1, 0}).status().code(), StatusCode::kInvalidInput);
}

TEST(FrameIds, LoseOneSlashAndAreChecked) {
  EXPECT_EQ(*to_frame_id("/camera"), "camera");
  EXPECT_EQ(*to_frame_id("a/b"), "a/b");
  EXPECT_THAT(to_frame_id("/").status().message(), HasSubstr("the frame id is empty"));
  EXPECT_TRUE(to_frame_id(std::string(255, 'a')).ok());
  EXPECT_THAT(to_frame_id(std::string(256, 'a')).status().message(), HasSubstr("has 256 bytes; use at most 255"));
  EXPECT_THAT(to_frame_id("a\x1b[2J").status().message(), HasSubstr("'a\\x1b[2J' has control bytes"));
  EXPECT_THAT(to_frame_id("cam\xff").status().message(), HasSubstr("'cam\\xff' is not UTF-8"));
  EXPECT_EQ(*to_frame_id("k\xc3\xbc"
                         "che"),
            "k\xc3\xbc"
            "che");
}

TEST(Rotations, AreNormalisedOrRefused) {
  const auto rotation = to_rotation({0.0, 0.0, -1.05, 0.0});
  ASSERT_TRUE(rotation.ok());
  EXPECT_DOUBLE_EQ(rotation->norm(), 1.0);
  EXPECT_THAT(to_rotation({0, 0, 0, 0}).status().message(), HasSubstr("all zero; set w = 1"));
  EXPECT_EQ(to_rotation({0, 0, 0, 0}, {.zero_quaternion_is_identity = true})->w(), 1.0);
  EXPECT_THAT(to_rotation({0, 0, 0, 1.2}).status().message(), HasSubstr("has the norm 1.2; normalise it"));
  for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e300, -1e300}) {
    EXPECT_EQ(to_rotation({bad, 0, 0, 1}).status().code(), StatusCode::kInvalidInput) << bad;
  }
}

TEST(Poses, SayWhichFieldIsWrong) {
  RosPose pose;
  pose.position.y = kNan;
  EXPECT_THAT(to_pose(pose).status().message(), HasSubstr("position: (0, nan, 0) is not finite"));
  pose.position.y = 2e5;
  EXPECT_THAT(to_pose(pose).status().message(), HasSubstr("position: (0, 200000, 0) is more than 100000 m away"));
  RosTransform transform;
  transform.rotation.w = 0.0;
  EXPECT_THAT(to_pose(transform).status().message(), HasSubstr("rotation: the quaternion is all zero"));
  RosTwist twist;
  twist.angular.z = kNan;
  EXPECT_EQ(to_twist(twist).status().code(), StatusCode::kInvalidInput);
}

TEST(PoseLaws, GoThereAndBack) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const Pose X = geometry::normalized({geometry::uniform_rotation(stream), geometry::normal_vector(stream)});
    const auto back = to_pose(to_ros_pose(X));
    RC_ASSERT(back.ok());
    RC_ASSERT(geometry::box_minus(*back, X).norm() < 1e-12);
    const geometry::Twist V{geometry::normal_vector(stream), geometry::normal_vector(stream)};
    RC_ASSERT(*to_twist(to_ros_twist(V)) == V);
  }));
}

// The covariance in ROS's coordinates, estimated by its definition: scatter of samples about the mean.
TEST(PoseLaws, CovariancesFollowTheCoordinates) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const Pose X = geometry::normalized({geometry::uniform_rotation(stream), geometry::normal_vector(stream)});
    Matrix6d A;
    for (double& value : A.reshaped()) value = stream.normal();
    const Matrix6d covariance = A * A.transpose();
    const RosPoseWithCovariance message = to_ros_pose(X, covariance);

    // A small error d = A * e: where the origin and the axes go, in the parent frame.
    Vector6d e;
    for (double& value : e) value = stream.normal();
    const Vector6d d = 1e-5 * A * e;
    const Pose X_off = geometry::box_plus(X, d);
    Vector6d ros;
    ros.head<3>() = X_off.translation - X.translation;
    ros.tail<3>() = geometry::log_rotation(X_off.rotation * X.rotation.inverse());
    const Matrix6d J_A = [&] {
      Matrix6d columns;
      for (int i = 0; i < 6; ++i) {
        const Pose X_i = geometry::box_plus(X, 1e-6 * A.col(i));
        columns.col(i).head<3>() = (X_i.translation - X.translation) / 1e-6;
        columns.col(i).tail<3>() = geometry::log_rotation(X_i.rotation * X.rotation.inverse()) / 1e-6;
      }
      return columns;
    }();
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> sent(message.covariance.data());
    RC_ASSERT((J_A * J_A.transpose() - sent).norm() < 1e-4 * (1.0 + sent.norm()));

    const auto back = to_covariance(message);
    RC_ASSERT(back.ok());
    RC_ASSERT(back->has_value());
    RC_ASSERT((**back - covariance).norm() < 1e-9 * (1.0 + covariance.norm()));
  }));
}

TEST(Covariances, AreUnknownWrongOrMadeSound) {
  RosPoseWithCovariance message;
  EXPECT_FALSE(to_covariance(message)->has_value()) << "all zero";
  message.covariance[0] = -1.0;
  EXPECT_FALSE(to_covariance(message)->has_value()) << "-1 says invalid";
  message.covariance.fill(0.0);
  message.covariance[7] = kNan;
  EXPECT_THAT(to_covariance(message).status().message(), HasSubstr("covariance: has entries that are not finite"));
  message.covariance[7] = -2.0;
  message.covariance[1] = 1.0;  // Asymmetric, too.
  const Matrix6d covariance = **to_covariance(message);
  EXPECT_EQ(covariance, covariance.transpose());
  EXPECT_GE(geometry::symmetric_eigenvalues_6(covariance).minCoeff(), -1e-12);
  EXPECT_GT(covariance.norm(), 0.0);
}

TEST(Transforms, KeepTheGoodAndNameTheBad) {
  const FrameTransform good{"world", "camera", 5, Pose::from_translation({1, 2, 3})};
  RosTfMessage message;
  message.transforms = {to_ros_transform(good), to_ros_transform(good), to_ros_transform(good), to_ros_transform(good)};
  message.transforms[1].child_frame_id = "/world";
  message.transforms[2].transform.translation.x = kNan;
  message.transforms[3].header.stamp.nanosec = 2000000000;
  const auto result = to_transforms(message);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->accepted.size(), 1U);
  EXPECT_EQ(result->accepted[0].parent, "world");
  EXPECT_EQ(result->accepted[0].child, "camera");
  EXPECT_EQ(result->accepted[0].stamp_ns, 5);
  EXPECT_EQ(result->accepted[0].X_PC, good.X_PC);
  ASSERT_EQ(result->rejected.size(), 3U);
  EXPECT_THAT(result->rejected[0].message(), HasSubstr("transforms[1]: frame 'world' is its own parent"));
  EXPECT_THAT(result->rejected[1].message(), HasSubstr("transforms[2]: 'world' to 'camera': translation: (nan, 2, 3)"));
  EXPECT_THAT(result->rejected[2].message(), HasSubstr("transforms[3]: header.stamp: nanosec"));
  EXPECT_EQ(to_transforms(message, 3).status().code(), StatusCode::kResourceExhausted);
}

TEST(JointStates, AreMappedByName) {
  RosJointState state;
  state.name = {"left", "right"};
  state.position = {0.1, 0.2};
  state.effort = {1.0, 2.0};
  const auto samples = to_joint_samples(state);
  ASSERT_TRUE(samples.ok());
  EXPECT_EQ((*samples)[1], (JointSample{"right", 0.2, std::nullopt, 2.0}));

  state.velocity = {0.0};
  EXPECT_THAT(to_joint_samples(state).status().message(), HasSubstr("velocity: has 1 entries for 2 names"));
  state.velocity = {0.0, kNan};
  EXPECT_THAT(to_joint_samples(state).status().message(), HasSubstr("velocity: that of joint 'right' is nan"));
  state.velocity.clear();
  state.name[1] = "left";
  EXPECT_THAT(to_joint_samples(state).status().message(), HasSubstr("joint 'left' stands twice"));
  state.name[1] = "";
  EXPECT_THAT(to_joint_samples(state).status().message(), HasSubstr("name[1]: is empty"));
}

}  // namespace
}  // namespace prescene::interfaces
