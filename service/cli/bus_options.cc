// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <map>

#include "verb.h"

namespace prescene::service {

void add_domain_option(CLI::App& verb, interfaces::DdsOptions& dds) {
  auto* group = verb.add_option_group("Bus", "How to join the DDS bus");
  group->add_option("--domain", dds.domain, "DDS domain")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0, 230))
      ->capture_default_str();
  const std::map<std::string, interfaces::RosDistro> distros = {{"humble", interfaces::RosDistro::kHumble},
                                                                {"jazzy", interfaces::RosDistro::kJazzy}};
  group
      ->add_option_function<std::string>(
          "--ros-distro", [&dds, distros](const std::string& name) { dds.ros_distro = distros.at(name); },
          "Show up in `ros2 node list` of this release (humble or jazzy); topics work without")
      ->check(CLI::IsMember({"humble", "jazzy"}));
}

void add_bus_options(CLI::App& verb, interfaces::DdsOptions& dds, InputTopics& topics) {
  add_domain_option(verb, dds);
  auto* group = verb.add_option_group("Topics", "Names of the robot's topics");
  group->add_option("--depth-topic", topics.depth)->capture_default_str();
  group->add_option("--color-topic", topics.color, "Empty = no colour")->capture_default_str();
  group->add_option("--camera-info-topic", topics.camera_info)->capture_default_str();
  group->add_option("--tf-topic", topics.tf)->capture_default_str();
  group->add_option("--tf-static-topic", topics.tf_static)->capture_default_str();
}

core::Result<std::optional<geometry::Pose>> camera_pose_of(const std::vector<double>& numbers) {
  if (numbers.empty()) return std::optional<geometry::Pose>();
  geometry::Pose X_WC{{numbers[3], numbers[4], numbers[5], numbers[6]}, {numbers[0], numbers[1], numbers[2]}};
  if (!X_WC.is_finite() || std::abs(X_WC.rotation.norm() - 1.0) > 0.01) {
    return core::invalid_input("--camera-pose x y z qw qx qy qz: the last four are a unit quaternion, real part first");
  }
  return std::optional<geometry::Pose>(geometry::normalized(X_WC));
}

}  // namespace prescene::service
