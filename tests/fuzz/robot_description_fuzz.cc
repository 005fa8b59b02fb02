// SPDX-License-Identifier: Apache-2.0
// Any bytes as a URDF file: bodies with finite poses, or a message.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/robot_description.h"
#include "prescene/interfaces/scene_files/scene_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  interfaces::SceneFileOptions options;
  options.read_file = [=](const std::filesystem::path&) -> core::Result<std::vector<std::uint8_t>> {
    return std::vector<std::uint8_t>(data, data + size);
  };
  options.read_mesh = [](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    return geometry::make_mesh(geometry::BoxShape{geometry::Vector3d::Constant(request.scale)});
  };
  const char* text = "new_objects: true\nrobot_description: {file: fuzz.urdf}\n";
  const auto robot = interfaces::parse_robot_kinematics(text, "fuzz.yaml", options);
  const auto scene = interfaces::parse_scene(text, "fuzz.yaml", options);
  PRESCENE_CHECK(robot.ok() || !robot.status().message().empty());
  PRESCENE_CHECK(robot.ok() || !scene.ok());
  if (robot.ok()) {
    for (const auto& [link, X_RL] : interfaces::link_poses(**robot, {})) PRESCENE_CHECK(X_RL.is_finite());
  }
  if (scene.ok()) PRESCENE_CHECK(belief::validate(*scene).ok());
  return 0;
}
