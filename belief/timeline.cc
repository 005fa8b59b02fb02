// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/timeline.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "prescene/belief/body_names.h"
#include "prescene/core/check.h"

namespace prescene::belief {
namespace {

constexpr double kUprightCosine = 0.96592582628906829;  // 15 degrees

using StatePredicate = std::function<bool(const WorldState&)>;

// The intervals of a predicate that is known at the sampled states only: from the first state that has it to the first
// that has it no more (or the last state).
void add_sampled(const Trajectory& trajectory, Relation relation, const std::string& subject, const std::string& other,
                 const StatePredicate& holds, Timeline& timeline) {
  bool inside = false;
  double begin = 0.0;
  for (const WorldState& state : trajectory.states) {
    const bool now = holds(state);
    if (now && !inside) begin = state.time;
    if (!now && inside) timeline.push_back({relation, subject, other, begin, state.time});
    inside = now;
  }
  if (inside) timeline.push_back({relation, subject, other, begin, trajectory.final().time});
}

void add_contacts(const Scene& scene, const Trajectory& trajectory, Timeline& timeline) {
  for (const ContactInterval& contact : trajectory.contacts) {
    const std::string first = body_name(scene, contact.first), second = body_name(scene, contact.second);
    timeline.push_back({Relation::kContact, first, second, contact.begin, contact.end});
    if (supports(contact, contact.first, contact.second))
      timeline.push_back({Relation::kSupports, first, second, contact.begin, contact.end});
    if (supports(contact, contact.second, contact.first))
      timeline.push_back({Relation::kSupports, second, first, contact.begin, contact.end});
  }
}

bool touches_anything(const Trajectory& trajectory, int object, double time) {
  return std::any_of(trajectory.contacts.begin(), trajectory.contacts.end(), [&](const ContactInterval& contact) {
    return (contact.first == object || contact.second == object) && contact.begin <= time && time <= contact.end;
  });
}

struct NamedVolume {
  std::string name;
  Pose X_WV;
  Vector3d size;
};

// Volumes that hold for an object: hollows of supports, and the boxes that outcomes about this object name.
std::vector<NamedVolume> volumes_for(const Scene& scene, const std::string& object) {
  std::vector<NamedVolume> volumes;
  for (const Support& support : scene.supports)
    if (support.hollow) volumes.push_back({support.name, support.X_WS * support.hollow->X_OV, support.hollow->size});
  const auto add = [&](const Outcome& outcome) {
    if (outcome.object != object) return;
    for (const Condition& condition : all_conditions(outcome)) {
      const auto* inside = std::get_if<InsideVolume>(&condition.predicate);
      if (!inside) continue;
      const bool known = std::any_of(volumes.begin(), volumes.end(), [&](const NamedVolume& volume) {
        return volume.X_WV == inside->X_WV && volume.size == inside->size;
      });
      if (!known) volumes.push_back({outcome.name, inside->X_WV, inside->size});
    }
  };
  for (const Outcome& outcome : scene.outcomes) add(outcome);
  for (const ExclusiveOutcomes& group : scene.exclusive_outcomes)
    for (const Outcome& outcome : group.outcomes) add(outcome);
  return volumes;
}

bool is_in(const Pose& X_WV, const Vector3d& size, const Vector3d& p_WQ) {
  return ((X_WV.inverse() * p_WQ).cwiseAbs().array() <= 0.5 * size.array()).all();
}

void add_containments(const Scene& scene, const Trajectory& trajectory, std::size_t i, Timeline& timeline) {
  const std::string& name = scene.objects[i].name;
  for (const NamedVolume& volume : volumes_for(scene, name)) {
    add_sampled(
        trajectory, Relation::kInside, name, volume.name,
        [&](const WorldState& state) { return is_in(volume.X_WV, volume.size, state.objects[i].X_WO.translation); },
        timeline);
  }
  for (std::size_t j = 0; j < scene.objects.size(); ++j) {
    const std::optional<Hollow>& hollow = scene.model_of(scene.objects[j]).hollow;
    if (j == i || !hollow) continue;
    add_sampled(
        trajectory, Relation::kInside, name, scene.objects[j].name,
        [&](const WorldState& state) {
          return is_in(state.objects[j].X_WO * hollow->X_OV, hollow->size, state.objects[i].X_WO.translation);
        },
        timeline);
  }
}

void add_motion(const Scene& scene, const Trajectory& trajectory, std::size_t i, Timeline& timeline) {
  const SceneObject& object = scene.objects[i];
  const Vector3d up_O = trajectory.start().objects[i].X_WO.rotation.conjugate() * Vector3d::UnitZ();
  const Vector3d up_W = up_of(scene);
  add_sampled(
      trajectory, Relation::kMoving, object.name, "",
      [&](const WorldState& state) { return is_moving(state.objects[i]); }, timeline);
  add_sampled(
      trajectory, Relation::kUpright, object.name, "",
      [&](const WorldState& state) { return (state.objects[i].X_WO.rotation * up_O).z() >= kUprightCosine; }, timeline);
  add_sampled(
      trajectory, Relation::kFalling, object.name, "",
      [&](const WorldState& state) {
        const ObjectState& now = state.objects[i];
        return now.mode != MotionMode::kHeld && up_W.dot(now.V_WO.linear) < -kFallingSpeed &&
               !touches_anything(trajectory, static_cast<int>(i), state.time);
      },
      timeline);
  if (object.held_by) {
    add_sampled(
        trajectory, Relation::kHolds, *object.held_by, object.name,
        [&](const WorldState& state) { return state.objects[i].mode == MotionMode::kHeld; }, timeline);
  }
}

}  // namespace

std::string to_string(Relation relation) {
  switch (relation) {
    case Relation::kContact:
      return "contact";
    case Relation::kSupports:
      return "supports";
    case Relation::kInside:
      return "inside";
    case Relation::kHolds:
      return "holds";
    case Relation::kMoving:
      return "moving";
    case Relation::kUpright:
      return "upright";
    case Relation::kFalling:
      return "falling";
  }
  PRESCENE_CHECK_MSG(false, "a Relation outside of its enumeration");
}

Timeline timeline_of(const Scene& scene, const Trajectory& trajectory) {
  Timeline timeline;
  if (trajectory.states.empty()) return timeline;
  add_contacts(scene, trajectory, timeline);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    add_containments(scene, trajectory, i, timeline);
    add_motion(scene, trajectory, i, timeline);
  }
  const auto key = [](const Interval& interval) {
    return std::tie(interval.begin, interval.relation, interval.subject, interval.other, interval.end);
  };
  std::sort(timeline.begin(), timeline.end(), [&](const Interval& a, const Interval& b) { return key(a) < key(b); });
  return timeline;
}

}  // namespace prescene::belief
