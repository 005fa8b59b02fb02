// SPDX-License-Identifier: Apache-2.0
// What hangs on a joint is kept on it and seen to move along it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "filter_fixture.h"
#include "prescene/filter/operators/hold_joints.h"

namespace prescene::filter_tests::joint_tracking_test {
namespace {

using belief::Belief;
using belief::Joint;
using belief::JointEstimate;
using belief::JointType;
using belief::Particle;

/// A sequence of one object on a joint of the world, whose position is a function of time.
SimulatedSequence sequence_of(const belief::ObjectModel& model, const Joint& joint,
                              const std::function<double(double)>& position) {
  const Motion motion = [=](double time) { return belief::child_pose(joint, Pose{}, position(time)); };
  SimulatedSequence sequence;
  auto scene = std::make_shared<belief::Scene>(*table_scene({model}, {motion(0.0)}, 0.003, 0.02));
  scene->joints.push_back(joint);
  sequence.scene = std::move(scene);
  sequence.camera = test_camera();
  sequence.X_WC = test_camera_pose();
  sequence.objects = {motion};
  return sequence;
}

struct Followed {
  std::vector<double> errors;  // of the position, by frame
  std::vector<double> in_sigmas;
  double worst_distance = 0.0, worst_angle = 0.0;  // off the joint
};

Followed follow(const SimulatedSequence& sequence, const std::function<double(double)>& position, int frames) {
  Backends backends;
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, 7);
  Followed followed;
  for (int frame = 0; frame < frames; ++frame) {
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    const std::vector<JointEstimate> estimates = belief::joint_estimates(belief);
    if (estimates.size() != 1) return {};
    const double error = estimates[0].position - position(sequence.time_of(frame));
    followed.errors.push_back(std::abs(error));
    followed.in_sigmas.push_back(std::abs(error) / estimates[0].standard_deviation);
    const Pose X_WO = belief::estimate(belief, belief.objects[0]).mode;
    const belief::JointError off = belief::joint_error(sequence.scene->joints[0], Pose{}, X_WO);
    followed.worst_distance = std::max(followed.worst_distance, off.distance);
    followed.worst_angle = std::max(followed.worst_angle, off.angle);
  }
  return followed;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

Joint slider() {
  Joint joint;
  joint.name = "slide";
  joint.type = JointType::kSlider;
  joint.child = "drawer";
  joint.axis_P = Vector3d(1.0, -1.0, 0.0).normalized();
  joint.X_PC0 = {geometry::exp_rotation({0.0, 0.0, 0.4}), {-0.05, 0.05, 0.04}};
  joint.low = 0.0;
  joint.high = 0.3;
  return joint;
}

TEST(JointTracking, ADrawerIsSeenToOpen) {
  const auto position = [](double time) { return 0.2 * std::clamp((time - 0.3) / 1.0, 0.0, 1.0); };
  const Followed followed =
      follow(sequence_of(box_model("drawer", {0.16, 0.12, 0.08}), slider(), position), position, 50);
  ASSERT_EQ(followed.errors.size(), 50u);
  EXPECT_LT(*std::max_element(followed.errors.begin() + 2, followed.errors.end()), 0.015);
  EXPECT_LT(median(followed.errors), 0.003);
  EXPECT_LT(followed.errors.back(), 0.004);
  EXPECT_LT(median(followed.in_sigmas), 3.0);
  EXPECT_LT(followed.worst_distance, 0.003);
  EXPECT_LT(followed.worst_angle, 0.02);
}

TEST(JointTracking, ALidIsSeenToRise) {
  Joint joint;
  joint.name = "lid_hinge";
  joint.child = "lid";
  joint.axis_P = -Vector3d::UnitY();
  joint.anchor_P = {-0.08, 0.0, 0.05};
  joint.X_PC0 = Pose::from_translation({0.0, 0.0, 0.05});
  joint.low = 0.0;
  joint.high = 1.9;
  const auto position = [](double time) { return 1.2 * std::clamp((time - 0.3) / 1.2, 0.0, 1.0); };
  const Followed followed = follow(sequence_of(box_model("lid", {0.16, 0.14, 0.012}), joint, position), position, 50);
  ASSERT_EQ(followed.errors.size(), 50u);
  EXPECT_LT(*std::max_element(followed.errors.begin() + 2, followed.errors.end()), 0.15);
  EXPECT_LT(median(followed.errors), 0.03);
  EXPECT_LT(followed.worst_distance, 0.004);
  EXPECT_LT(followed.worst_angle, 0.03);
}

TEST(HoldJoints, CorrectsWhatIsHeldAndLeavesTheFreeDirection) {
  const Joint joint = slider();
  const SimulatedSequence sequence =
      sequence_of(box_model("drawer", {0.16, 0.12, 0.08}), joint, [](double) { return 0.1; });
  Backends backends;
  Belief belief = backends.make_filter().start(sequence.scene, 7);
  Particle particle;
  particle.covariance.diagonal() << 1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01;
  particle.X_WO = belief::child_pose(joint, Pose{}, 0.1);
  particle.X_WO.translation += Vector3d(0.0, 0.0, 0.008);
  particle.X_WO.rotation = (geometry::exp_rotation({0.03, 0.0, 0.0}) * particle.X_WO.rotation).normalized();
  particle.V_WO.linear = 0.2 * joint.axis_P + Vector3d(0.0, 0.0, 0.1);
  belief.objects[0].particles = {particle};
  hold_joints(belief);
  const Particle& held = belief.objects[0].particles[0];
  const belief::JointError off = belief::joint_error(joint, Pose{}, held.X_WO);
  EXPECT_LT(off.distance, 0.0005);
  EXPECT_LT(off.angle, 0.005);
  const belief::JointState state = belief::joint_state(joint, Pose{}, {}, held.X_WO, held.V_WO);
  EXPECT_NEAR(state.position, 0.1, 1e-3);
  EXPECT_NEAR(state.velocity, 0.2, 1e-2);
  EXPECT_LT(std::abs(held.V_WO.linear.z()), 0.005);
  const geometry::Matrix3d spread = held.covariance.block<3, 3>(3, 3);
  EXPECT_NEAR(joint.axis_P.dot(spread * joint.axis_P), 1e-4, 1e-6);
  EXPECT_LT(spread(2, 2), 2e-6);

  // Positions beyond a limit come back to it, and particles that were off weigh less.
  Particle beyond = particle;
  beyond.X_WO = belief::child_pose(joint, Pose{}, 0.34);
  beyond.V_WO.linear = 0.3 * joint.axis_P;
  belief.objects[0].particles = {beyond, beyond};
  belief.objects[0].particles[0].log_weight = belief.objects[0].particles[1].log_weight = -std::log(2.0);
  belief.objects[0].particles[1].X_WO.translation += Vector3d(0.0, 0.0, 0.03);
  hold_joints(belief);
  const Particle& back = belief.objects[0].particles[0];
  const belief::JointState stopped = belief::joint_state(joint, Pose{}, {}, back.X_WO, back.V_WO);
  EXPECT_NEAR(stopped.position, 0.3, 2e-3);
  EXPECT_LT(stopped.velocity, 0.02);
  EXPECT_GT(back.log_weight, belief.objects[0].particles[1].log_weight + 2.0);
}

}  // namespace
}  // namespace prescene::filter_tests::joint_tracking_test
