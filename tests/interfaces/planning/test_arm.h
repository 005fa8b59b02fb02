// SPDX-License-Identifier: Apache-2.0
// An arm of three turning joints and a slider, with a finger that mimics the slider and a thing in its hand, before a
// thin plate and a post.
#pragma once

#include <memory>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/planning/arm.h"
#include "prescene/interfaces/scene_files/robot_description.h"

namespace prescene::tests {

struct TestArm {
  TestArm();
  belief::Scene scene;
  std::shared_ptr<const interfaces::RobotKinematics> robot;
  std::shared_ptr<const interfaces::Arm> arm;
};

}  // namespace prescene::tests
