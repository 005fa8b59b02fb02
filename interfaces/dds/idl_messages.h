// SPDX-License-Identifier: Apache-2.0
// From the plain structs of messages.h to the C structs that idlc makes. Strings and sequences of numbers are borrowed,
// not copied: a filled C struct lives no longer than its message and its arena.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/ros_messages/parameter_messages.h"
#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"
#include "prescene_msgs.h"
#include "ros_messages.h"

namespace prescene::interfaces {

/// Holds the arrays of structs of one message while it is written.
class SampleArena {
 public:
  template <class T>
  T* array(std::size_t count) {
    blocks_.push_back(std::make_unique<std::max_align_t[]>((count * sizeof(T)) / sizeof(std::max_align_t) + 1));
    std::memset(blocks_.back().get(), 0, count * sizeof(T));
    return reinterpret_cast<T*>(blocks_.back().get());
  }

 private:
  std::vector<std::unique_ptr<std::max_align_t[]>> blocks_;
};

template <class T>
requires std::is_arithmetic_v<T>
void fill(T& to, const T& from, SampleArena&) { to = from; }
inline void fill(char*& to, const std::string& from, SampleArena&) { to = const_cast<char*>(from.c_str()); }
template <class T, std::size_t N>
void fill(T (&to)[N], const std::array<T, N>& from, SampleArena&) {
  std::memcpy(to, from.data(), sizeof to);
}
template <class Sequence, class T>
void fill(Sequence& to, const std::vector<T>& from, SampleArena& arena);

#define PRESCENE_FILL_FIELD(field) fill(to.field, from.field, arena);
#define PRESCENE_FILL_1(a) PRESCENE_FILL_FIELD(a)
#define PRESCENE_FILL_2(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_1(__VA_ARGS__)
#define PRESCENE_FILL_3(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_2(__VA_ARGS__)
#define PRESCENE_FILL_4(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_3(__VA_ARGS__)
#define PRESCENE_FILL_5(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_4(__VA_ARGS__)
#define PRESCENE_FILL_6(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_5(__VA_ARGS__)
#define PRESCENE_FILL_7(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_6(__VA_ARGS__)
#define PRESCENE_FILL_8(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_7(__VA_ARGS__)
#define PRESCENE_FILL_9(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_8(__VA_ARGS__)
#define PRESCENE_FILL_10(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_9(__VA_ARGS__)
#define PRESCENE_FILL_11(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_10(__VA_ARGS__)
#define PRESCENE_FILL_12(a, ...) PRESCENE_FILL_FIELD(a) PRESCENE_FILL_11(__VA_ARGS__)
#define PRESCENE_FILL_13(a, b, ...) PRESCENE_FILL_2(a, b) PRESCENE_FILL_11(__VA_ARGS__)
#define PRESCENE_FILL_16(a, b, c, d, e, ...) PRESCENE_FILL_5(a, b, c, d, e) PRESCENE_FILL_11(__VA_ARGS__)
#define PRESCENE_FILL_19(a, b, c, d, e, f, g, h, ...) \
  PRESCENE_FILL_8(a, b, c, d, e, f, g, h) PRESCENE_FILL_11(__VA_ARGS__)
/// Fills every field of the C struct from the field of the same name.
#define PRESCENE_FILL_STRUCT(c_type, message_type, count, ...) \
  inline void fill(c_type& to, const message_type& from, SampleArena& arena) { PRESCENE_FILL_##count(__VA_ARGS__) }

PRESCENE_FILL_STRUCT(builtin_interfaces_msg_dds__Time_, RosTime, 2, sec, nanosec)
PRESCENE_FILL_STRUCT(builtin_interfaces_msg_dds__Duration_, RosDuration, 2, sec, nanosec)
PRESCENE_FILL_STRUCT(rosgraph_msgs_msg_dds__Clock_, RosClock, 1, clock)
PRESCENE_FILL_STRUCT(std_msgs_msg_dds__Header_, RosHeader, 2, stamp, frame_id)
PRESCENE_FILL_STRUCT(std_msgs_msg_dds__String_, RosString, 1, data)
PRESCENE_FILL_STRUCT(std_msgs_msg_dds__ColorRGBA_, RosColorRgba, 4, r, g, b, a)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Vector3_, RosVector3, 3, x, y, z)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Point_, RosPoint, 3, x, y, z)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Quaternion_, RosQuaternion, 4, x, y, z, w)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Pose_, RosPose, 2, position, orientation)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__PoseWithCovariance_, RosPoseWithCovariance, 2, pose, covariance)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__PoseWithCovarianceStamped_, RosPoseWithCovarianceStamped, 2, header, pose)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__PoseArray_, RosPoseArray, 2, header, poses)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Transform_, RosTransform, 2, translation, rotation)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__TransformStamped_, RosTransformStamped, 3, header, child_frame_id,
                     transform)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Twist_, RosTwist, 2, linear, angular)
PRESCENE_FILL_STRUCT(tf2_msgs_msg_dds__TFMessage_, RosTfMessage, 1, transforms)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__Image_, RosImage, 7, header, height, width, encoding, is_bigendian, step,
                     data)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__CompressedImage_, RosCompressedImage, 3, header, format, data)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__RegionOfInterest_, RosRegionOfInterest, 5, x_offset, y_offset, height, width,
                     do_rectify)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__CameraInfo_, RosCameraInfo, 11, header, height, width, distortion_model, d, k,
                     r, p, binning_x, binning_y, roi)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__PointField_, RosPointField, 4, name, offset, datatype, count)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__PointCloud2_, RosPointCloud2, 9, header, height, width, fields, is_bigendian,
                     point_step, row_step, data, is_dense)
PRESCENE_FILL_STRUCT(sensor_msgs_msg_dds__JointState_, RosJointState, 5, header, name, position, velocity, effort)
PRESCENE_FILL_STRUCT(vision_msgs_msg_dds__ObjectHypothesis_, RosObjectHypothesis, 2, class_id, score)
PRESCENE_FILL_STRUCT(vision_msgs_msg_dds__ObjectHypothesisWithPose_, RosObjectHypothesisWithPose, 2, hypothesis, pose)
PRESCENE_FILL_STRUCT(vision_msgs_msg_dds__BoundingBox3D_, RosBoundingBox3d, 2, center, size)
PRESCENE_FILL_STRUCT(vision_msgs_msg_dds__Detection3D_, RosDetection3d, 4, header, results, bbox, id)
PRESCENE_FILL_STRUCT(vision_msgs_msg_dds__Detection3DArray_, RosDetection3dArray, 2, header, detections)
PRESCENE_FILL_STRUCT(visualization_msgs_msg_dds__UVCoordinate_, RosUvCoordinate, 2, u, v)
PRESCENE_FILL_STRUCT(visualization_msgs_msg_dds__MeshFile_, RosMeshFile, 2, filename, data)
PRESCENE_FILL_STRUCT(visualization_msgs_msg_dds__Marker_, RosMarker, 19, header, ns, id, type, action, pose, scale,
                     color, lifetime, frame_locked, points, colors, texture_resource, texture, uv_coordinates, text,
                     mesh_resource, mesh_file, mesh_use_embedded_materials)
PRESCENE_FILL_STRUCT(visualization_msgs_msg_dds__MarkerArray_, RosMarkerArray, 1, markers)
PRESCENE_FILL_STRUCT(diagnostic_msgs_msg_dds__KeyValue_, RosKeyValue, 2, key, value)
PRESCENE_FILL_STRUCT(diagnostic_msgs_msg_dds__DiagnosticStatus_, RosDiagnosticStatus, 5, level, name, message,
                     hardware_id, values)
PRESCENE_FILL_STRUCT(diagnostic_msgs_msg_dds__DiagnosticArray_, RosDiagnosticArray, 2, header, status)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__ParameterValue_, RosParameterValue, 10, type, bool_value, integer_value,
                     double_value, string_value, byte_array_value, bool_array_value, integer_array_value,
                     double_array_value, string_array_value)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__Parameter_, RosParameter, 2, name, value)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__FloatingPointRange_, RosFloatingPointRange, 3, from_value, to_value, step)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__IntegerRange_, RosIntegerRange, 3, from_value, to_value, step)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__ParameterDescriptor_, RosParameterDescriptor, 8, name, type, description,
                     additional_constraints, read_only, dynamic_typing, floating_point_range, integer_range)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__SetParametersResult_, RosSetParametersResult, 2, successful, reason)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__ListParametersResult_, RosListParametersResult, 2, names, prefixes)
PRESCENE_FILL_STRUCT(rcl_interfaces_msg_dds__ParameterEvent_, RosParameterEvent, 5, stamp, node, new_parameters,
                     changed_parameters, deleted_parameters)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Point32_, RosPoint32, 3, x, y, z)
PRESCENE_FILL_STRUCT(geometry_msgs_msg_dds__Polygon_, RosPolygon, 1, points)
PRESCENE_FILL_STRUCT(shape_msgs_msg_dds__SolidPrimitive_, RosSolidPrimitive, 3, type, dimensions, polygon)
PRESCENE_FILL_STRUCT(shape_msgs_msg_dds__MeshTriangle_, RosMeshTriangle, 1, vertex_indices)
PRESCENE_FILL_STRUCT(shape_msgs_msg_dds__Mesh_, RosMesh, 2, triangles, vertices)
PRESCENE_FILL_STRUCT(shape_msgs_msg_dds__Plane_, RosPlane, 1, coef)
PRESCENE_FILL_STRUCT(object_recognition_msgs_msg_dds__ObjectType_, RosObjectType, 2, key, db)
PRESCENE_FILL_STRUCT(moveit_msgs_msg_dds__CollisionObject_, RosCollisionObject, 13, header, pose, id, type, primitives,
                     primitive_poses, meshes, mesh_poses, planes, plane_poses, subframe_names, subframe_poses,
                     operation)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__AlternativePose_, RosAlternativePose, 2, pose, probability)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__ParameterEstimate_, RosParameterEstimate, 5, name, mean, standard_deviation,
                     low, high)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__ObjectBelief_, RosObjectBelief, 16, name, model, state, motion, held_by,
                     confidence, existence, visible_share, pose, twist, parameters, lessons, learned, alternatives,
                     is_new, size)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__JointBelief_, RosJointBelief, 8, name, type, position, standard_deviation,
                     velocity, lower, upper, confidence)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Belief_, RosBelief, 4, header, step, objects, joints)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Event_, RosEvent, 9, header, step, event, object, support, camera, previous,
                     current, reason)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Query_, RosQuery, 8, id, kind, object, duration, max_seconds, stream,
                     detail, arguments)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Cancel_, RosCancel, 2, question, id)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Estimate_, RosEstimate, 7, name, group, subject, other, probability, low,
                     high)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Answer_, RosAnswer, 12, id, step, kind, state, error, code, estimates,
                     objects, instances, converged, remarks, json)
PRESCENE_FILL_STRUCT(prescene_msgs_msg_dds__Progress_, RosProgress, 4, id, fraction, text, seconds_left)
// Of replies, all but the client and the number of its request.
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__ListParameters_Response_, RosListParametersResponse, 1, result)
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__GetParameters_Response_, RosGetParametersResponse, 1, values)
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__GetParameterTypes_Response_, RosGetParameterTypesResponse, 1, types)
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__DescribeParameters_Response_, RosDescribeParametersResponse, 1,
                     descriptors)
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__SetParameters_Response_, RosSetParametersResponse, 1, results)
PRESCENE_FILL_STRUCT(rcl_interfaces_srv_dds__SetParametersAtomically_Response_, RosSetParametersAtomicallyResponse, 1,
                     result)

#undef PRESCENE_FILL_STRUCT
#undef PRESCENE_FILL_19
#undef PRESCENE_FILL_16
#undef PRESCENE_FILL_13
#undef PRESCENE_FILL_12
#undef PRESCENE_FILL_11
#undef PRESCENE_FILL_10
#undef PRESCENE_FILL_9
#undef PRESCENE_FILL_8
#undef PRESCENE_FILL_7
#undef PRESCENE_FILL_6
#undef PRESCENE_FILL_5
#undef PRESCENE_FILL_4
#undef PRESCENE_FILL_3
#undef PRESCENE_FILL_2
#undef PRESCENE_FILL_1
#undef PRESCENE_FILL_FIELD

template <class Sequence, class T>
void fill(Sequence& to, const std::vector<T>& from, SampleArena& arena) {
  using Element = std::remove_pointer_t<decltype(to._buffer)>;
  to._length = static_cast<std::uint32_t>(from.size());
  to._maximum = to._length;
  to._release = false;
  if constexpr (std::is_same_v<Element, bool>) {  // they are bytes in ours
    to._buffer = arena.array<bool>(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) to._buffer[i] = from[i] != 0;
  } else if constexpr (std::is_arithmetic_v<T>) {
    static_assert(std::is_same_v<Element, T>);
    to._buffer = const_cast<Element*>(from.data());
  } else {
    to._buffer = arena.array<Element>(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) fill(to._buffer[i], from[i], arena);
  }
}

}  // namespace prescene::interfaces
