// SPDX-License-Identifier: Apache-2.0
// Between ROS 2 messages and our geometry, with every check that a careless or hostile sender calls for. The text of an
// error names the field and what the sender has to change; add the topic with Status::at().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/lens.h"
#include "prescene/geometry/pose.h"
#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

// --- Time, frames, poses -------------------------------------------------------------------------------------------

/// Nanoseconds since 1970. kInvalidInput for nanosec >= 10^9 and for negative seconds; 0 (a sender without a clock)
/// passes.
core::Result<std::int64_t> to_stamp_ns(const RosTime& stamp);
/// 0 <= stamp_ns < 2^31 s (checked).
RosTime to_ros_time(std::int64_t stamp_ns);

/// The frame's name without the leading '/' of ROS 1. kInvalidInput when empty, longer than 255 bytes, not UTF-8 or
/// with control bytes.
core::Result<std::string> to_frame_id(std::string_view frame_id);

struct PoseRules {
  double max_coordinate = 1e5;               ///< Metres; more is nonsense or another unit.
  bool zero_quaternion_is_identity = false;  ///< Accept 0, 0, 0, 0 (a default-constructed message) as no turn.
};

/// A unit quaternion with w >= 0. kInvalidInput for NaN, infinity, all zero, and a norm off 1 by more than 0.1.
core::Result<geometry::Quaterniond> to_rotation(const RosQuaternion& quaternion, const PoseRules& rules = {});
core::Result<geometry::Pose> to_pose(const RosPose& pose, const PoseRules& rules = {});
core::Result<geometry::Pose> to_pose(const RosTransform& transform, const PoseRules& rules = {});
/// Finite velocities; the frame is the sender's.
core::Result<geometry::Twist> to_twist(const RosTwist& twist);

/// Covariance of a pose in geometry's error coordinates (rotation in the body frame, then translation), from ROS's
/// (translation, then turns about the parent's axes). None when unknown (all zero, or -1 in the first place).
/// kInvalidInput for NaN and infinity; made symmetric, negative eigenvalues become 0.
core::Result<std::optional<geometry::Matrix6d>> to_covariance(const RosPoseWithCovariance& pose);

RosPose to_ros_pose(const geometry::Pose& X);
RosTransform to_ros_transform(const geometry::Pose& X);
RosTwist to_ros_twist(const geometry::Twist& V);
RosPoseWithCovariance to_ros_pose(const geometry::Pose& X, const geometry::Matrix6d& covariance);

/// One edge of the tree of frames: X_PC, the pose of `child` in `parent`, at a time.
struct FrameTransform {
  std::string parent;
  std::string child;
  std::int64_t stamp_ns = 0;
  geometry::Pose X_PC;
};
/// The transforms that are sound, and one status for each that is not (the others are not lost by it).
struct FrameTransforms {
  std::vector<FrameTransform> accepted;
  std::vector<core::Status> rejected;
};
/// kResourceExhausted above `max_transforms`; never fails otherwise.
core::Result<FrameTransforms> to_transforms(const RosTfMessage& message, std::size_t max_transforms = 4096,
                                            const PoseRules& rules = {});
RosTransformStamped to_ros_transform(const FrameTransform& transform);

// --- Images and cameras --------------------------------------------------------------------------------------------

struct ImageRules {
  std::uint32_t max_side = 16384;        ///< Pixels.
  std::uint32_t max_pixels = 1U << 24;   ///< 4096 x 4096; several images are held at once, and worked on.
  double metres_per_unit_16uc1 = 0.001;  ///< REP 118: millimetres.
  double metres_per_unit_32fc1 = 1.0;    ///< REP 118: metres.
  bool mono16_is_depth = false;          ///< Some drivers send depth as mono16.
};

/// What to_depth_image saw on the way.
struct DepthImageReport {
  std::int64_t measured = 0;          ///< Pixels with a depth.
  std::int64_t missing = 0;           ///< Pixels that were 0, NaN, infinite, negative or full scale; 0 in the image.
  double median_depth = 0.0;          ///< Of an even sample of the measured pixels, metres; 0 when there are none.
  std::vector<std::string> warnings;  ///< Sentences for a person: doubtful unit or byte order.
};

/// Depth in metres from encodings 16UC1 and 32FC1 (mono16 by rule), either byte order, padded rows, and a last row
/// without its padding. kInvalidInput when a field contradicts another (step, data, size), for a depth whose median
/// is above 100 m in 32FC1 (millimetres?), and for colour; kUnsupported for other encodings.
core::Result<geometry::DepthImage> to_depth_image(const RosImage& image, const ImageRules& rules = {},
                                                  DepthImageReport* report = nullptr);
/// Colour from rgb8, bgr8, rgba8, bgra8, 8UC3 (blue first), 8UC4, from Bayer patterns of 8 and 16 bits (bayer_rggb8,
/// ...), and from YUV (yuv422 or uyvy, yuv422_yuy2 or yuyv, nv12, nv21); grey from mono8, 8UC1 and mono16. Of 16 bits
/// the upper byte is used. kUnsupported with the encodings that would do for others, kInvalidInput as above, for YUV of
/// odd width (nv12 and nv21: or height), and for a Bayer pattern of fewer than 3 x 3 pixels.
core::Result<geometry::ColorImage> to_color_image(const RosImage& image, const ImageRules& rules = {});

/// Depth from what ROS's image_transport sends on <topic>/compressedDepth: a header of 12 bytes, then PNG of 16-bit
/// grey or RVL, of 16UC1 (mono16 by rule) or of 32FC1 as inverse depth; and from such a PNG alone, as on
/// <topic>/compressed. Which coding it is, the bytes say where they can, else `format`. kInvalidInput for JPEG, which
/// does not keep depth, and for a header that is none; kUnsupported for another encoding; errors of the decoders.
core::Result<geometry::DepthImage> to_depth_image(const RosCompressedImage& image, const ImageRules& rules = {},
                                                  DepthImageReport* report = nullptr);
/// Colour from JPEG or PNG, whatever `format` says. Errors of the decoders.
core::Result<geometry::ColorImage> to_color_image(const RosCompressedImage& image, const ImageRules& rules = {});

/// Depth from the z of an organised cloud (a point for each pixel, in rows) in the optical frame of the camera: x
/// right, y down, z forward. kInvalidInput for a cloud that is not organised, fields that contradict each other or the
/// data, points of another frame, and a median above 100 m; kUnsupported for coordinates that are not float32 or
/// float64.
core::Result<geometry::DepthImage> to_depth_image(const RosPointCloud2& cloud, const ImageRules& rules = {},
                                                  DepthImageReport* report = nullptr);

struct CameraRules {
  bool rectified = false;  ///< The images are rectified: use P instead of K.
  int image_width = 0;     ///< Of the images that go with it; 0 = not checked.
  int image_height = 0;
};
/// What to_camera and to_lens saw on the way.
struct CameraReport {
  std::vector<std::string> warnings;
};
/// The pinhole camera of the images as they arrive: K (or P), with binning and region of interest applied as ROS's
/// image_geometry does: c' = (c - offset) / binning. kInvalidInput when uncalibrated (K all zero), NaN, focal lengths
/// <= 0, or a size that does not fit the image.
core::Result<geometry::PinholeCamera> to_camera(const RosCameraInfo& info, const CameraRules& rules = {},
                                                CameraReport* report = nullptr);
/// The lens of the images as they arrive: none for rectified ones, and where all of D is zero (as in image_geometry,
/// whatever the model). plumb_bob and rational_polynomial are one model, with 4, 5 or 8 coefficients, or 12 or
/// 14, of which the first 8 count; equidistant and fisheye have 4. The report warns of an unknown model,
/// whose lens is none, and of coefficients that are left out. kInvalidInput where one is not finite.
core::Result<geometry::LensDistortion> to_lens(const RosCameraInfo& info, const CameraRules& rules = {},
                                               CameraReport* report = nullptr);

/// 16UC1 in millimetres, rounded; depths above 65.535 m and missing ones become 0.
RosImage to_ros_image_16uc1(const geometry::DepthImage& depth, const RosHeader& header);
/// 32FC1 in metres; missing depths become NaN.
RosImage to_ros_image_32fc1(const geometry::DepthImage& depth, const RosHeader& header);
/// rgb8.
RosImage to_ros_image(const geometry::ColorImage& color, const RosHeader& header);
/// The camera of raw images: R the identity, P = [K 0]. Without a lens plumb_bob of zeros. (An equidistant lens of
/// zeros cannot be expressed: to_lens() and ROS read it as none.)
RosCameraInfo to_ros_camera_info(const geometry::PinholeCamera& camera, const RosHeader& header,
                                 const geometry::LensDistortion& lens = {});

// --- Joints ---------------------------------------------------------------------------------------------------------

struct JointSample {
  std::string name;
  double position = 0.0;           ///< rad or m
  std::optional<double> velocity;  ///< rad/s or m/s
  std::optional<double> effort;    ///< N m or N
  friend bool operator==(const JointSample&, const JointSample&) = default;
};
/// By name, in the message's order; entries without position are left out. kInvalidInput for arrays of unequal length,
/// empty or repeated names, NaN or infinity.
core::Result<std::vector<JointSample>> to_joint_samples(const RosJointState& state);

}  // namespace prescene::interfaces
