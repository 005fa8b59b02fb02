// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/belief_events.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::service {
namespace {

using belief::MotionMode;
using belief::TrackState;

// Of what lies at the edge of moving, particles vote now for the one and now for the other; a change that lasts for so
// many steps (0.1 s at 30 Hz) is one. With 1, a jar that is being filled is said to start ten times a second.
constexpr int kSteadySteps = 3;

std::string event_of(TrackState before, TrackState now) {
  switch (now) {
    case TrackState::kTracked:
      return before == TrackState::kLost ? "found" : "tracked";
    case TrackState::kDoubtful:
      return before == TrackState::kLost ? "found" : "doubtful";
    case TrackState::kUnseen:
      return "hidden";
    case TrackState::kLost:
      return "lost";
  }
  return "";
}

std::string reason_of(const ObjectSummary& object) {
  if (object.state != TrackState::kLost) return "";
  if (object.frames_refuted > 0)
    return "the evidence spoke against its pose in " + std::to_string(object.frames_refuted) + " frames";
  if (object.frames_unseen > 0) return "it was unseen for " + std::to_string(object.frames_unseen) + " frames";
  return "";
}

}  // namespace

nlohmann::ordered_json to_json(const BeliefEvent& event) {
  nlohmann::ordered_json json{{"stamp_ns", event.stamp_ns}, {"step", event.step}, {"event", event.event}};
  if (!event.object.empty()) json["object"] = event.object;
  if (!event.support.empty()) json["support"] = event.support;
  if (event.camera) json["camera"] = *event.camera;
  json["from"] = event.from ? nlohmann::ordered_json(*event.from) : nlohmann::ordered_json();
  json["to"] = event.to ? nlohmann::ordered_json(*event.to) : nlohmann::ordered_json();
  json["reason"] = event.reason.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(event.reason);
  return json;
}

std::vector<BeliefEvent> BeliefEvents::note(const BeliefSummary& summary, const belief::Scene& scene,
                                            const StepNews& news) {
  std::vector<BeliefEvent> events;
  const auto add = [&](std::string event) -> BeliefEvent& {
    return events.emplace_back(BeliefEvent{summary.stamp_ns, summary.step, std::move(event)});
  };
  if (news.clock_went_back) add("clock_set_back").reason = "the belief began anew";
  if (news.restarted) add("restarted").reason = "a control asked for it";
  if (news.clock_went_back || news.restarted || summary.step < step_) {
    objects_.clear();
    supports_.clear();
  }
  const bool is_first = objects_.empty() && summary.step <= 1;
  step_ = summary.step;

  std::set<std::string> present;
  std::vector<std::size_t> released;
  for (const ObjectSummary& object : summary.objects) {
    present.insert(object.name);
    const auto known = objects_.find(object.name);
    if (known == objects_.end()) {
      const bool taken_over = object.is_new && !is_first;
      BeliefEvent& event = add(taken_over                             ? "new"
                               : object.state == TrackState::kTracked ? "found"
                                                                      : event_of(TrackState::kTracked, object.state));
      event.object = object.name;
      event.to = belief::to_string(object.state);
      event.reason = taken_over ? "nothing that the scene names explains it" : reason_of(object);
      objects_[object.name] = {object.state, std::nullopt, object.motion, object.motion, 0};
    } else if (known->second.state != object.state) {
      BeliefEvent& event = add(event_of(known->second.state, object.state));
      event.object = object.name;
      event.from = belief::to_string(known->second.state);
      event.to = belief::to_string(object.state);
      event.reason = reason_of(object);
      known->second.state = object.state;
    }
    Known& now = objects_[object.name];
    if (now.held_by != object.held_by) {
      BeliefEvent& event = add(object.held_by ? "held" : "released");
      event.object = object.name;
      event.from = std::exchange(now.held_by, object.held_by);
      event.to = object.held_by;
      if (!object.held_by) released.push_back(events.size() - 1);
    }
    // What is held moves with its hand, and of what is lost nobody knows.
    if (object.motion == MotionMode::kHeld || object.state == TrackState::kLost) {
      now.motion = now.other_motion = object.motion;
      now.other_steps = 0;
      continue;
    }
    now.other_steps = object.motion == now.motion ? 0 : object.motion == now.other_motion ? now.other_steps + 1 : 1;
    now.other_motion = object.motion;
    if (now.other_steps < kSteadySteps) continue;
    BeliefEvent& event = add(object.motion == MotionMode::kResting ? "at_rest" : "moving");
    event.object = object.name;
    event.from = belief::to_string(std::exchange(now.motion, object.motion));
    event.to = belief::to_string(object.motion);
    now.other_steps = 0;
  }
  // Both kinds in one step: which is which the step does not say.
  if (news.inferred_releases == 0 || std::ssize(released) == news.inferred_releases)
    for (const std::size_t i : released)
      events[i].reason = news.inferred_releases > 0 ? "it was seen to have left the hand" : "a control reported it";
  for (auto known = objects_.begin(); known != objects_.end();) {
    if (present.contains(known->first)) {
      ++known;
      continue;
    }
    BeliefEvent& event = add("forgotten");
    event.object = known->first;
    event.from = belief::to_string(known->second.state);
    known = objects_.erase(known);
  }

  for (const belief::Support& support : scene.supports) {
    if (!filter::is_found_support(support.name) || !supports_.insert(support.name).second) continue;
    BeliefEvent& event = add("support_found");
    event.support = support.name;
    event.to = "known";
  }
  std::set<std::string> silent;
  for (const SilentCamera& camera : news.silent) {
    silent.insert(camera.name);
    if (silent_.contains(camera.name)) continue;
    BeliefEvent& event = add("camera_silent");
    event.camera = camera.name;
    event.from = "used";
    event.to = "silent";
    event.reason = camera.reason;
  }
  for (const std::string& name : silent_) {
    if (silent.contains(name)) continue;
    BeliefEvent& event = add("camera_used");
    event.camera = name;
    event.from = "silent";
    event.to = "used";
  }
  silent_ = std::move(silent);
  return events;
}

std::optional<BeliefEvent> BeliefEvents::note_frames(bool come, core::TimeNs stamp_ns,
                                                     const std::function<std::string()>& why_not) {
  const std::optional<bool> before = frames_come_;
  if (before || come) frames_come_ = come;
  if (!before || *before == come) return std::nullopt;
  BeliefEvent event{stamp_ns, step_, come ? "frames_used" : "frames_silent"};
  event.from = come ? "silent" : "used";
  event.to = come ? "used" : "silent";
  if (!come) event.reason = why_not();
  return event;
}

}  // namespace prescene::service
