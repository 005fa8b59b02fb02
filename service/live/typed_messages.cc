// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/typed_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "prescene/belief/json.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

using interfaces::RosAnswer;
using interfaces::RosAnswerState;
using interfaces::RosJointType;
using interfaces::RosObjectMotion;
using interfaces::RosObjectState;
using nlohmann::ordered_json;

constexpr const char* kKinds[] = {"where",     "predict",  "stability", "view",    "achieve",
                                  "relations", "timeline", "next_view", "explain", "why"};

template <class Enum>
constexpr std::uint8_t ros_number(Enum value) {
  return static_cast<std::uint8_t>(value);
}

std::uint8_t state_number(belief::TrackState state) {
  switch (state) {
    case belief::TrackState::kTracked:
      return ros_number(RosObjectState::kTracked);
    case belief::TrackState::kDoubtful:
      return ros_number(RosObjectState::kDoubtful);
    case belief::TrackState::kUnseen:
      return ros_number(RosObjectState::kUnseen);
    case belief::TrackState::kLost:
      return ros_number(RosObjectState::kLost);
  }
  return ros_number(RosObjectState::kUnknown);
}

std::uint8_t motion_number(belief::MotionMode motion) {
  switch (motion) {
    case belief::MotionMode::kResting:
      return ros_number(RosObjectMotion::kResting);
    case belief::MotionMode::kMoving:
      return ros_number(RosObjectMotion::kMoving);
    case belief::MotionMode::kHeld:
      return ros_number(RosObjectMotion::kHeld);
  }
  return ros_number(RosObjectMotion::kUnknown);
}

/// A learned file may name any time; a ROS stamp begins with 1970 and ends with 2038.
interfaces::RosTime time_of(core::TimeNs time_ns) {
  constexpr core::TimeNs kLast = (core::TimeNs{1} << 31) * 1'000'000'000 - 1;
  return interfaces::to_ros_time(std::clamp<core::TimeNs>(time_ns, 0, kLast));
}

interfaces::RosObjectBelief object_message(const ObjectSummary& object) {
  interfaces::RosObjectBelief message;
  message.name = object.name;
  message.model = object.model;
  message.state = state_number(object.state);
  message.motion = motion_number(object.motion);
  message.held_by = object.held_by.value_or("");
  message.confidence = object.confidence;
  message.existence = object.existence;
  message.visible_share = object.visible_share;
  message.pose = interfaces::to_ros_pose(object.X_WO, object.covariance);
  message.twist = interfaces::to_ros_twist(object.V_WO);
  for (const belief::ParameterEstimate& parameter : object.parameters)
    message.parameters.push_back(
        {parameter.name, parameter.mean, parameter.standard_deviation, parameter.low, parameter.high});
  message.lessons = static_cast<std::uint32_t>(std::max(0, object.lessons));
  message.learned = time_of(object.learned_ns);
  for (const belief::AlternativePose& other : object.alternatives)
    message.alternatives.push_back({interfaces::to_ros_pose(other.X_WO), other.probability});
  message.is_new = object.is_new;
  message.size = {object.size.x(), object.size.y(), object.size.z()};
  return message;
}

// Far more than questions have: what is longer would keep the bus's thread busy.
constexpr std::size_t kMostDetails = 64;
constexpr std::size_t kLongestWord = 4096;

core::Status check_text(const char* field, const std::string& text) {
  if (text.size() > kLongestWord)
    return core::resource_exhausted(std::string(field) + ": " + std::to_string(text.size()) + " bytes are more than " +
                                    std::to_string(kLongestWord) + ": give a shorter text");
  if (const auto at = core::not_utf8_at(text))
    return core::invalid_input(std::string(field) + ": byte " + std::to_string(*at) + " is not UTF-8: send UTF-8");
  return core::ok_status();
}

core::Status check_number(const char* field, double value) {
  if (std::isfinite(value)) return core::ok_status();
  return core::invalid_input(std::string(field) + ": the number is not finite: give one, or 0 to leave it out");
}

/// A key that a field of the message gives, which the arguments must not give as well.
core::Status add_key(const char* key, ordered_json value, ordered_json& to) {
  if (to.contains(key))
    return core::invalid_input(std::string("arguments: '") + key +
                               "' is given by a field of the message, too: give it once");
  to[key] = std::move(value);
  return core::ok_status();
}

core::Result<ordered_json> arguments_of(const std::string& text) {
  if (text.empty()) return ordered_json::object();
  if (text.size() > kLongestArguments)
    return core::resource_exhausted("arguments: " + std::to_string(text.size()) + " bytes are more than " +
                                    std::to_string(kLongestArguments) +
                                    ": make them shorter, or ask as JSON on /prescene/query");
  auto read = belief::parse_json(text);
  if (!read) return read.status().at("arguments");
  if (!read->is_object())
    return core::invalid_input("arguments: this is not a JSON object: give one, such as {\"draws\": 256}");
  return *std::move(read);
}

const ordered_json* found_in(const ordered_json& in, const char* key) {
  if (!in.is_object()) return nullptr;
  const auto found = in.find(key);
  return found == in.end() ? nullptr : &*found;
}

std::string text_at(const ordered_json& in, const char* key) {
  const ordered_json* found = found_in(in, key);
  return found != nullptr && found->is_string() ? found->get<std::string>() : "";
}

double number_at(const ordered_json& in, const char* key, double otherwise = 0.0) {
  const ordered_json* found = found_in(in, key);
  return found != nullptr && found->is_number() ? found->get<double>() : otherwise;
}

std::uint64_t count_at(const ordered_json& in, const char* key) {
  const ordered_json* found = found_in(in, key);
  return found != nullptr && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

/// {"name" or `name_key`, "group", "probability", "interval": [low, high]}.
void add_estimate(const ordered_json& json, const char* name_key, RosAnswer& answer, const std::string& subject = "") {
  if (!json.is_object()) return;
  interfaces::RosEstimate& estimate = answer.estimates.emplace_back();
  estimate.name = text_at(json, name_key);
  estimate.group = text_at(json, "group");
  estimate.subject = subject.empty() ? text_at(json, "subject") : subject;
  estimate.other = text_at(json, "other");
  estimate.probability = number_at(json, "probability");
  const ordered_json* interval = found_in(json, "interval");
  if (interval == nullptr || !interval->is_array() || interval->size() != 2) return;
  if ((*interval)[0].is_number()) estimate.low = (*interval)[0].get<double>();
  if ((*interval)[1].is_number()) estimate.high = (*interval)[1].get<double>();
}

/// An answer to `where` lists what /prescene/belief has of each object, in another arrangement.
void add_objects(const ordered_json& items, RosAnswer& answer) {
  ordered_json objects = ordered_json::array();
  for (const ordered_json& item : items) {
    if (!item.is_object() || !item.contains("estimate")) return;
    ordered_json object = item;
    const ordered_json& estimate = item.at("estimate");
    object["name"] = text_at(item, "object");
    for (const auto& [to, from] : {std::pair("pose", "mean"), std::pair("twist", "twist"),
                                   std::pair("motion", "motion"), std::pair("confidence", "confidence")})
      if (const ordered_json* value = found_in(estimate, from)) object[to] = *value;
    ordered_json covariance = ordered_json::array();
    if (const ordered_json* rows = found_in(estimate, "covariance"))
      for (const ordered_json& row : *rows)
        for (const ordered_json& value : row) covariance.push_back(value);
    object["covariance"] = std::move(covariance);
    objects.push_back(std::move(object));
  }
  const auto summary =
      belief_summary_of_document(ordered_json{{"step", 0}, {"stamp_ns", 0}, {"objects", std::move(objects)}});
  if (!summary) return;
  for (const ObjectSummary& object : summary->objects) answer.objects.push_back(object_message(object));
}

void add_task(const std::string& kind, const ordered_json& task, RosAnswer& answer) {
  answer.instances = count_at(task, "instances");
  if (const ordered_json* converged = found_in(task, "converged"))
    answer.converged = converged->is_boolean() && converged->get<bool>();
  if (const ordered_json* remarks = found_in(task, "remarks"); remarks != nullptr && remarks->is_array())
    for (const ordered_json& remark : *remarks)
      if (remark.is_string()) answer.remarks.push_back(remark.get<std::string>());
  const auto list = [&](const char* key) {
    static const ordered_json kEmpty = ordered_json::array();
    const ordered_json* found = found_in(task, key);
    return found != nullptr && found->is_array() ? found : &kEmpty;
  };
  if (kind == "where") add_objects(*list("items"), answer);
  if (kind == "predict")
    for (const ordered_json& outcome : *list("outcomes")) add_estimate(outcome, "name", answer);
  if (kind == "relations")
    for (const ordered_json& relation : *list("relations")) add_estimate(relation, "relation", answer);
  if (kind != "stability") return;
  if (const ordered_json* stable = found_in(task, "stable"))
    add_estimate(*stable, "name", answer, text_at(task, "object"));
}

}  // namespace

interfaces::RosBelief belief_message(const BeliefSummary& summary, const std::string& world_frame) {
  interfaces::RosBelief message;
  message.header = {time_of(summary.stamp_ns), world_frame};
  message.step = summary.step;
  for (const ObjectSummary& object : summary.objects) message.objects.push_back(object_message(object));
  for (const belief::JointEstimate& joint : summary.joints) {
    const RosJointType type = joint.type == belief::JointType::kSlider ? RosJointType::kSlider : RosJointType::kHinge;
    message.joints.push_back({joint.joint, ros_number(type), joint.position, joint.standard_deviation, joint.velocity,
                              joint.low, joint.high, joint.confidence});
  }
  return message;
}

interfaces::RosEvent event_message(const BeliefEvent& event, const std::string& world_frame) {
  return {{time_of(event.stamp_ns), world_frame},
          event.step,
          event.event,
          event.object,
          event.support,
          event.camera.value_or(""),
          event.from.value_or(""),
          event.to.value_or(""),
          event.reason};
}

core::Result<std::string> question_json(const interfaces::RosQuery& query) {
  PRESCENE_RETURN_IF_ERROR(check_text("id", query.id));
  PRESCENE_RETURN_IF_ERROR(check_text("kind", query.kind));
  PRESCENE_RETURN_IF_ERROR(check_text("object", query.object));
  if (query.detail.size() > kMostDetails)
    return core::resource_exhausted("detail: " + std::to_string(query.detail.size()) + " texts are more than " +
                                    std::to_string(kMostDetails) + ": name each once");
  for (const std::string& detail : query.detail) PRESCENE_RETURN_IF_ERROR(check_text("detail", detail));
  PRESCENE_RETURN_IF_ERROR(check_number("duration", query.duration));
  PRESCENE_RETURN_IF_ERROR(check_number("max_seconds", query.max_seconds));
  if (query.kind.empty() || query.kind == "id" || query.kind == "stream" || query.kind == "cancel")
    return core::invalid_input("kind: '" + query.kind + "' is not a kind of question: give one, such as 'where'");
  PRESCENE_TRY(ordered_json task, arguments_of(query.arguments));
  if (!query.object.empty()) PRESCENE_RETURN_IF_ERROR(add_key("object", query.object, task));
  if (query.duration != 0.0) PRESCENE_RETURN_IF_ERROR(add_key("duration", query.duration, task));
  if (!query.detail.empty()) PRESCENE_RETURN_IF_ERROR(add_key("detail", query.detail, task));
  if (query.max_seconds != 0.0) {
    if (!task.contains("effort")) task["effort"] = ordered_json::object();
    if (!task["effort"].is_object())
      return core::invalid_input("arguments: effort: this is not a JSON object: give one, or leave it out");
    PRESCENE_RETURN_IF_ERROR(add_key("max_seconds", query.max_seconds, task["effort"]));
  }
  ordered_json question = ordered_json::object();
  if (!query.id.empty()) question["id"] = query.id;
  if (query.stream) question["stream"] = true;
  question[query.kind] = std::move(task);
  return belief::json_text(question);
}

core::Result<std::string> cancel_json(const interfaces::RosCancel& cancel) {
  PRESCENE_RETURN_IF_ERROR(check_text("question", cancel.question));
  PRESCENE_RETURN_IF_ERROR(check_text("id", cancel.id));
  if (cancel.question.empty()) return core::invalid_input("question: give the id of the question to cancel");
  ordered_json request = ordered_json::object();
  request["cancel"] = cancel.question;
  if (!cancel.id.empty()) request["id"] = cancel.id;
  return belief::json_text(request);
}

interfaces::RosAnswer answer_message(const std::string& json) {
  RosAnswer answer;
  answer.json = json;
  const ordered_json document = parse_or_discard(json);
  if (!document.is_object()) return answer;
  answer.id = id_of_document(document);
  answer.step = count_at(document, "step");
  if (const core::Status error = belief::error_from_json(document); !error.ok()) {
    answer.state = ros_number(RosAnswerState::kRefused);
    answer.error = error.message();
    answer.code = text_at(document, "code");
    return answer;
  }
  if (document.contains("cancelled")) {
    answer.state = ros_number(RosAnswerState::kCancelled);
    return answer;
  }
  answer.state = ros_number(is_so_far(document) ? RosAnswerState::kSoFar : RosAnswerState::kAnswered);
  for (const char* kind : kKinds) {
    const ordered_json* task = found_in(document, kind);
    if (task == nullptr) continue;
    answer.kind = kind;
    add_task(answer.kind, *task, answer);
    return answer;
  }
  answer.state = ros_number(RosAnswerState::kUnknown);
  return answer;
}

interfaces::RosProgress progress_message(const std::string& json) {
  const ordered_json document = parse_or_discard(json);
  return {id_of_document(document), number_at(document, "fraction"), text_at(document, "text"),
          number_at(document, "seconds_left", -1.0)};
}

}  // namespace prescene::service
