// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/happened.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "prescene/belief/event.h"
#include "prescene/belief/json.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/core/text.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using belief::Action;
using belief::EventKind;
using nlohmann::ordered_json;

constexpr double kStepsOff = 0.01;  // s: by how much a step or a sample may be off the time of an action

/// An object at one time.
struct PlaceInTime {
  double time = 0.0;
  geometry::Pose X_WO;
  bool is_held = false;
};
/// Where an object was while it was there, ascending in time.
std::vector<PlaceInTime> places_of(const std::string& object, std::span<const PlayedPart> parts) {
  std::vector<PlaceInTime> places;
  for (const PlayedPart& part : parts) {
    const auto index = belief::find_object(part.scene, object);
    if (!index) continue;
    for (const belief::WorldState& state : part.trajectory.states) {
      const belief::ObjectState& at = state.objects[static_cast<std::size_t>(*index)];
      places.push_back({state.time, at.X_WO, at.mode == belief::MotionMode::kHeld});
    }
  }
  return places;
}

bool is_elsewhere(const geometry::Pose& a, const geometry::Pose& b) {
  return (a.translation - b.translation).norm() > kMovedBy ||
         geometry::angle_between(a.rotation, b.rotation) > kTurnedBy;
}

ObjectCourse course_of(const std::string& object, const std::vector<PlaceInTime>& places,
                       std::span<const PlayedPart> parts) {
  ObjectCourse course{object, {}, {}, {}};
  if (places.empty()) return course;
  if (belief::find_object(parts.back().scene, object)) course.X_WO = places.back().X_WO;
  for (const PlaceInTime& place : places) {
    if (!course.moved_from && is_elsewhere(place.X_WO, places.front().X_WO)) course.moved_from = place.time;
    if (course.moved_from && is_elsewhere(place.X_WO, places.back().X_WO)) course.moved_until = place.time;
  }
  if (course.moved_from) course.moved_until = std::max(course.moved_until.value_or(0.0), *course.moved_from);
  return course;
}

/// Whether an action lets go of the object at about this time, or drives it, so that it is not held as before.
bool lets_go_at(const Action& action, const std::string& object, double time) {
  if (belief::object_of(action) != object || !belief::lets_go(action)) return false;
  const double end = action.time + (std::holds_alternative<belief::Release>(action.what) ? 0.0 : duration_of(action));
  const double begin = std::holds_alternative<belief::Insert>(action.what) ? action.time : end;
  return begin - kStepsOff <= time && time <= end + kStepsOff;
}

/// From when on the object is out of a hand that no action or change opened. Where it slides and is held again, it is
/// not.
std::optional<double> slipped_at(const belief::Scene& scene, std::span<const UnannouncedChange> changes,
                                 const std::string& object, const std::vector<PlaceInTime>& places) {
  std::optional<double> slipped;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double time = places[i].time;
    if (places[i].is_held) slipped.reset();
    if (!places[i - 1].is_held || places[i].is_held) continue;
    const bool meant = std::any_of(scene.actions.begin(), scene.actions.end(),
                                   [&](const Action& action) { return lets_go_at(action, object, time); }) ||
                       std::any_of(changes.begin(), changes.end(), [&](const UnannouncedChange& change) {
                         return change.object == object && std::abs(change.time - time) <= kStepsOff;
                       });
    if (!meant) slipped = time;
  }
  return slipped;
}

/// Which object the push that is the scene's action of that number touches first, and when. Pushers are numbered in the
/// order of the pushes that are not over when a part begins.
std::optional<HappenedEvent> touch_of(const belief::Scene& scene, std::size_t action,
                                      std::span<const PlayedPart> parts) {
  for (const PlayedPart& part : parts) {
    const double begin = part.trajectory.start().time;
    int pusher = static_cast<int>(part.scene.objects.size() + part.scene.supports.size() + part.scene.robot.size());
    for (std::size_t i = 0; i < action; ++i) {
      const auto* push = std::get_if<belief::Push>(&scene.actions[i].what);
      const bool goes_on = push != nullptr && scene.actions[i].time + push->duration > begin;
      pusher += goes_on ? 1 : 0;
    }
    const Action& own = scene.actions[action];
    if (own.time + std::get<belief::Push>(own.what).duration <= begin) continue;
    std::optional<HappenedEvent> first;
    for (const belief::ContactInterval& contact : part.trajectory.contacts) {
      if (contact.second != pusher || contact.first >= static_cast<int>(part.scene.objects.size())) continue;
      if (!first || contact.begin < first->time)
        first = HappenedEvent{contact.begin, "", part.scene.objects[static_cast<std::size_t>(contact.first)].name,
                              "push", false};
    }
    if (first) return first;
  }
  return std::nullopt;
}

void add_actions(const belief::Scene& scene, std::span<const PlayedPart> parts, bool reported,
                 std::vector<HappenedEvent>& events) {
  const double end = parts.back().trajectory.final().time;
  for (std::size_t i = 0; i < scene.actions.size(); ++i) {
    const Action& action = scene.actions[i];
    if (action.time > end) continue;
    HappenedEvent event{action.time, "", belief::object_of(action), belief::kind_of(action), reported};
    std::optional<EventKind> kind;
    if (std::holds_alternative<belief::Bump>(action.what)) kind = EventKind::kBumped;
    if (std::holds_alternative<belief::Release>(action.what)) kind = EventKind::kSlipped;
    if (std::holds_alternative<belief::Push>(action.what)) {
      if (const auto touch = touch_of(scene, i, parts)) {
        event.time = touch->time;
        event.object = touch->object;
        kind = EventKind::kPushed;
      }
    }
    if (kind && !reported) event.event = belief::name_of(*kind);
    events.push_back(std::move(event));
  }
}

/// Whether what happened to the object at this time is there already under this name.
bool is_told(const std::vector<HappenedEvent>& events, const std::string& object, double time,
             const std::string& name) {
  return std::any_of(events.begin(), events.end(), [&](const HappenedEvent& event) {
    return event.object == object && event.event == name && std::abs(event.time - time) <= kStepsOff;
  });
}

/// Changes of one frame are one event: a blow to what is moved, taken or put in then is part of that.
void add_changes(std::span<const UnannouncedChange> changes, const std::string& object,
                 const std::vector<PlaceInTime>& places, std::vector<HappenedEvent>& events) {
  std::vector<UnannouncedChange> own;
  for (const UnannouncedChange& change : changes)
    if (change.object == object) own.push_back(change);
  std::stable_sort(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  bool is_there = true, was_there = false;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const UnannouncedChange& change = own[i];
    std::optional<EventKind> kind;
    if (change.added_velocity) {
      const auto displaces = [&](const UnannouncedChange& other) {
        return !other.added_velocity && other.time == change.time && change.time > 0.0;
      };
      if (std::any_of(own.begin(), own.end(), displaces)) continue;
      const auto next = std::find_if(places.begin(), places.end(),
                                     [&](const PlaceInTime& place) { return place.time > change.time - kStepsOff; });
      const bool was_held = next != places.end() && next != places.begin() && std::prev(next)->is_held;
      if (is_there) kind = was_held ? EventKind::kSlipped : EventKind::kBumped;
    } else if (change.X_WO) {
      // What was taken away before is put down, which its taking away told.
      if (is_there) kind = EventKind::kMoved;
      if (!is_there && !was_there) kind = EventKind::kPutIn;
      is_there = true;
    } else if (is_there) {
      is_there = false;
      if (change.time > 0.0) {
        const bool is_put_down = std::any_of(own.begin() + static_cast<std::ptrdiff_t>(i) + 1, own.end(),
                                             [](const auto& later) { return !later.added_velocity && later.X_WO; });
        kind = is_put_down ? EventKind::kMoved : EventKind::kTakenAway;
        was_there = true;
      }
    }
    if (kind && !is_told(events, object, change.time, belief::name_of(*kind)))
      events.push_back({change.time, belief::name_of(*kind), object, "", false});
  }
}

}  // namespace

HappenedRecord happened_in(const belief::Scene& scene, std::span<const UnannouncedChange> changes,
                           std::span<const PlayedPart> parts, bool reported) {
  HappenedRecord record;
  add_actions(scene, parts, reported, record.events);
  for (const belief::SceneObject& object : scene.objects) {
    const std::vector<PlaceInTime> places = places_of(object.name, parts);
    record.objects.push_back(course_of(object.name, places, parts));
    if (const auto time = slipped_at(scene, changes, object.name, places))
      record.events.push_back({*time, belief::name_of(EventKind::kSlipped), object.name, "", false});
    add_changes(changes, object.name, places, record.events);
  }
  std::stable_sort(record.events.begin(), record.events.end(),
                   [](const HappenedEvent& a, const HappenedEvent& b) { return a.time < b.time; });
  const PlayedPart& last = parts.back();
  const std::vector<belief::JointState> joints = belief::joint_states(last.scene, last.trajectory.final());
  for (std::size_t i = 0; i < last.scene.joints.size(); ++i)
    record.joints.push_back({last.scene.joints[i].name, joints[i].position});
  return record;
}

ordered_json to_json(const HappenedRecord& record) {
  ordered_json events = ordered_json::array(), objects = ordered_json::array(), joints = ordered_json::array();
  for (const HappenedEvent& event : record.events) {
    ordered_json json = {{"time", event.time}};
    if (!event.event.empty()) json["event"] = event.event;
    if (!event.object.empty()) json["object"] = event.object;
    if (!event.action.empty()) json["action"] = event.action;
    json["reported"] = event.reported;
    events.push_back(std::move(json));
  }
  for (const ObjectCourse& course : record.objects) {
    ordered_json json = {{"name", course.name}};
    if (course.moved_from && course.moved_until) {
      json["moved_from"] = *course.moved_from;
      json["moved_until"] = *course.moved_until;
    }
    json["present"] = course.X_WO.has_value();
    if (course.X_WO) json["pose"] = belief::to_json(*course.X_WO);
    objects.push_back(std::move(json));
  }
  for (const JointEnd& joint : record.joints) joints.push_back({{"name", joint.name}, {"position", joint.position}});
  return {{"first_ns", record.first_ns},     {"stepper", record.stepper},   {"step", record.step},
          {"resolution", record.resolution}, {"events", std::move(events)}, {"objects", std::move(objects)},
          {"joints", std::move(joints)}};
}

core::Result<HappenedRecord> happened_from_json(const std::string& text) {
  const core::Status bad = core::data_loss("the record of what happened in the recording is damaged");
  const ordered_json json = parse_or_discard(text, kMostParsedJsonBytes);
  const auto has = [](const ordered_json& in, const char* key, bool (ordered_json::*kind)() const noexcept) {
    return in.is_object() && in.contains(key) && (in[key].*kind)();
  };
  const auto text_of = [&](const ordered_json& in, const char* key) {
    return has(in, key, &ordered_json::is_string) ? in[key].get<std::string>() : std::string();
  };
  const auto number_of = [&](const ordered_json& in, const char* key) {
    return has(in, key, &ordered_json::is_number) ? std::optional<double>(in[key].get<double>()) : std::nullopt;
  };
  if (!json.is_object() || !json.contains("first_ns") || !is_stamp(json["first_ns"]) ||
      !has(json, "events", &ordered_json::is_array) || !has(json, "objects", &ordered_json::is_array) ||
      !has(json, "joints", &ordered_json::is_array))
    return bad;
  HappenedRecord record;
  record.first_ns = json["first_ns"].get<core::TimeNs>();
  record.stepper = text_of(json, "stepper");
  record.step = number_of(json, "step").value_or(0.0);
  record.resolution = number_of(json, "resolution").value_or(0.0);
  for (const ordered_json& item : json["events"]) {
    const auto time = number_of(item, "time");
    if (!time || !has(item, "reported", &ordered_json::is_boolean)) return bad;
    record.events.push_back({*time, text_of(item, "event"), text_of(item, "object"), text_of(item, "action"),
                             item["reported"].get<bool>()});
  }
  for (const ordered_json& item : json["objects"]) {
    if (!has(item, "name", &ordered_json::is_string) || !has(item, "present", &ordered_json::is_boolean)) return bad;
    ObjectCourse course{text_of(item, "name"), number_of(item, "moved_from"), number_of(item, "moved_until"), {}};
    if (item["present"].get<bool>()) {
      if (!item.contains("pose")) return bad;
      PRESCENE_TRY(course.X_WO, belief::pose_from_json(item["pose"]));
    }
    record.objects.push_back(std::move(course));
  }
  for (const ordered_json& item : json["joints"]) {
    const auto position = number_of(item, "position");
    if (!has(item, "name", &ordered_json::is_string) || !position) return bad;
    record.joints.push_back({text_of(item, "name"), *position});
  }
  return record;
}

std::string happened_text(const HappenedRecord& record) {
  std::string text;
  for (const HappenedEvent& event : record.events) {
    text += "  " + core::fixed_text(event.time, 2) + " s: " + (event.object.empty() ? "" : event.object + " ") +
            (event.event.empty() ? event.action : event.event) + (event.reported ? "\n" : ", unreported\n");
  }
  return text.empty() ? text : "what truly happened\n" + text;
}

}  // namespace prescene::service
