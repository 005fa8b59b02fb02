// SPDX-License-Identifier: Apache-2.0
// Prescene's own messages as ROS 2 carries them (packaging/prescene_msgs/msg, which say what the fields mean), as plain
// structs with the fields of their .msg files in wire order, as in messages.h.
//
//   RosQuery question;
//   question.id = "1";
//   question.kind = "where";
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

/// prescene_msgs/AlternativePose.
struct RosAlternativePose {
  RosPose pose;
  double probability = 0.0;
  friend bool operator==(const RosAlternativePose&, const RosAlternativePose&) = default;
};

/// prescene_msgs/ParameterEstimate.
struct RosParameterEstimate {
  std::string name;
  double mean = 0.0;
  double standard_deviation = 0.0;
  double low = 0.0;
  double high = 0.0;
  friend bool operator==(const RosParameterEstimate&, const RosParameterEstimate&) = default;
};

/// Values of RosObjectBelief::state and motion. A reader takes another value as unknown.
enum class RosObjectState : std::uint8_t { kUnknown = 0, kTracked = 1, kDoubtful = 2, kUnseen = 3, kLost = 4 };
enum class RosObjectMotion : std::uint8_t { kUnknown = 0, kResting = 1, kMoving = 2, kHeld = 3 };

/// prescene_msgs/ObjectBelief.
struct RosObjectBelief {
  std::string name;
  std::string model;
  std::uint8_t state = 0;   ///< RosObjectState, or what a later version adds.
  std::uint8_t motion = 0;  ///< RosObjectMotion, or the same.
  std::string held_by;      ///< "" = nothing holds it.
  double confidence = 0.0;
  double existence = 0.0;
  double visible_share = 0.0;
  RosPoseWithCovariance pose;
  RosTwist twist;
  std::vector<RosParameterEstimate> parameters;
  std::uint32_t lessons = 0;
  RosTime learned;
  std::vector<RosAlternativePose> alternatives;
  bool is_new = false;
  RosVector3 size;
  friend bool operator==(const RosObjectBelief&, const RosObjectBelief&) = default;
};

/// Values of RosJointBelief::type.
enum class RosJointType : std::uint8_t { kUnknown = 0, kHinge = 1, kSlider = 2 };

/// prescene_msgs/JointBelief: rad or m.
struct RosJointBelief {
  std::string name;
  std::uint8_t type = 0;  ///< RosJointType, or what a later version adds.
  double position = 0.0;
  double standard_deviation = 0.0;
  double velocity = 0.0;
  double lower = 0.0;  ///< Infinite where there is no limit.
  double upper = 0.0;
  double confidence = 0.0;
  friend bool operator==(const RosJointBelief&, const RosJointBelief&) = default;
};

/// prescene_msgs/Belief.
struct RosBelief {
  RosHeader header;
  std::uint64_t step = 0;
  std::vector<RosObjectBelief> objects;
  std::vector<RosJointBelief> joints;
  friend bool operator==(const RosBelief&, const RosBelief&) = default;
};

/// prescene_msgs/Event: one change of the belief.
struct RosEvent {
  RosHeader header;
  std::uint64_t step = 0;
  std::string event;
  std::string object;
  std::string support;
  std::string camera;
  std::string previous;
  std::string current;
  std::string reason;
  friend bool operator==(const RosEvent&, const RosEvent&) = default;
};

/// prescene_msgs/Query: a question. Empty texts and lists and zeros leave their keys out.
struct RosQuery {
  std::string id;
  std::string kind;
  std::string object;
  double duration = 0.0;
  double max_seconds = 0.0;
  bool stream = false;
  std::vector<std::string> detail;
  std::string arguments;  ///< The other keys, as a JSON object.
  friend bool operator==(const RosQuery&, const RosQuery&) = default;
};

/// prescene_msgs/Cancel: ends the work on a question.
struct RosCancel {
  std::string question;
  std::string id;
  friend bool operator==(const RosCancel&, const RosCancel&) = default;
};

/// prescene_msgs/Estimate: a probability with its interval.
struct RosEstimate {
  std::string name;
  std::string group;
  std::string subject;
  std::string other;
  double probability = 0.0;
  double low = 0.0;
  double high = 0.0;
  friend bool operator==(const RosEstimate&, const RosEstimate&) = default;
};

/// Values of RosAnswer::state.
enum class RosAnswerState : std::uint8_t { kUnknown = 0, kAnswered = 1, kSoFar = 2, kRefused = 3, kCancelled = 4 };

/// prescene_msgs/Answer.
struct RosAnswer {
  std::string id;
  std::uint64_t step = 0;
  std::string kind;
  std::uint8_t state = 0;  ///< RosAnswerState, or what a later version adds.
  std::string error;
  std::string code;
  std::vector<RosEstimate> estimates;
  std::vector<RosObjectBelief> objects;
  std::uint64_t instances = 0;
  bool converged = false;
  std::vector<std::string> remarks;
  std::string json;
  friend bool operator==(const RosAnswer&, const RosAnswer&) = default;
};

/// prescene_msgs/Progress.
struct RosProgress {
  std::string id;
  double fraction = 0.0;
  std::string text;
  double seconds_left = 0.0;  ///< -1 = there is no estimate.
  friend bool operator==(const RosProgress&, const RosProgress&) = default;
};

}  // namespace prescene::interfaces
