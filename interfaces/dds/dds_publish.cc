// SPDX-License-Identifier: Apache-2.0
// Of the node: what it publishes, one function a type.
#include <cstddef>
#include <mutex>
#include <string>
#include <vector>

#include <dds/dds.h>
#include "dds_node_impl.h"
#include "idl_messages.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/ros_messages/cdr.h"

namespace prescene::interfaces {

template <class CType, class Message>
core::Status DdsNode::Impl::write(DdsPublisher publisher, const std::string& type, const Message& message) {
  const Publication* publication = nullptr;
  {
    const std::lock_guard lock(mutex);
    PRESCENE_CHECK(publisher.index >= 0 && publisher.index < static_cast<int>(publications.size()));
    publication = &publications[static_cast<std::size_t>(publisher.index)];
  }
  if (publication->type != type) {
    return core::invalid_input("topic " + publication->topic + " carries " + publication->type + ", not " + type);
  }
  SampleArena arena;
  CType sample{};
  fill(sample, message, arena);
  return dds_status(dds_write(publication->writer, &sample), "write to " + publication->topic);
}

core::Status DdsNode::publish(DdsPublisher publisher, const RosImage& message) {
  return impl_->write<sensor_msgs_msg_dds__Image_>(publisher, "sensor_msgs/msg/Image", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosCompressedImage& message) {
  return impl_->write<sensor_msgs_msg_dds__CompressedImage_>(publisher, "sensor_msgs/msg/CompressedImage", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosPointCloud2& message) {
  return impl_->write<sensor_msgs_msg_dds__PointCloud2_>(publisher, "sensor_msgs/msg/PointCloud2", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosCameraInfo& message) {
  return impl_->write<sensor_msgs_msg_dds__CameraInfo_>(publisher, "sensor_msgs/msg/CameraInfo", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosTfMessage& message) {
  return impl_->write<tf2_msgs_msg_dds__TFMessage_>(publisher, "tf2_msgs/msg/TFMessage", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosJointState& message) {
  return impl_->write<sensor_msgs_msg_dds__JointState_>(publisher, "sensor_msgs/msg/JointState", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosString& message) {
  return impl_->write<std_msgs_msg_dds__String_>(publisher, "std_msgs/msg/String", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosClock& message) {
  return impl_->write<rosgraph_msgs_msg_dds__Clock_>(publisher, "rosgraph_msgs/msg/Clock", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosPoseWithCovarianceStamped& message) {
  return impl_->write<geometry_msgs_msg_dds__PoseWithCovarianceStamped_>(
      publisher, "geometry_msgs/msg/PoseWithCovarianceStamped", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosPoseArray& message) {
  return impl_->write<geometry_msgs_msg_dds__PoseArray_>(publisher, "geometry_msgs/msg/PoseArray", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosDetection3dArray& message) {
  return impl_->write<vision_msgs_msg_dds__Detection3DArray_>(publisher, "vision_msgs/msg/Detection3DArray", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosMarkerArray& message) {
  return impl_->write<visualization_msgs_msg_dds__MarkerArray_>(publisher, "visualization_msgs/msg/MarkerArray",
                                                                message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosDiagnosticArray& message) {
  return impl_->write<diagnostic_msgs_msg_dds__DiagnosticArray_>(publisher, "diagnostic_msgs/msg/DiagnosticArray",
                                                                 message);
}

core::Status DdsNode::publish(DdsPublisher publisher, const RosParameterEvent& message) {
  return impl_->write<rcl_interfaces_msg_dds__ParameterEvent_>(publisher, "rcl_interfaces/msg/ParameterEvent", message);
}

core::Status DdsNode::publish(DdsPublisher publisher, const RosCollisionObject& message) {
  return impl_->write<moveit_msgs_msg_dds__CollisionObject_>(publisher, "moveit_msgs/msg/CollisionObject", message);
}

core::Status DdsNode::publish(DdsPublisher publisher, const RosBelief& message) {
  return impl_->write<prescene_msgs_msg_dds__Belief_>(publisher, "prescene_msgs/msg/Belief", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosEvent& message) {
  return impl_->write<prescene_msgs_msg_dds__Event_>(publisher, "prescene_msgs/msg/Event", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosQuery& message) {
  return impl_->write<prescene_msgs_msg_dds__Query_>(publisher, "prescene_msgs/msg/Query", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosCancel& message) {
  return impl_->write<prescene_msgs_msg_dds__Cancel_>(publisher, "prescene_msgs/msg/Cancel", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosAnswer& message) {
  return impl_->write<prescene_msgs_msg_dds__Answer_>(publisher, "prescene_msgs/msg/Answer", message);
}
core::Status DdsNode::publish(DdsPublisher publisher, const RosProgress& message) {
  return impl_->write<prescene_msgs_msg_dds__Progress_>(publisher, "prescene_msgs/msg/Progress", message);
}

core::Status DdsNode::publish_cdr(DdsPublisher publisher, const std::vector<std::uint8_t>& cdr) {
  const auto decoded = [&]<class Message>(const Message&) -> core::Status {
    PRESCENE_TRY(const Message message, decode_cdr<Message>(cdr));
    return publish(publisher, message);
  };
  std::string type;
  {
    const std::lock_guard lock(impl_->mutex);
    type = impl_->publications[static_cast<std::size_t>(publisher.index)].type;
  }
  if (type == "sensor_msgs/msg/Image") return decoded(RosImage{});
  if (type == "sensor_msgs/msg/CompressedImage") return decoded(RosCompressedImage{});
  if (type == "sensor_msgs/msg/PointCloud2") return decoded(RosPointCloud2{});
  if (type == "sensor_msgs/msg/CameraInfo") return decoded(RosCameraInfo{});
  if (type == "sensor_msgs/msg/JointState") return decoded(RosJointState{});
  if (type == "tf2_msgs/msg/TFMessage") return decoded(RosTfMessage{});
  if (type == "std_msgs/msg/String") return decoded(RosString{});
  if (type == "rosgraph_msgs/msg/Clock") return decoded(RosClock{});
  if (type == "geometry_msgs/msg/PoseWithCovarianceStamped") return decoded(RosPoseWithCovarianceStamped{});
  if (type == "geometry_msgs/msg/PoseArray") return decoded(RosPoseArray{});
  if (type == "vision_msgs/msg/Detection3DArray") return decoded(RosDetection3dArray{});
  if (type == "visualization_msgs/msg/MarkerArray") return decoded(RosMarkerArray{});
  if (type == "moveit_msgs/msg/CollisionObject") return decoded(RosCollisionObject{});
  if (type == "diagnostic_msgs/msg/DiagnosticArray") return decoded(RosDiagnosticArray{});
  if (type == "prescene_msgs/msg/Belief") return decoded(RosBelief{});
  if (type == "prescene_msgs/msg/Event") return decoded(RosEvent{});
  if (type == "prescene_msgs/msg/Query") return decoded(RosQuery{});
  if (type == "prescene_msgs/msg/Cancel") return decoded(RosCancel{});
  if (type == "prescene_msgs/msg/Answer") return decoded(RosAnswer{});
  if (type == "prescene_msgs/msg/Progress") return decoded(RosProgress{});
  return core::unsupported("messages of type '" + type + "' can't be published from recordings");
}

}  // namespace prescene::interfaces
