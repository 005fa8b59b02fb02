// SPDX-License-Identifier: Apache-2.0
// One message type from its bytes through every check to geometry, as a frame from the bus or a recording goes.
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

namespace prescene::tests {

inline void check_pose(const prescene::core::Result<prescene::geometry::Pose>& pose) {
  if (pose) PRESCENE_CHECK(pose->is_finite() && std::abs(pose->rotation.norm() - 1.0) < 1e-9);
}

/// Types that are only passed on.
template <class Message>
void convert(const Message& /*message*/) {}

inline void convert(const RosImage& image) {
  DepthImageReport report;
  const ImageRules rules{.max_side = 4096, .mono16_is_depth = true};
  if (const auto depth = to_depth_image(image, rules, &report)) {
    PRESCENE_CHECK(report.measured + report.missing == static_cast<std::int64_t>(depth->size()));
    PRESCENE_CHECK(depth->size() <= image.data.size());
    for (std::size_t i = 0; i < depth->size(); ++i) {
      PRESCENE_CHECK(std::isfinite(depth->data()[i]) && depth->data()[i] >= 0.0F);
    }
  }
  if (const auto color = to_color_image(image, rules)) PRESCENE_CHECK(color->size() <= image.data.size());
}

/// Depth that is finite and as large as said.
template <class Message>
void check_depth(const Message& message, const ImageRules& rules) {
  DepthImageReport report;
  const auto depth = to_depth_image(message, rules, &report);
  if (!depth) {
    PRESCENE_CHECK(!depth.status().message().empty());
    return;
  }
  PRESCENE_CHECK(report.measured + report.missing == static_cast<std::int64_t>(depth->size()));
  PRESCENE_CHECK(depth->size() <= rules.max_pixels);
  for (std::size_t i = 0; i < depth->size(); ++i)
    PRESCENE_CHECK(std::isfinite(depth->data()[i]) && depth->data()[i] >= 0.0F);
}

inline void convert(const RosCompressedImage& image) {
  const ImageRules rules{.max_side = 1024, .max_pixels = 1U << 18, .mono16_is_depth = true};
  check_depth(image, rules);
  if (const auto color = to_color_image(image, rules)) PRESCENE_CHECK(color->size() <= rules.max_pixels);
}

inline void convert(const RosPointCloud2& cloud) { check_depth(cloud, {.max_side = 1024, .max_pixels = 1U << 18}); }

inline void convert(const RosCameraInfo& info) {
  for (const bool rectified : {false, true}) {
    if (const auto camera = to_camera(info, {.rectified = rectified}))
      PRESCENE_CHECK(prescene::geometry::validate(*camera).ok());
    const auto lens = to_lens(info, {.rectified = rectified});
    if (!lens) continue;
    for (const double x : {0.0, 0.3, -1.5}) {
      for (const auto& p : {lens->distort({x, 0.4}), lens->undistort({x, 0.4})}) PRESCENE_CHECK(!p || p->allFinite());
    }
  }
}

inline void convert(const RosTfMessage& message) {
  const auto transforms = to_transforms(message);
  if (!transforms) return;
  PRESCENE_CHECK(transforms->accepted.size() + transforms->rejected.size() == message.transforms.size());
  for (const auto& transform : transforms->accepted) check_pose(transform.X_PC);
}

inline void convert(const RosJointState& state) {
  if (const auto samples = to_joint_samples(state)) PRESCENE_CHECK(samples->size() <= state.name.size());
}

inline void convert(const RosPoseStamped& message) {
  check_pose(to_pose(message.pose));
  if (const auto stamp = to_stamp_ns(message.header.stamp)) PRESCENE_CHECK(to_ros_time(*stamp) == message.header.stamp);
}

inline void convert(const RosPoseWithCovarianceStamped& message) {
  check_pose(to_pose(message.pose.pose));
  const auto covariance = to_covariance(message.pose);
  if (covariance && *covariance) PRESCENE_CHECK((*covariance)->allFinite());
}

inline void convert(const RosPoseArray& message) {
  for (const RosPose& pose : message.poses) check_pose(to_pose(pose));
}

inline void convert(const RosTwistStamped& message) {
  if (const auto twist = to_twist(message.twist)) PRESCENE_CHECK(twist->is_finite());
}

}  // namespace prescene::tests

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto message = decode_cdr<PRESCENE_MESSAGE>({data, size}, {.max_string_bytes = 1 << 16});
  if (!message) {
    PRESCENE_CHECK(!message.status().message().empty());
    return 0;
  }
  const auto bytes = encode_cdr(*message);
  const auto again = decode_cdr<PRESCENE_MESSAGE>(bytes);
  PRESCENE_CHECK(again.ok() && encode_cdr(*again) == bytes);
  prescene::tests::convert(*message);
  return 0;
}
