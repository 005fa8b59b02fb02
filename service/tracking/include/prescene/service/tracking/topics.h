// SPDX-License-Identifier: Apache-2.0
// The topics that Prescene listens to and speaks on, live and in recordings.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// Names of what comes in; the defaults are those of old RealSense drivers (camera_presets.h has today's).
struct InputTopics {
  std::string depth = "/camera/aligned_depth_to_color/image_raw";  ///< Registered to colour; of depth_type().
  std::string color = "/camera/color/image_raw";                   ///< Of color_type(); empty = none.
  std::string camera_info = "/camera/color/camera_info";           ///< sensor_msgs/CameraInfo
  std::string tf = "/tf";                                          ///< tf2_msgs/TFMessage
  std::string tf_static = "/tf_static";                            ///< tf2_msgs/TFMessage, latched
  std::string joint_states = "/joint_states";                      ///< sensor_msgs/JointState; empty = none.
  /// What the depth topic carries: "image", "compressed", "points", or "" = as its name says.
  std::string depth_form;
  std::string color_form;  ///< The same of the colour topic: "image", "compressed" or "".
  std::string clock;  ///< rosgraph_msgs/Clock, where time is simulated; "" = it is not (kClockTopic is ROS's name).
  friend bool operator==(const InputTopics&, const InputTopics&) = default;
};

/// As ROS's nodes name it, whose parameter use_sim_time is true.
inline constexpr const char* kClockTopic = "/clock";

/// The message types of the images: sensor_msgs/msg/Image; CompressedImage where the form says so, or without one the
/// name's last part is "compressed" or "compressedDepth", as image_transport names them; for depth also PointCloud2,
/// without a form where the last part begins with "points" or "cloud".
std::string depth_type(const InputTopics& topics);
std::string color_type(const InputTopics& topics);

/// Whether messages of this type hold images, or points that can be one.
bool is_image_type(const std::string& type);

/// By its name, whether a topic carries rectified images: those of ROS's image_proc and of drivers are called
/// image_rect, image_rect_color, image_rect_raw and the like, also if they are compressed.
bool names_rectified_images(const std::string& topic);

/// kInvalidInput where a topic but colour, joint states and clock is empty, two are one, or a form is none of the
/// above.
core::Status validate(const InputTopics& topics);

// Our own topics. JSON is carried by std_msgs/String, so that `ros2 topic pub` and `echo` can speak it.
inline constexpr const char* kControlTopic = "/prescene/control";    ///< in: {"actions": [...]}, what the robot does
inline constexpr const char* kQueryTopic = "/prescene/query";        ///< in: docs/reference/queries.md
inline constexpr const char* kAnswerTopic = "/prescene/answer";      ///< out
inline constexpr const char* kProgressTopic = "/prescene/progress";  ///< out: how far the work on a question is
inline constexpr const char* kBeliefTopic = "/prescene/belief";      ///< out: states and estimates as JSON
inline constexpr const char* kDetectionsTopic = "/prescene/detections";  ///< out: vision_msgs/Detection3DArray
inline constexpr const char* kPosesTopic = "/prescene/poses";            ///< out: geometry_msgs/PoseArray
inline constexpr const char* kMarkersTopic = "/prescene/markers";        ///< out: visualization_msgs/MarkerArray
inline constexpr const char* kEventsTopic = "/prescene/events";          ///< out: changes of state as JSON
inline constexpr const char* kOverlayTopic = "/prescene/overlay/image";  ///< out: sensor_msgs/Image
inline constexpr const char* kOverlayCompressedTopic = "/prescene/overlay/image/compressed";  ///< out: the same as JPEG
inline constexpr const char* kOverlayInfoTopic = "/prescene/overlay/camera_info";  ///< out: sensor_msgs/CameraInfo
inline constexpr const char* kCollisionTopic = "/collision_object";  ///< out: moveit_msgs/CollisionObject, for MoveIt
// The same as messages of prescene_msgs, for who reads no JSON.
inline constexpr const char* kTypedQueryTopic = "/prescene/typed/query";        ///< in: prescene_msgs/Query
inline constexpr const char* kTypedCancelTopic = "/prescene/typed/cancel";      ///< in: prescene_msgs/Cancel
inline constexpr const char* kTypedAnswerTopic = "/prescene/typed/answer";      ///< out: prescene_msgs/Answer
inline constexpr const char* kTypedProgressTopic = "/prescene/typed/progress";  ///< out: prescene_msgs/Progress
inline constexpr const char* kTypedBeliefTopic = "/prescene/typed/belief";      ///< out: prescene_msgs/Belief
inline constexpr const char* kTypedEventsTopic = "/prescene/typed/events";      ///< out: prescene_msgs/Event
inline constexpr const char* kDiagnosticsTopic = "/diagnostics";  ///< out: diagnostic_msgs/DiagnosticArray
/// Whether a message holds transforms of objects alone, which a service published: none of the robot's.
bool are_of_objects(const interfaces::ReceivedMessage& message);
/// out: geometry_msgs/PoseWithCovarianceStamped of each object
std::string pose_topic(const std::string& object);

// In recordings only, as JSON.
/// What was set while the service ran (running_settings_text()), where it came between the robot's messages.
inline constexpr const char* kSettingsTopic = "/prescene/settings";
inline constexpr const char* kTruthTopic = "/prescene/truth";        ///< Simulated truth of each frame.
inline constexpr const char* kOutcomeTopic = "/prescene/outcome";    ///< What the simulation came to.
inline constexpr const char* kHappenedTopic = "/prescene/happened";  ///< What truly happened in it, and when.
inline constexpr const char* kStepTopic = "/prescene/step";          ///< One step record a belief step.

/// A topic as it is on the bus.
struct BusTopic {
  std::string name;
  std::string type;
  interfaces::TopicQos read{};   ///< How whoever may lose nothing of it listens.
  interfaces::TopicQos write{};  ///< How it is offered, by a robot or by who plays a recording in its place.
};
/// What a session is made of: what the robot sends (colour only where it is named), the questions and the answers. The
/// service, `record` and `replay --over-dds` all take it from here, so that one keeps what another does.
std::vector<BusTopic> bus_topics(const InputTopics& topics);
/// How a recorded topic is offered: as its row of bus_topics() says, one of another name by its type.
interfaces::TopicQos offered_as(const std::string& topic, const std::string& type);

/// Whether the JSON on this topic is parsed when a recording is read: steps, truth and outcomes are.
bool is_parsed_in_recordings(const std::string& topic);
/// Such a document is written, read and parsed up to this size: it takes some twenty times its text, and packs so well
/// that a small file could hold a huge one.
inline constexpr std::size_t kMostParsedJsonBytes = std::size_t{8} << 20;
/// Bytes of the largest JSON document that is written on this topic; others are as large as on the bus.
std::size_t most_json_bytes(const std::string& topic);

}  // namespace prescene::service
