// SPDX-License-Identifier: Apache-2.0
// The ROS 2 messages that Prescene reads and writes, as plain structs with the fields of their .msg files in wire
// order. Nothing here is checked: values are as a sender wrote them. conversions.h turns them into geometry with every
// check, cdr.h turns them into bytes and back, schemas.h names them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace prescene::interfaces {

/// builtin_interfaces/Time: seconds and nanoseconds since 1970.
struct RosTime {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  friend bool operator==(const RosTime&, const RosTime&) = default;
};

/// builtin_interfaces/Duration.
struct RosDuration {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  friend bool operator==(const RosDuration&, const RosDuration&) = default;
};

/// rosgraph_msgs/Clock.
struct RosClock {
  RosTime clock;
  friend bool operator==(const RosClock&, const RosClock&) = default;
};

/// std_msgs/Header.
struct RosHeader {
  RosTime stamp;
  std::string frame_id;
  friend bool operator==(const RosHeader&, const RosHeader&) = default;
};

/// std_msgs/String.
struct RosString {
  std::string data;
  friend bool operator==(const RosString&, const RosString&) = default;
};

/// std_msgs/ColorRGBA, each in [0, 1].
struct RosColorRgba {
  float r = 0.0F;
  float g = 0.0F;
  float b = 0.0F;
  float a = 0.0F;
  friend bool operator==(const RosColorRgba&, const RosColorRgba&) = default;
};

/// geometry_msgs/Vector3.
struct RosVector3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  friend bool operator==(const RosVector3&, const RosVector3&) = default;
};

/// geometry_msgs/Point, metres.
struct RosPoint {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  friend bool operator==(const RosPoint&, const RosPoint&) = default;
};

/// geometry_msgs/Quaternion: note the order x, y, z, w.
struct RosQuaternion {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double w = 1.0;
  friend bool operator==(const RosQuaternion&, const RosQuaternion&) = default;
};

/// geometry_msgs/Pose.
struct RosPose {
  RosPoint position;
  RosQuaternion orientation;
  friend bool operator==(const RosPose&, const RosPose&) = default;
};

/// geometry_msgs/PoseStamped.
struct RosPoseStamped {
  RosHeader header;
  RosPose pose;
  friend bool operator==(const RosPoseStamped&, const RosPoseStamped&) = default;
};

/// geometry_msgs/PoseWithCovariance: row-major 6x6 over (x, y, z, turn about x, about y, about z), the turns about the
/// axes of the parent frame. All zero means unknown.
struct RosPoseWithCovariance {
  RosPose pose;
  std::array<double, 36> covariance{};
  friend bool operator==(const RosPoseWithCovariance&, const RosPoseWithCovariance&) = default;
};

/// geometry_msgs/PoseWithCovarianceStamped.
struct RosPoseWithCovarianceStamped {
  RosHeader header;
  RosPoseWithCovariance pose;
  friend bool operator==(const RosPoseWithCovarianceStamped&, const RosPoseWithCovarianceStamped&) = default;
};

/// geometry_msgs/PoseArray.
struct RosPoseArray {
  RosHeader header;
  std::vector<RosPose> poses;
  friend bool operator==(const RosPoseArray&, const RosPoseArray&) = default;
};

/// geometry_msgs/Transform.
struct RosTransform {
  RosVector3 translation;
  RosQuaternion rotation;
  friend bool operator==(const RosTransform&, const RosTransform&) = default;
};

/// geometry_msgs/TransformStamped: the pose of child_frame_id in header.frame_id.
struct RosTransformStamped {
  RosHeader header;
  std::string child_frame_id;
  RosTransform transform;
  friend bool operator==(const RosTransformStamped&, const RosTransformStamped&) = default;
};

/// tf2_msgs/TFMessage.
struct RosTfMessage {
  std::vector<RosTransformStamped> transforms;
  friend bool operator==(const RosTfMessage&, const RosTfMessage&) = default;
};

/// geometry_msgs/Twist.
struct RosTwist {
  RosVector3 linear;
  RosVector3 angular;
  friend bool operator==(const RosTwist&, const RosTwist&) = default;
};

/// geometry_msgs/TwistStamped.
struct RosTwistStamped {
  RosHeader header;
  RosTwist twist;
  friend bool operator==(const RosTwistStamped&, const RosTwistStamped&) = default;
};

/// sensor_msgs/Image: `step` bytes from one row to the next.
struct RosImage {
  RosHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  std::vector<std::uint8_t> data;
  friend bool operator==(const RosImage&, const RosImage&) = default;
};

/// sensor_msgs/CompressedImage.
struct RosCompressedImage {
  RosHeader header;
  std::string format;
  std::vector<std::uint8_t> data;
  friend bool operator==(const RosCompressedImage&, const RosCompressedImage&) = default;
};

/// sensor_msgs/RegionOfInterest, pixels of the full image; 0 x 0 means all of it.
struct RosRegionOfInterest {
  std::uint32_t x_offset = 0;
  std::uint32_t y_offset = 0;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  bool do_rectify = false;
  friend bool operator==(const RosRegionOfInterest&, const RosRegionOfInterest&) = default;
};

/// sensor_msgs/CameraInfo: d distortion, k 3x3 of the raw image, r 3x3 rectification, p 3x4 of the rectified image, all
/// row-major, pixels of the full image.
struct RosCameraInfo {
  RosHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0;
  std::uint32_t binning_y = 0;
  RosRegionOfInterest roi;
  friend bool operator==(const RosCameraInfo&, const RosCameraInfo&) = default;
};

/// sensor_msgs/PointField: datatype 1 int8, 2 uint8, 3 int16, 4 uint16, 5 int32, 6 uint32, 7 float32, 8 float64.
struct RosPointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 0;
  friend bool operator==(const RosPointField&, const RosPointField&) = default;
};

/// sensor_msgs/PointCloud2: points of `point_step` bytes in rows of `row_step` bytes; a height above 1 says that the
/// cloud is organised like an image.
struct RosPointCloud2 {
  RosHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<RosPointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  friend bool operator==(const RosPointCloud2&, const RosPointCloud2&) = default;
};

/// sensor_msgs/JointState: position rad or m, velocity rad/s or m/s, effort N m or N; each empty or as long as name.
struct RosJointState {
  RosHeader header;
  std::vector<std::string> name;
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
  friend bool operator==(const RosJointState&, const RosJointState&) = default;
};

/// vision_msgs/ObjectHypothesis.
struct RosObjectHypothesis {
  std::string class_id;
  double score = 0.0;
  friend bool operator==(const RosObjectHypothesis&, const RosObjectHypothesis&) = default;
};

/// vision_msgs/ObjectHypothesisWithPose.
struct RosObjectHypothesisWithPose {
  RosObjectHypothesis hypothesis;
  RosPoseWithCovariance pose;
  friend bool operator==(const RosObjectHypothesisWithPose&, const RosObjectHypothesisWithPose&) = default;
};

/// vision_msgs/BoundingBox3D: size is the full extent, metres.
struct RosBoundingBox3d {
  RosPose center;
  RosVector3 size;
  friend bool operator==(const RosBoundingBox3d&, const RosBoundingBox3d&) = default;
};

/// vision_msgs/Detection3D.
struct RosDetection3d {
  RosHeader header;
  std::vector<RosObjectHypothesisWithPose> results;
  RosBoundingBox3d bbox;
  std::string id;
  friend bool operator==(const RosDetection3d&, const RosDetection3d&) = default;
};

/// vision_msgs/Detection3DArray.
struct RosDetection3dArray {
  RosHeader header;
  std::vector<RosDetection3d> detections;
  friend bool operator==(const RosDetection3dArray&, const RosDetection3dArray&) = default;
};

/// visualization_msgs/UVCoordinate.
struct RosUvCoordinate {
  float u = 0.0F;
  float v = 0.0F;
  friend bool operator==(const RosUvCoordinate&, const RosUvCoordinate&) = default;
};

/// visualization_msgs/MeshFile.
struct RosMeshFile {
  std::string filename;
  std::vector<std::uint8_t> data;
  friend bool operator==(const RosMeshFile&, const RosMeshFile&) = default;
};

/// Values of RosMarker::type.
enum class RosMarkerType : std::int32_t {
  kArrow = 0,
  kCube = 1,
  kSphere = 2,
  kCylinder = 3,
  kLineStrip = 4,
  kLineList = 5,
  kCubeList = 6,
  kSphereList = 7,
  kPoints = 8,
  kText = 9,
  kMesh = 10,
  kTriangleList = 11,
};

/// Values of RosMarker::action.
enum class RosMarkerAction : std::int32_t { kAdd = 0, kDelete = 2, kDeleteAll = 3 };

/// visualization_msgs/Marker.
struct RosMarker {
  RosHeader header;
  std::string ns;
  std::int32_t id = 0;
  std::int32_t type = 0;    ///< RosMarkerType
  std::int32_t action = 0;  ///< RosMarkerAction
  RosPose pose;
  RosVector3 scale;
  RosColorRgba color;
  RosDuration lifetime;
  bool frame_locked = false;
  std::vector<RosPoint> points;
  std::vector<RosColorRgba> colors;
  std::string texture_resource;
  RosCompressedImage texture;
  std::vector<RosUvCoordinate> uv_coordinates;
  std::string text;
  std::string mesh_resource;
  RosMeshFile mesh_file;
  bool mesh_use_embedded_materials = false;
  friend bool operator==(const RosMarker&, const RosMarker&) = default;
};

/// visualization_msgs/MarkerArray.
struct RosMarkerArray {
  std::vector<RosMarker> markers;
  friend bool operator==(const RosMarkerArray&, const RosMarkerArray&) = default;
};

/// diagnostic_msgs/KeyValue.
struct RosKeyValue {
  std::string key;
  std::string value;
  friend bool operator==(const RosKeyValue&, const RosKeyValue&) = default;
};

/// Values of RosDiagnosticStatus::level.
enum class RosDiagnosticLevel : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

/// diagnostic_msgs/DiagnosticStatus.
struct RosDiagnosticStatus {
  std::uint8_t level = 0;  ///< RosDiagnosticLevel
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<RosKeyValue> values;
  friend bool operator==(const RosDiagnosticStatus&, const RosDiagnosticStatus&) = default;
};

/// diagnostic_msgs/DiagnosticArray.
struct RosDiagnosticArray {
  RosHeader header;
  std::vector<RosDiagnosticStatus> status;
  friend bool operator==(const RosDiagnosticArray&, const RosDiagnosticArray&) = default;
};

}  // namespace prescene::interfaces
