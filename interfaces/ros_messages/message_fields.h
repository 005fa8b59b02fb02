// SPDX-License-Identifier: Apache-2.0
// The fields of each message in wire order, as tuples of (name, pointer to member): what the codec walks.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "prescene/interfaces/ros_messages/image_view.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/ros_messages/parameter_messages.h"
#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"

namespace prescene::interfaces::message_fields {

template <class Message, class Value>
struct Field {
  const char* name;
  Value Message::*member;
};
template <class Message, class Value>
Field(const char*, Value Message::*) -> Field<Message, Value>;  // clang 14 deduces none for an aggregate

template <class Message>
struct Fields;

#define PRESCENE_FIELDS(type, ...)                        \
  template <>                                             \
  struct Fields<type> {                                   \
    using M = type;                                       \
    static constexpr auto list = std::tuple{__VA_ARGS__}; \
  }

PRESCENE_FIELDS(RosTime, Field{"sec", &M::sec}, Field{"nanosec", &M::nanosec});
PRESCENE_FIELDS(RosDuration, Field{"sec", &M::sec}, Field{"nanosec", &M::nanosec});
PRESCENE_FIELDS(RosClock, Field{"clock", &M::clock});
PRESCENE_FIELDS(RosHeader, Field{"stamp", &M::stamp}, Field{"frame_id", &M::frame_id});
PRESCENE_FIELDS(RosString, Field{"data", &M::data});
PRESCENE_FIELDS(RosColorRgba, Field{"r", &M::r}, Field{"g", &M::g}, Field{"b", &M::b}, Field{"a", &M::a});
PRESCENE_FIELDS(RosVector3, Field{"x", &M::x}, Field{"y", &M::y}, Field{"z", &M::z});
PRESCENE_FIELDS(RosPoint, Field{"x", &M::x}, Field{"y", &M::y}, Field{"z", &M::z});
PRESCENE_FIELDS(RosQuaternion, Field{"x", &M::x}, Field{"y", &M::y}, Field{"z", &M::z}, Field{"w", &M::w});
PRESCENE_FIELDS(RosPose, Field{"position", &M::position}, Field{"orientation", &M::orientation});
PRESCENE_FIELDS(RosPoseStamped, Field{"header", &M::header}, Field{"pose", &M::pose});
PRESCENE_FIELDS(RosPoseWithCovariance, Field{"pose", &M::pose}, Field{"covariance", &M::covariance});
PRESCENE_FIELDS(RosPoseWithCovarianceStamped, Field{"header", &M::header}, Field{"pose", &M::pose});
PRESCENE_FIELDS(RosPoseArray, Field{"header", &M::header}, Field{"poses", &M::poses});
PRESCENE_FIELDS(RosTransform, Field{"translation", &M::translation}, Field{"rotation", &M::rotation});
PRESCENE_FIELDS(RosTransformStamped, Field{"header", &M::header}, Field{"child_frame_id", &M::child_frame_id},
                Field{"transform", &M::transform});
PRESCENE_FIELDS(RosTfMessage, Field{"transforms", &M::transforms});
PRESCENE_FIELDS(RosTwist, Field{"linear", &M::linear}, Field{"angular", &M::angular});
PRESCENE_FIELDS(RosTwistStamped, Field{"header", &M::header}, Field{"twist", &M::twist});
PRESCENE_FIELDS(RosImage, Field{"header", &M::header}, Field{"height", &M::height}, Field{"width", &M::width},
                Field{"encoding", &M::encoding}, Field{"is_bigendian", &M::is_bigendian}, Field{"step", &M::step},
                Field{"data", &M::data});
PRESCENE_FIELDS(RosImageView, Field{"header", &M::header}, Field{"height", &M::height}, Field{"width", &M::width},
                Field{"encoding", &M::encoding}, Field{"is_bigendian", &M::is_bigendian}, Field{"step", &M::step},
                Field{"data", &M::data});
PRESCENE_FIELDS(RosCompressedImage, Field{"header", &M::header}, Field{"format", &M::format}, Field{"data", &M::data});
PRESCENE_FIELDS(RosRegionOfInterest, Field{"x_offset", &M::x_offset}, Field{"y_offset", &M::y_offset},
                Field{"height", &M::height}, Field{"width", &M::width}, Field{"do_rectify", &M::do_rectify});
PRESCENE_FIELDS(RosCameraInfo, Field{"header", &M::header}, Field{"height", &M::height}, Field{"width", &M::width},
                Field{"distortion_model", &M::distortion_model}, Field{"d", &M::d}, Field{"k", &M::k},
                Field{"r", &M::r}, Field{"p", &M::p}, Field{"binning_x", &M::binning_x},
                Field{"binning_y", &M::binning_y}, Field{"roi", &M::roi});
PRESCENE_FIELDS(RosPointField, Field{"name", &M::name}, Field{"offset", &M::offset}, Field{"datatype", &M::datatype},
                Field{"count", &M::count});
PRESCENE_FIELDS(RosPointCloud2, Field{"header", &M::header}, Field{"height", &M::height}, Field{"width", &M::width},
                Field{"fields", &M::fields}, Field{"is_bigendian", &M::is_bigendian},
                Field{"point_step", &M::point_step}, Field{"row_step", &M::row_step}, Field{"data", &M::data},
                Field{"is_dense", &M::is_dense});
PRESCENE_FIELDS(RosJointState, Field{"header", &M::header}, Field{"name", &M::name}, Field{"position", &M::position},
                Field{"velocity", &M::velocity}, Field{"effort", &M::effort});
PRESCENE_FIELDS(RosObjectHypothesis, Field{"class_id", &M::class_id}, Field{"score", &M::score});
PRESCENE_FIELDS(RosObjectHypothesisWithPose, Field{"hypothesis", &M::hypothesis}, Field{"pose", &M::pose});
PRESCENE_FIELDS(RosBoundingBox3d, Field{"center", &M::center}, Field{"size", &M::size});
PRESCENE_FIELDS(RosDetection3d, Field{"header", &M::header}, Field{"results", &M::results}, Field{"bbox", &M::bbox},
                Field{"id", &M::id});
PRESCENE_FIELDS(RosDetection3dArray, Field{"header", &M::header}, Field{"detections", &M::detections});
PRESCENE_FIELDS(RosUvCoordinate, Field{"u", &M::u}, Field{"v", &M::v});
PRESCENE_FIELDS(RosMeshFile, Field{"filename", &M::filename}, Field{"data", &M::data});
PRESCENE_FIELDS(RosMarker, Field{"header", &M::header}, Field{"ns", &M::ns}, Field{"id", &M::id},
                Field{"type", &M::type}, Field{"action", &M::action}, Field{"pose", &M::pose},
                Field{"scale", &M::scale}, Field{"color", &M::color}, Field{"lifetime", &M::lifetime},
                Field{"frame_locked", &M::frame_locked}, Field{"points", &M::points}, Field{"colors", &M::colors},
                Field{"texture_resource", &M::texture_resource}, Field{"texture", &M::texture},
                Field{"uv_coordinates", &M::uv_coordinates}, Field{"text", &M::text},
                Field{"mesh_resource", &M::mesh_resource}, Field{"mesh_file", &M::mesh_file},
                Field{"mesh_use_embedded_materials", &M::mesh_use_embedded_materials});
PRESCENE_FIELDS(RosMarkerArray, Field{"markers", &M::markers});
PRESCENE_FIELDS(RosKeyValue, Field{"key", &M::key}, Field{"value", &M::value});
PRESCENE_FIELDS(RosDiagnosticStatus, Field{"level", &M::level}, Field{"name", &M::name}, Field{"message", &M::message},
                Field{"hardware_id", &M::hardware_id}, Field{"values", &M::values});
PRESCENE_FIELDS(RosDiagnosticArray, Field{"header", &M::header}, Field{"status", &M::status});
PRESCENE_FIELDS(RosFloatingPointRange, Field{"from_value", &M::from_value}, Field{"to_value", &M::to_value},
                Field{"step", &M::step});
PRESCENE_FIELDS(RosIntegerRange, Field{"from_value", &M::from_value}, Field{"to_value", &M::to_value},
                Field{"step", &M::step});
PRESCENE_FIELDS(RosListParametersResult, Field{"names", &M::names}, Field{"prefixes", &M::prefixes});
PRESCENE_FIELDS(RosParameter, Field{"name", &M::name}, Field{"value", &M::value});
PRESCENE_FIELDS(RosParameterDescriptor, Field{"name", &M::name}, Field{"type", &M::type},
                Field{"description", &M::description}, Field{"additional_constraints", &M::additional_constraints},
                Field{"read_only", &M::read_only}, Field{"dynamic_typing", &M::dynamic_typing},
                Field{"floating_point_range", &M::floating_point_range}, Field{"integer_range", &M::integer_range});
PRESCENE_FIELDS(RosParameterEvent, Field{"stamp", &M::stamp}, Field{"node", &M::node},
                Field{"new_parameters", &M::new_parameters}, Field{"changed_parameters", &M::changed_parameters},
                Field{"deleted_parameters", &M::deleted_parameters});
PRESCENE_FIELDS(RosParameterValue, Field{"type", &M::type}, Field{"bool_value", &M::bool_value},
                Field{"integer_value", &M::integer_value}, Field{"double_value", &M::double_value},
                Field{"string_value", &M::string_value}, Field{"byte_array_value", &M::byte_array_value},
                Field{"bool_array_value", &M::bool_array_value}, Field{"integer_array_value", &M::integer_array_value},
                Field{"double_array_value", &M::double_array_value},
                Field{"string_array_value", &M::string_array_value});
PRESCENE_FIELDS(RosSetParametersResult, Field{"successful", &M::successful}, Field{"reason", &M::reason});
PRESCENE_FIELDS(RosDescribeParametersRequest, Field{"names", &M::names});
PRESCENE_FIELDS(RosDescribeParametersResponse, Field{"descriptors", &M::descriptors});
PRESCENE_FIELDS(RosGetParameterTypesRequest, Field{"names", &M::names});
PRESCENE_FIELDS(RosGetParameterTypesResponse, Field{"types", &M::types});
PRESCENE_FIELDS(RosGetParametersRequest, Field{"names", &M::names});
PRESCENE_FIELDS(RosGetParametersResponse, Field{"values", &M::values});
PRESCENE_FIELDS(RosListParametersRequest, Field{"prefixes", &M::prefixes}, Field{"depth", &M::depth});
PRESCENE_FIELDS(RosListParametersResponse, Field{"result", &M::result});
PRESCENE_FIELDS(RosSetParametersAtomicallyRequest, Field{"parameters", &M::parameters});
PRESCENE_FIELDS(RosSetParametersAtomicallyResponse, Field{"result", &M::result});
PRESCENE_FIELDS(RosSetParametersRequest, Field{"parameters", &M::parameters});
PRESCENE_FIELDS(RosSetParametersResponse, Field{"results", &M::results});
PRESCENE_FIELDS(RosPoint32, Field{"x", &M::x}, Field{"y", &M::y}, Field{"z", &M::z});
PRESCENE_FIELDS(RosPolygon, Field{"points", &M::points});
PRESCENE_FIELDS(RosSolidPrimitive, Field{"type", &M::type}, Field{"dimensions", &M::dimensions},
                Field{"polygon", &M::polygon});
PRESCENE_FIELDS(RosMeshTriangle, Field{"vertex_indices", &M::vertex_indices});
PRESCENE_FIELDS(RosMesh, Field{"triangles", &M::triangles}, Field{"vertices", &M::vertices});
PRESCENE_FIELDS(RosPlane, Field{"coef", &M::coef});
PRESCENE_FIELDS(RosObjectType, Field{"key", &M::key}, Field{"db", &M::db});
PRESCENE_FIELDS(RosCollisionObject, Field{"header", &M::header}, Field{"pose", &M::pose}, Field{"id", &M::id},
                Field{"type", &M::type}, Field{"primitives", &M::primitives},
                Field{"primitive_poses", &M::primitive_poses}, Field{"meshes", &M::meshes},
                Field{"mesh_poses", &M::mesh_poses}, Field{"planes", &M::planes}, Field{"plane_poses", &M::plane_poses},
                Field{"subframe_names", &M::subframe_names}, Field{"subframe_poses", &M::subframe_poses},
                Field{"operation", &M::operation});
PRESCENE_FIELDS(RosAlternativePose, Field{"pose", &M::pose}, Field{"probability", &M::probability});
PRESCENE_FIELDS(RosParameterEstimate, Field{"name", &M::name}, Field{"mean", &M::mean},
                Field{"standard_deviation", &M::standard_deviation}, Field{"low", &M::low}, Field{"high", &M::high});
PRESCENE_FIELDS(RosObjectBelief, Field{"name", &M::name}, Field{"model", &M::model}, Field{"state", &M::state},
                Field{"motion", &M::motion}, Field{"held_by", &M::held_by}, Field{"confidence", &M::confidence},
                Field{"existence", &M::existence}, Field{"visible_share", &M::visible_share}, Field{"pose", &M::pose},
                Field{"twist", &M::twist}, Field{"parameters", &M::parameters}, Field{"lessons", &M::lessons},
                Field{"learned", &M::learned}, Field{"alternatives", &M::alternatives}, Field{"is_new", &M::is_new},
                Field{"size", &M::size});
PRESCENE_FIELDS(RosJointBelief, Field{"name", &M::name}, Field{"type", &M::type}, Field{"position", &M::position},
                Field{"standard_deviation", &M::standard_deviation}, Field{"velocity", &M::velocity},
                Field{"lower", &M::lower}, Field{"upper", &M::upper}, Field{"confidence", &M::confidence});
PRESCENE_FIELDS(RosBelief, Field{"header", &M::header}, Field{"step", &M::step}, Field{"objects", &M::objects},
                Field{"joints", &M::joints});
PRESCENE_FIELDS(RosEvent, Field{"header", &M::header}, Field{"step", &M::step}, Field{"event", &M::event},
                Field{"object", &M::object}, Field{"support", &M::support}, Field{"camera", &M::camera},
                Field{"previous", &M::previous}, Field{"current", &M::current}, Field{"reason", &M::reason});
PRESCENE_FIELDS(RosQuery, Field{"id", &M::id}, Field{"kind", &M::kind}, Field{"object", &M::object},
                Field{"duration", &M::duration}, Field{"max_seconds", &M::max_seconds}, Field{"stream", &M::stream},
                Field{"detail", &M::detail}, Field{"arguments", &M::arguments});
PRESCENE_FIELDS(RosCancel, Field{"question", &M::question}, Field{"id", &M::id});
PRESCENE_FIELDS(RosEstimate, Field{"name", &M::name}, Field{"group", &M::group}, Field{"subject", &M::subject},
                Field{"other", &M::other}, Field{"probability", &M::probability}, Field{"low", &M::low},
                Field{"high", &M::high});
PRESCENE_FIELDS(RosAnswer, Field{"id", &M::id}, Field{"step", &M::step}, Field{"kind", &M::kind},
                Field{"state", &M::state}, Field{"error", &M::error}, Field{"code", &M::code},
                Field{"estimates", &M::estimates}, Field{"objects", &M::objects}, Field{"instances", &M::instances},
                Field{"converged", &M::converged}, Field{"remarks", &M::remarks}, Field{"json", &M::json});
PRESCENE_FIELDS(RosProgress, Field{"id", &M::id}, Field{"fraction", &M::fraction}, Field{"text", &M::text},
                Field{"seconds_left", &M::seconds_left});

#undef PRESCENE_FIELDS

/// Fewest bytes that a value can take on the wire, padding not counted.
template <class T>
struct MinWireSize {
  static constexpr std::size_t value = std::apply(
      [](auto... field) {
        return (MinWireSize<std::remove_cvref_t<decltype(std::declval<T>().*field.member)>>::value + ...);
      },
      Fields<T>::list);
};
template <class T>
requires std::is_arithmetic_v<T>
struct MinWireSize<T> {
  static constexpr std::size_t value = sizeof(T);
};
template <>
struct MinWireSize<std::string> {
  static constexpr std::size_t value = 4;
};
template <class T>
struct MinWireSize<std::vector<T>> {
  static constexpr std::size_t value = 4;
};
template <class T, std::size_t n>
struct MinWireSize<std::array<T, n>> {
  static constexpr std::size_t value = n * MinWireSize<T>::value;
};

}  // namespace prescene::interfaces::message_fields

/// Every message of messages.h, parameter_messages.h, planning_messages.h and prescene_messages.h, for explicit
/// instantiation.
// clang-format off
#define PRESCENE_FOR_EACH_MESSAGE(DO) \
  DO(RosTime) DO(RosDuration) DO(RosClock) DO(RosHeader) DO(RosString) DO(RosColorRgba) DO(RosVector3) \
  DO(RosPoint) DO(RosQuaternion) DO(RosPose) DO(RosPoseStamped) DO(RosPoseWithCovariance) \
  DO(RosPoseWithCovarianceStamped) DO(RosPoseArray) DO(RosTransform) DO(RosTransformStamped) DO(RosTfMessage) \
  DO(RosTwist) DO(RosTwistStamped) DO(RosImage) DO(RosCompressedImage) DO(RosRegionOfInterest) \
  DO(RosCameraInfo) DO(RosPointField) DO(RosPointCloud2) DO(RosJointState) DO(RosObjectHypothesis) DO(RosObjectHypothesisWithPose) \
  DO(RosBoundingBox3d) DO(RosDetection3d) DO(RosDetection3dArray) DO(RosUvCoordinate) DO(RosMeshFile) \
  DO(RosMarker) DO(RosMarkerArray) DO(RosKeyValue) DO(RosDiagnosticStatus) DO(RosDiagnosticArray) \
  DO(RosFloatingPointRange) DO(RosIntegerRange) DO(RosListParametersResult) DO(RosParameter) \
  DO(RosParameterDescriptor) DO(RosParameterEvent) DO(RosParameterValue) DO(RosSetParametersResult) \
  DO(RosDescribeParametersRequest) DO(RosDescribeParametersResponse) DO(RosGetParameterTypesRequest) \
  DO(RosGetParameterTypesResponse) DO(RosGetParametersRequest) DO(RosGetParametersResponse) \
  DO(RosListParametersRequest) DO(RosListParametersResponse) DO(RosSetParametersAtomicallyRequest) \
  DO(RosSetParametersAtomicallyResponse) DO(RosSetParametersRequest) DO(RosSetParametersResponse) \
  DO(RosPoint32) DO(RosPolygon) DO(RosSolidPrimitive) DO(RosMeshTriangle) DO(RosMesh) DO(RosPlane) DO(RosObjectType) \
  DO(RosCollisionObject) \
  DO(RosAlternativePose) DO(RosParameterEstimate) DO(RosObjectBelief) DO(RosJointBelief) DO(RosBelief) DO(RosEvent) \
  DO(RosQuery) DO(RosCancel) DO(RosEstimate) DO(RosAnswer) DO(RosProgress)
// clang-format on
