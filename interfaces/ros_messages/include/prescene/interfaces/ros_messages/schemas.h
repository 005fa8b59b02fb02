// SPDX-License-Identifier: Apache-2.0
// Names, RIHS01 type hashes and `ros2msg` texts of the messages in messages.h, parameter_messages.h,
// planning_messages.h and prescene_messages.h, as ROS 2 Humble and Jazzy know them.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/ros_messages/parameter_messages.h"
#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"

namespace prescene::interfaces {

/// What ROS 2 calls one message type.
struct RosType {
  std::string_view name;       ///< "sensor_msgs/msg/Image"
  std::string_view dds_name;   ///< "sensor_msgs::msg::dds_::Image_"
  std::string_view type_hash;  ///< "RIHS01_" and 64 hexadecimal digits
  std::string_view text;       ///< The .msg text without comments and constants; nested types not included.
};

/// All types of these headers, ordered by name. Lives as long as the program.
std::span<const RosType> ros_types();
/// The type with this name ("pkg/msg/Name" or, of a service, "pkg/srv/Name_Request"; also "pkg/Name"), or nullptr.
const RosType* find_ros_type(std::string_view name);

/// The schema text as rosbag2 writes it into recordings: the .msg text, then for each nested type (depth first, each
/// once) a line of 80 '=', a line "MSG: pkg/Name" and its text.
std::string ros2msg_schema(const RosType& type);

/// The type of a struct of these headers; defined for each of them.
template <class Message>
const RosType& ros_type();
template <>
const RosType& ros_type<RosDuration>();
template <>
const RosType& ros_type<RosTime>();
template <>
const RosType& ros_type<RosDiagnosticArray>();
template <>
const RosType& ros_type<RosDiagnosticStatus>();
template <>
const RosType& ros_type<RosKeyValue>();
template <>
const RosType& ros_type<RosPoint>();
template <>
const RosType& ros_type<RosPose>();
template <>
const RosType& ros_type<RosPoseArray>();
template <>
const RosType& ros_type<RosPoseStamped>();
template <>
const RosType& ros_type<RosPoseWithCovariance>();
template <>
const RosType& ros_type<RosPoseWithCovarianceStamped>();
template <>
const RosType& ros_type<RosQuaternion>();
template <>
const RosType& ros_type<RosTransform>();
template <>
const RosType& ros_type<RosTransformStamped>();
template <>
const RosType& ros_type<RosTwist>();
template <>
const RosType& ros_type<RosTwistStamped>();
template <>
const RosType& ros_type<RosVector3>();
template <>
const RosType& ros_type<RosAlternativePose>();
template <>
const RosType& ros_type<RosAnswer>();
template <>
const RosType& ros_type<RosBelief>();
template <>
const RosType& ros_type<RosCancel>();
template <>
const RosType& ros_type<RosEstimate>();
template <>
const RosType& ros_type<RosEvent>();
template <>
const RosType& ros_type<RosJointBelief>();
template <>
const RosType& ros_type<RosObjectBelief>();
template <>
const RosType& ros_type<RosParameterEstimate>();
template <>
const RosType& ros_type<RosProgress>();
template <>
const RosType& ros_type<RosQuery>();
template <>
const RosType& ros_type<RosFloatingPointRange>();
template <>
const RosType& ros_type<RosIntegerRange>();
template <>
const RosType& ros_type<RosListParametersResult>();
template <>
const RosType& ros_type<RosParameter>();
template <>
const RosType& ros_type<RosParameterDescriptor>();
template <>
const RosType& ros_type<RosParameterEvent>();
template <>
const RosType& ros_type<RosParameterValue>();
template <>
const RosType& ros_type<RosSetParametersResult>();
template <>
const RosType& ros_type<RosDescribeParametersRequest>();
template <>
const RosType& ros_type<RosDescribeParametersResponse>();
template <>
const RosType& ros_type<RosGetParameterTypesRequest>();
template <>
const RosType& ros_type<RosGetParameterTypesResponse>();
template <>
const RosType& ros_type<RosGetParametersRequest>();
template <>
const RosType& ros_type<RosGetParametersResponse>();
template <>
const RosType& ros_type<RosListParametersRequest>();
template <>
const RosType& ros_type<RosListParametersResponse>();
template <>
const RosType& ros_type<RosSetParametersAtomicallyRequest>();
template <>
const RosType& ros_type<RosSetParametersAtomicallyResponse>();
template <>
const RosType& ros_type<RosSetParametersRequest>();
template <>
const RosType& ros_type<RosSetParametersResponse>();
template <>
const RosType& ros_type<RosClock>();
template <>
const RosType& ros_type<RosCameraInfo>();
template <>
const RosType& ros_type<RosCompressedImage>();
template <>
const RosType& ros_type<RosImage>();
template <>
const RosType& ros_type<RosJointState>();
template <>
const RosType& ros_type<RosPointCloud2>();
template <>
const RosType& ros_type<RosPointField>();
template <>
const RosType& ros_type<RosRegionOfInterest>();
template <>
const RosType& ros_type<RosColorRgba>();
template <>
const RosType& ros_type<RosHeader>();
template <>
const RosType& ros_type<RosString>();
template <>
const RosType& ros_type<RosTfMessage>();
template <>
const RosType& ros_type<RosBoundingBox3d>();
template <>
const RosType& ros_type<RosDetection3d>();
template <>
const RosType& ros_type<RosDetection3dArray>();
template <>
const RosType& ros_type<RosObjectHypothesis>();
template <>
const RosType& ros_type<RosObjectHypothesisWithPose>();
template <>
const RosType& ros_type<RosMarker>();
template <>
const RosType& ros_type<RosMarkerArray>();
template <>
const RosType& ros_type<RosMeshFile>();
template <>
const RosType& ros_type<RosUvCoordinate>();
template <>
const RosType& ros_type<RosPoint32>();
template <>
const RosType& ros_type<RosPolygon>();
template <>
const RosType& ros_type<RosCollisionObject>();
template <>
const RosType& ros_type<RosObjectType>();
template <>
const RosType& ros_type<RosMesh>();
template <>
const RosType& ros_type<RosMeshTriangle>();
template <>
const RosType& ros_type<RosPlane>();
template <>
const RosType& ros_type<RosSolidPrimitive>();

}  // namespace prescene::interfaces
