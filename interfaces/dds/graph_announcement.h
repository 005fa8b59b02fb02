// SPDX-License-Identifier: Apache-2.0
// Tells other ROS 2 nodes that this one exists (`ros2 node list`), in the form of one release.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dds/dds.h>
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces {

class GraphAnnouncement {
 public:
  static core::Result<std::unique_ptr<GraphAnnouncement>> create(dds_entity_t participant, RosDistro distro);
  /// Publishes the whole list again: the participant's one node with its endpoints.
  void publish(const std::string& node_name, const std::vector<dds_entity_t>& readers,
               const std::vector<dds_entity_t>& writers);

 private:
  explicit GraphAnnouncement(const dds_topic_descriptor_t& descriptor) : descriptor_(descriptor) {}

  RosDistro distro_ = RosDistro::kHumble;
  dds_entity_t participant_ = 0;
  dds_entity_t writer_ = 0;
  // Topics keep pointing into their descriptor.
  dds_topic_descriptor_t descriptor_;
};

}  // namespace prescene::interfaces
