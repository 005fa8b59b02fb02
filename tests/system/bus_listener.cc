// SPDX-License-Identifier: Apache-2.0
// bus_listener DOMAIN: reads everything that the service publishes, reliably, until it is killed. Stopped by a signal
// it is the reader that does not keep up.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/tracking/topics.h"

int main(int argc, char** argv) {
  using namespace prescene;
  interfaces::DdsOptions options;
  options.domain = argc > 1 ? std::atoi(argv[1]) : 0;
  options.node_name = "listener";
  const auto node = interfaces::DdsNode::create(options, {});
  if (!node) {
    std::fprintf(stderr, "%s\n", node.status().message().c_str());
    return 1;
  }
  const std::string string = "std_msgs/msg/String";
  const struct {
    std::string topic, type;
  } rows[] = {{service::kBeliefTopic, string},
              {service::kAnswerTopic, string},
              {service::kMarkersTopic, "visualization_msgs/msg/MarkerArray"},
              {service::kPosesTopic, "geometry_msgs/msg/PoseArray"},
              {service::kDetectionsTopic, "vision_msgs/msg/Detection3DArray"},
              {service::kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray"},
              {service::pose_topic("box"), "geometry_msgs/msg/PoseWithCovarianceStamped"}};
  for (const auto& row : rows) {
    const auto taken = (*node)->subscribe(row.topic, row.type, interfaces::TopicQos::kReliable, [](auto&&) {});
    if (!taken.ok()) return 1;
  }
  for (;;) pause();
}
