// SPDX-License-Identifier: Apache-2.0
// The topics that Prescene listens to and speaks on, live and in recordings.
#pragma once

#include <string>

#include "prescene/core/status.h"

namespace prescene::service {

/// Names of what comes in; the defaults are those of common RGB-D drivers.
struct InputTopics {
  std::string depth = "/camera/aligned_depth_to_color/image_raw";  ///< sensor_msgs/Image, registered to colour
  std::string color = "/camera/color/image_raw";                   ///< sensor_msgs/Image; empty = none
  std::string camera_info = "/camera/color/camera_info";           ///< sensor_msgs/CameraInfo
  std::string tf = "/tf";                                          ///< tf2_msgs/TFMessage
  std::string tf_static = "/tf_static";                            ///< tf2_msgs/TFMessage, latched
  friend bool operator==(const InputTopics&, const InputTopics&) = default;
};

/// kInvalidInput where a topic but colour is empty, or two are one.
core::Status validate(const InputTopics& topics);

// Our own topics. JSON is carried by std_msgs/String, so that `ros2 topic pub` and `echo` can speak it.
inline constexpr const char* kControlTopic = "/prescene/control";  ///< in: {"actions": [...]}, what the robot does
inline constexpr const char* kQueryTopic = "/prescene/query";      ///< in: docs/queries.md
inline constexpr const char* kAnswerTopic = "/prescene/answer";    ///< out
inline constexpr const char* kBeliefTopic = "/prescene/belief";    ///< out: states and estimates as JSON
inline constexpr const char* kDetectionsTopic = "/prescene/detections";  ///< out: vision_msgs/Detection3DArray
inline constexpr const char* kMarkersTopic = "/prescene/markers";        ///< out: visualization_msgs/MarkerArray
inline constexpr const char* kDiagnosticsTopic = "/diagnostics";         ///< out: diagnostic_msgs/DiagnosticArray
/// out: geometry_msgs/PoseWithCovarianceStamped of each object
std::string pose_topic(const std::string& object);

// In recordings only, as JSON.
inline constexpr const char* kTruthTopic = "/prescene/truth";      ///< Simulated truth of each frame.
inline constexpr const char* kOutcomeTopic = "/prescene/outcome";  ///< What the simulation came to.
inline constexpr const char* kStepTopic = "/prescene/step";        ///< One step record a belief step.

}  // namespace prescene::service
