// SPDX-License-Identifier: Apache-2.0
// Between what the service says and hears as JSON and its messages for ROS (packaging/prescene_msgs/msg).
#pragma once

#include <cstddef>
#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/live/belief_events.h"

namespace prescene::service {

interfaces::RosBelief belief_message(const BeliefSummary& summary, const std::string& world_frame);
interfaces::RosEvent event_message(const BeliefEvent& event, const std::string& world_frame);

/// Bytes of RosQuery::arguments at most: they are read where others' messages wait. Longer questions go as JSON.
inline constexpr std::size_t kLongestArguments = std::size_t{1} << 16;

/// The question as /prescene/query takes it. kInvalidInput, with the field and the remedy, where a text is not UTF-8,
/// the kind is no name of a question, the arguments are no JSON object or have a key that is given by a field, too, and
/// where a number is not finite; kResourceExhausted for texts and lists that are too long. Whether there is such a kind
/// of question, and whether it has such keys, is for who reads the JSON to say.
core::Result<std::string> question_json(const interfaces::RosQuery& query);
/// {"cancel": question, "id": id}, errors as above.
core::Result<std::string> cancel_json(const interfaces::RosCancel& cancel);

/// Of an answer as it is on /prescene/answer. What is not of the form known here is left out but for `json`, which has
/// all.
interfaces::RosAnswer answer_message(const std::string& json);
/// Of /prescene/progress.
interfaces::RosProgress progress_message(const std::string& json);

}  // namespace prescene::service
