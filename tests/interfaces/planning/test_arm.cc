// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/planning/test_arm.h"

#include <string>

#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::tests {
namespace {

constexpr char kUrdf[] = R"(<?xml version="1.0"?><robot name="arm">
<link name="base"><collision><geometry><cylinder radius="0.08" length="0.2"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0.15 0 0"/><geometry><box size="0.34 0.06 0.06"/></geometry></collision></link>
<link name="fore"><collision><origin xyz="0.12 0 0"/><geometry><box size="0.26 0.05 0.05"/></geometry></collision></link>
<link name="tool"><collision><geometry><box size="0.02 0.12 0.04"/></geometry></collision></link>
<link name="finger"><collision><origin xyz="0.03 0 0"/><geometry><box size="0.05 0.01 0.02"/></geometry></collision></link>
<link name="mark"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.16"/><axis xyz="0 0 1"/>
  <limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.34 0 0.01" rpy="0.1 0 0"/>
  <axis xyz="0 1 0"/><limit lower="-2.4" upper="2.4" effort="1" velocity="1"/></joint>
<joint name="twist" type="continuous"><parent link="fore"/><child link="tool"/><origin xyz="0.28 0 0"/><axis xyz="1 0 0"/></joint>
<joint name="slide" type="prismatic"><parent link="tool"/><child link="mark"/><origin xyz="0.02 0.02 0"/><axis xyz="0 1 0"/>
  <limit lower="0" upper="0.03" effort="1" velocity="1"/></joint>
<joint name="follow" type="prismatic"><parent link="tool"/><child link="finger"/><origin xyz="0.02 -0.03 0"/><axis xyz="0 1 0"/>
  <mimic joint="slide" multiplier="-0.8" offset="0.001"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="mount" type="fixed"><parent link="tool"/><child link="tip"/></joint><link name="tip"/>
</robot>)";

constexpr char kScene[] = R"(models: {stick: {box: [0.06, 0.01, 0.01], mass: 0.1}}
supports:
  plate: {box: [0.5, 0.5, 0.001], pose: {position: [0.4, 0.3, 0.35]}}
  post: {cylinder: {radius: 0.03, length: 0.8}, pose: {position: [0.1, -0.45, 0.2]}}
objects: {held: {model: stick, held_by: tool, pose: {position: [0.68, 0.0, 0.2]}}}
robot_description: {file: arm.urdf, pose: {position: [0, 0, 0]}}
)";

}  // namespace

TestArm::TestArm() {
  interfaces::SceneFileOptions options;
  options.read_file = [](const std::filesystem::path&) -> core::Result<std::vector<std::uint8_t>> {
    const std::string urdf = kUrdf;
    return std::vector<std::uint8_t>(urdf.begin(), urdf.end());
  };
  auto read = interfaces::parse_scene(kScene, "scene.yaml", options);
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
  scene = *std::move(read);
  auto kinematics = interfaces::parse_robot_kinematics(kScene, "scene.yaml", options);
  PRESCENE_CHECK_MSG(kinematics.ok(), kinematics.status().message());
  robot = *std::move(kinematics);
  core::ThreadPool pool(1);
  auto made = interfaces::Arm::make(*robot, scene, {}, pool);
  PRESCENE_CHECK_MSG(made.ok(), made.status().message());
  arm = *std::move(made);
}

}  // namespace prescene::tests
