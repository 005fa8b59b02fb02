// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/waiting_controls.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "prescene/belief/json.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/step_record.h"

namespace prescene::service {
namespace {

// More than a robot does between two frames; a sender in a loop must not fill the memory.
constexpr std::size_t kMaxControls = 1000;

// A stamp that is further ahead is by another clock than the frames', or the camera has stood still for so long.
constexpr core::TimeNs kFarthestAheadNs = 60'000'000'000;

// Seconds that an action may start after its control, and that a placement may take.
constexpr double kLongestAhead = 3600.0;

// The end of ROS's 32 bit seconds.
constexpr core::TimeNs kLatestStamp = (core::TimeNs{1} << 31) * 1'000'000'000;

core::TimeNs sent_in_time_of_frames(core::TimeNs sent_ns, core::TimeNs frame_ns) {
  return std::abs(sent_ns - frame_ns) <= kSameClockNs ? sent_ns : frame_ns;
}

/// The hand keeps the object until the end of the action, and lets go of it then.
bool ends_free(const belief::Action& action) {
  return std::holds_alternative<belief::Place>(action.what) || std::holds_alternative<belief::Insert>(action.what);
}

}  // namespace

core::Result<ParsedControl> parse_control(const std::string& text) {
  const auto json = parse_or_discard(text);
  ParsedControl control;
  if (json.is_object() && json.contains("restart")) {
    if (json["restart"] != true || json.contains("actions"))
      return core::invalid_input("restart: true is needed, and no 'actions' beside it");
    control.restarts = true;
    return control;
  }
  if (!json.is_object() || !json.contains("actions") || !json["actions"].is_array()) {
    return core::invalid_input(
        "a control is {\"stamp_ns\": n, \"actions\": [...]} or {\"restart\": true}, this one is neither");
  }
  if (json.contains("stamp_ns")) {
    if (!json["stamp_ns"].is_number_integer())
      return core::invalid_input("stamp_ns: not a whole number of nanoseconds");
    control.stamp_ns = json["stamp_ns"].get<core::TimeNs>();
    if (*control.stamp_ns < 0 || *control.stamp_ns > kLatestStamp)
      return core::invalid_input("stamp_ns: a time from 1970 to 2038 is needed, as in ROS headers");
  }
  for (const auto& value : json["actions"]) {
    PRESCENE_TRY(belief::Action action, belief::action_from_json(value));
    // An hour bounds what is plausible, and keeps the sum in range.
    if (!(std::abs(action.time) <= kLongestAhead))
      return core::invalid_input("time: actions start within an hour of their control");
    if (ends_free(action)) {
      const double takes = belief::duration_of(action);
      if (!(takes > 0.0 && takes <= kLongestAhead))
        return core::invalid_input(belief::kind_of(action) +
                                   ": duration: a time above 0 s and of at most an hour is needed");
    }
    control.actions.emplace_back(core::ns_of(action.time), std::move(action));
  }
  return control;
}

core::TimeNs placement_time(const belief::Action& action) {
  return ends_free(action) ? core::ns_of(belief::duration_of(action)) : 0;
}

IdleControls idle_controls(const belief::Scene& scene, const belief::Control& control) {
  std::set<std::string> held;
  for (const belief::SceneObject& object : scene.objects)
    if (object.held_by) held.insert(object.name);
  IdleControls idle;
  for (const belief::Action& action : control.actions) {
    const std::string object = belief::object_of(action);
    const bool is_force = std::holds_alternative<belief::Bump>(action.what) ||
                          std::holds_alternative<belief::Pull>(action.what) ||
                          std::holds_alternative<belief::MoveJoint>(action.what);
    if (object.empty() && !is_force) continue;  // a push needs none
    const auto* grasp = std::get_if<belief::Grasp>(&action.what);
    std::string why;
    if (is_force)
      why = "the tracker follows what is seen of it";
    else if (!belief::find_object(scene, object))
      why = "the scene has no such object";
    else if (grasp != nullptr && !belief::find_robot_body(scene, grasp->hand))
      why = "the scene has no robot body " + interfaces::quote(grasp->hand);
    else if (grasp == nullptr && !held.contains(object))
      why = "nothing holds it";
    if (!why.empty()) {
      ++idle.count;
      idle.last =
          "the action '" + belief::kind_of(action) + "' of " + interfaces::quote(object) + " changes nothing: " + why;
    } else if (grasp != nullptr) {
      held.insert(object);
    } else if (belief::lets_go(action)) {
      held.erase(object);
    }
  }
  return idle;
}

core::Status WaitingControls::take_in(const interfaces::ReceivedMessage& message,
                                      std::optional<core::TimeNs> newest_frame_ns) {
  PRESCENE_TRY(const auto text, interfaces::decode_cdr<interfaces::RosString>(message.cdr, interfaces::kSmallMessage));
  PRESCENE_TRY(ParsedControl control, parse_control(text.data));
  if (control.restarts) {
    waiting_.clear();
    restarts_ = true;
    return core::ok_status();
  }
  if (control.stamp_ns && newest_frame_ns && *control.stamp_ns - *newest_frame_ns > kFarthestAheadNs) {
    const auto seconds = [](core::TimeNs time_ns) { return core::fixed_text(core::seconds_of(time_ns), 3) + " s"; };
    return core::invalid_input("stamp_ns: " + seconds(*control.stamp_ns) + " is more than " +
                               seconds(kFarthestAheadNs) + " after the newest frame's stamp, " +
                               seconds(*newest_frame_ns) +
                               ": stamp controls by the clock of the frames, or leave stamp_ns out");
  }
  if (waiting_.size() + control.actions.size() > kMaxControls) {
    return core::resource_exhausted("more than " + std::to_string(kMaxControls) +
                                    " actions wait for a frame: send fewer");
  }
  const bool says_when = message.source_ns > 0 && message.source_ns < kLatestRecordedNs;
  const core::TimeNs sent_ns = says_when ? message.source_ns : message.received_ns;
  const core::TimeNs base_ns = control.stamp_ns
                                   ? *control.stamp_ns
                                   : (newest_frame_ns ? sent_in_time_of_frames(sent_ns, *newest_frame_ns) : sent_ns);
  waiting_.reserve(waiting_.size() + control.actions.size());
  for (auto& [after_ns, action] : control.actions) {
    const std::string object = belief::object_of(action);
    // What the robot says next of the object, a release or something else, is in the place of how a placement ends.
    std::erase_if(waiting_, [&](const Waiting& waiting) {
      return waiting.ends_place && belief::object_of(waiting.action) == object;
    });
    const bool is_place = ends_free(action);
    if (is_place) {
      after_ns += placement_time(action);
      action.what = belief::Release{object};
    }
    waiting_.push_back({base_ns + after_ns, after_ns, control.stamp_ns, sent_ns, std::move(action), is_place});
  }
  sort();
  return core::ok_status();
}

void WaitingControls::sort() {
  std::stable_sort(waiting_.begin(), waiting_.end(),
                   [](const Waiting& a, const Waiting& b) { return a.due_ns < b.due_ns; });
}

void WaitingControls::begin_at(core::TimeNs first_frame_ns) {
  dropped_ += std::erase_if(waiting_, [&](const Waiting& waiting) {
    return waiting.stamp_ns && *waiting.stamp_ns - first_frame_ns > kFarthestAheadNs;
  });
  for (Waiting& waiting : waiting_) {
    if (waiting.stamp_ns) continue;
    waiting.due_ns = sent_in_time_of_frames(waiting.sent_ns, first_frame_ns) + waiting.after_ns;
  }
  sort();
}

void WaitingControls::begin_again() {
  for (Waiting& waiting : waiting_)
    if (!waiting.stamp_ns) waiting.due_ns = waiting.sent_ns + waiting.after_ns;
  sort();
}

belief::Control WaitingControls::due(core::TimeNs begin_ns, core::TimeNs end_ns) const {
  belief::Control control{begin_ns, end_ns, {}};
  for (const Waiting& waiting : waiting_) {
    if (waiting.due_ns > end_ns) break;
    control.actions.push_back(waiting.action);
    control.actions.back().time = std::max(0.0, core::seconds_of(waiting.due_ns - begin_ns));
  }
  return control;
}

void WaitingControls::forget_due(core::TimeNs end_ns) {
  std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.due_ns <= end_ns; });
}

nlohmann::ordered_json WaitingControls::to_json() const {
  nlohmann::ordered_json waiting = nlohmann::ordered_json::array();
  for (const Waiting& action : waiting_) {
    nlohmann::ordered_json& row = waiting.emplace_back();
    row["due_ns"] = action.due_ns;
    row["after_ns"] = action.after_ns;
    if (action.stamp_ns) row["stamp_ns"] = *action.stamp_ns;
    row["sent_ns"] = action.sent_ns;
    row["action"] = belief::to_json(action.action);
    row["ends_place"] = action.ends_place;
  }
  return {{"waiting", std::move(waiting)}, {"dropped", dropped_}, {"restarts", restarts_}};
}

core::Result<WaitingControls> WaitingControls::from_json(const nlohmann::ordered_json& json) {
  WaitingControls controls;
  const auto bad = [](const std::string& key) { return core::invalid_input("controls: no good '" + key + "'"); };
  const auto time_at = [](const nlohmann::ordered_json& row, const char* key) -> std::optional<core::TimeNs> {
    const auto found = row.find(key);
    if (found == row.end() || !found->is_number_integer()) return std::nullopt;
    return found->get<core::TimeNs>();
  };
  if (!json.is_object() || !json.contains("waiting") || !json["waiting"].is_array()) return bad("waiting");
  if (!json.contains("dropped") || !json["dropped"].is_number_unsigned()) return bad("dropped");
  if (!json.contains("restarts") || !json["restarts"].is_boolean()) return bad("restarts");
  controls.dropped_ = json["dropped"].get<std::uint64_t>();
  controls.restarts_ = json["restarts"].get<bool>();
  if (json["waiting"].size() > kMaxControls) return bad("waiting");
  for (const nlohmann::ordered_json& row : json["waiting"]) {
    if (!row.is_object() || !row.contains("action")) return bad("action");
    if (!row.contains("ends_place") || !row["ends_place"].is_boolean()) return bad("ends_place");
    const auto due_ns = time_at(row, "due_ns"), after_ns = time_at(row, "after_ns"), sent_ns = time_at(row, "sent_ns");
    if (!due_ns || !after_ns || !sent_ns) return bad(!due_ns ? "due_ns" : !after_ns ? "after_ns" : "sent_ns");
    PRESCENE_TRY(belief::Action action, belief::action_from_json(row["action"]));
    controls.waiting_.push_back(
        {*due_ns, *after_ns, time_at(row, "stamp_ns"), *sent_ns, std::move(action), row["ends_place"].get<bool>()});
  }
  return controls;
}

std::vector<std::pair<core::TimeNs, belief::Action>> WaitingControls::all() const {
  std::vector<std::pair<core::TimeNs, belief::Action>> all;
  for (const Waiting& waiting : waiting_) all.emplace_back(waiting.due_ns, waiting.action);
  return all;
}

}  // namespace prescene::service
