// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/ros_messages/schemas.h"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>

#include "prescene/core/check.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"

namespace prescene::interfaces {
namespace {

constexpr std::array<std::string_view, 15> kPrimitives = {"bool",   "byte",  "char",   "float32", "float64",
                                                          "int8",   "uint8", "int16",  "uint16",  "int32",
                                                          "uint32", "int64", "uint64", "string",  "wstring"};

const RosType& named(std::string_view name);

std::string_view package_of(std::string_view name) { return name.substr(0, name.find('/')); }
std::string_view last_part(std::string_view name) { return name.substr(name.rfind('/') + 1); }

/// "Pose[]" in geometry_msgs is geometry_msgs/msg/Pose; nullptr for a primitive.
const RosType* nested_type(std::string_view field_type, std::string_view package) {
  const std::string_view element = field_type.substr(0, field_type.find('['));
  if (std::find(kPrimitives.begin(), kPrimitives.end(), element) != kPrimitives.end()) return nullptr;
  const bool has_package = element.find('/') != std::string_view::npos;
  const std::string name = has_package ? std::string(element) : std::string(package) + "/" + std::string(element);
  return &named(name);
}

void append_nested(const RosType& type, std::set<const RosType*>* done, std::string* out) {
  std::string_view rest = type.text;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(line.size() + 1);
    const RosType* nested = nested_type(line.substr(0, line.find(' ')), package_of(type.name));
    if (nested == nullptr || !done->insert(nested).second) continue;
    *out += std::string(80, '=') + "\nMSG: " + std::string(package_of(nested->name)) + "/" +
            std::string(last_part(nested->name)) + "\n" + std::string(nested->text);
    append_nested(*nested, done, out);
  }
}

const RosType& named(std::string_view name) {
  const RosType* type = find_ros_type(name);
  PRESCENE_CHECK_MSG(type != nullptr, name);
  return *type;
}

}  // namespace

const RosType* find_ros_type(std::string_view name) {
  for (const RosType& type : ros_types()) {
    if (type.name == name) return &type;
    if (package_of(type.name) == package_of(name) && last_part(type.name) == last_part(name) &&
        std::count(name.begin(), name.end(), '/') == 1) {
      return &type;
    }
  }
  return nullptr;
}

std::string ros2msg_schema(const RosType& type) {
  std::string out(type.text);
  std::set<const RosType*> done = {&type};
  append_nested(type, &done, &out);
  return out;
}

#define PRESCENE_NAME(Message, name)          \
  template <>                                 \
  const RosType& ros_type<Message>() {        \
    static const RosType& type = named(name); \
    return type;                              \
  }
PRESCENE_NAME(RosDuration, "builtin_interfaces/msg/Duration")
PRESCENE_NAME(RosTime, "builtin_interfaces/msg/Time")
PRESCENE_NAME(RosDiagnosticArray, "diagnostic_msgs/msg/DiagnosticArray")
PRESCENE_NAME(RosDiagnosticStatus, "diagnostic_msgs/msg/DiagnosticStatus")
PRESCENE_NAME(RosKeyValue, "diagnostic_msgs/msg/KeyValue")
PRESCENE_NAME(RosPoint, "geometry_msgs/msg/Point")
PRESCENE_NAME(RosPose, "geometry_msgs/msg/Pose")
PRESCENE_NAME(RosPoseArray, "geometry_msgs/msg/PoseArray")
PRESCENE_NAME(RosPoseStamped, "geometry_msgs/msg/PoseStamped")
PRESCENE_NAME(RosPoseWithCovariance, "geometry_msgs/msg/PoseWithCovariance")
PRESCENE_NAME(RosPoseWithCovarianceStamped, "geometry_msgs/msg/PoseWithCovarianceStamped")
PRESCENE_NAME(RosQuaternion, "geometry_msgs/msg/Quaternion")
PRESCENE_NAME(RosTransform, "geometry_msgs/msg/Transform")
PRESCENE_NAME(RosTransformStamped, "geometry_msgs/msg/TransformStamped")
PRESCENE_NAME(RosTwist, "geometry_msgs/msg/Twist")
PRESCENE_NAME(RosTwistStamped, "geometry_msgs/msg/TwistStamped")
PRESCENE_NAME(RosVector3, "geometry_msgs/msg/Vector3")
PRESCENE_NAME(RosAlternativePose, "prescene_msgs/msg/AlternativePose")
PRESCENE_NAME(RosAnswer, "prescene_msgs/msg/Answer")
PRESCENE_NAME(RosBelief, "prescene_msgs/msg/Belief")
PRESCENE_NAME(RosCancel, "prescene_msgs/msg/Cancel")
PRESCENE_NAME(RosEstimate, "prescene_msgs/msg/Estimate")
PRESCENE_NAME(RosEvent, "prescene_msgs/msg/Event")
PRESCENE_NAME(RosJointBelief, "prescene_msgs/msg/JointBelief")
PRESCENE_NAME(RosObjectBelief, "prescene_msgs/msg/ObjectBelief")
PRESCENE_NAME(RosParameterEstimate, "prescene_msgs/msg/ParameterEstimate")
PRESCENE_NAME(RosProgress, "prescene_msgs/msg/Progress")
PRESCENE_NAME(RosQuery, "prescene_msgs/msg/Query")
PRESCENE_NAME(RosFloatingPointRange, "rcl_interfaces/msg/FloatingPointRange")
PRESCENE_NAME(RosIntegerRange, "rcl_interfaces/msg/IntegerRange")
PRESCENE_NAME(RosListParametersResult, "rcl_interfaces/msg/ListParametersResult")
PRESCENE_NAME(RosParameter, "rcl_interfaces/msg/Parameter")
PRESCENE_NAME(RosParameterDescriptor, "rcl_interfaces/msg/ParameterDescriptor")
PRESCENE_NAME(RosParameterEvent, "rcl_interfaces/msg/ParameterEvent")
PRESCENE_NAME(RosParameterValue, "rcl_interfaces/msg/ParameterValue")
PRESCENE_NAME(RosSetParametersResult, "rcl_interfaces/msg/SetParametersResult")
PRESCENE_NAME(RosDescribeParametersRequest, "rcl_interfaces/srv/DescribeParameters_Request")
PRESCENE_NAME(RosDescribeParametersResponse, "rcl_interfaces/srv/DescribeParameters_Response")
PRESCENE_NAME(RosGetParameterTypesRequest, "rcl_interfaces/srv/GetParameterTypes_Request")
PRESCENE_NAME(RosGetParameterTypesResponse, "rcl_interfaces/srv/GetParameterTypes_Response")
PRESCENE_NAME(RosGetParametersRequest, "rcl_interfaces/srv/GetParameters_Request")
PRESCENE_NAME(RosGetParametersResponse, "rcl_interfaces/srv/GetParameters_Response")
PRESCENE_NAME(RosListParametersRequest, "rcl_interfaces/srv/ListParameters_Request")
PRESCENE_NAME(RosListParametersResponse, "rcl_interfaces/srv/ListParameters_Response")
PRESCENE_NAME(RosSetParametersAtomicallyRequest, "rcl_interfaces/srv/SetParametersAtomically_Request")
PRESCENE_NAME(RosSetParametersAtomicallyResponse, "rcl_interfaces/srv/SetParametersAtomically_Response")
PRESCENE_NAME(RosSetParametersRequest, "rcl_interfaces/srv/SetParameters_Request")
PRESCENE_NAME(RosSetParametersResponse, "rcl_interfaces/srv/SetParameters_Response")
PRESCENE_NAME(RosClock, "rosgraph_msgs/msg/Clock")
PRESCENE_NAME(RosCameraInfo, "sensor_msgs/msg/CameraInfo")
PRESCENE_NAME(RosCompressedImage, "sensor_msgs/msg/CompressedImage")
PRESCENE_NAME(RosImage, "sensor_msgs/msg/Image")
PRESCENE_NAME(RosJointState, "sensor_msgs/msg/JointState")
PRESCENE_NAME(RosPointCloud2, "sensor_msgs/msg/PointCloud2")
PRESCENE_NAME(RosPointField, "sensor_msgs/msg/PointField")
PRESCENE_NAME(RosRegionOfInterest, "sensor_msgs/msg/RegionOfInterest")
PRESCENE_NAME(RosColorRgba, "std_msgs/msg/ColorRGBA")
PRESCENE_NAME(RosHeader, "std_msgs/msg/Header")
PRESCENE_NAME(RosString, "std_msgs/msg/String")
PRESCENE_NAME(RosTfMessage, "tf2_msgs/msg/TFMessage")
PRESCENE_NAME(RosBoundingBox3d, "vision_msgs/msg/BoundingBox3D")
PRESCENE_NAME(RosDetection3d, "vision_msgs/msg/Detection3D")
PRESCENE_NAME(RosDetection3dArray, "vision_msgs/msg/Detection3DArray")
PRESCENE_NAME(RosObjectHypothesis, "vision_msgs/msg/ObjectHypothesis")
PRESCENE_NAME(RosObjectHypothesisWithPose, "vision_msgs/msg/ObjectHypothesisWithPose")
PRESCENE_NAME(RosMarker, "visualization_msgs/msg/Marker")
PRESCENE_NAME(RosMarkerArray, "visualization_msgs/msg/MarkerArray")
PRESCENE_NAME(RosMeshFile, "visualization_msgs/msg/MeshFile")
PRESCENE_NAME(RosUvCoordinate, "visualization_msgs/msg/UVCoordinate")
PRESCENE_NAME(RosPoint32, "geometry_msgs/msg/Point32")
PRESCENE_NAME(RosPolygon, "geometry_msgs/msg/Polygon")
PRESCENE_NAME(RosCollisionObject, "moveit_msgs/msg/CollisionObject")
PRESCENE_NAME(RosObjectType, "object_recognition_msgs/msg/ObjectType")
PRESCENE_NAME(RosMesh, "shape_msgs/msg/Mesh")
PRESCENE_NAME(RosMeshTriangle, "shape_msgs/msg/MeshTriangle")
PRESCENE_NAME(RosPlane, "shape_msgs/msg/Plane")
PRESCENE_NAME(RosSolidPrimitive, "shape_msgs/msg/SolidPrimitive")
#undef PRESCENE_NAME

}  // namespace prescene::interfaces
