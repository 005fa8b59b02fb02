// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/played_scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "prescene/belief/robot_motion.h"
#include "prescene/belief/scene_size.h"
#include "prescene/belief/trajectory.h"
#include "prescene/belief/validation.h"
#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::service {
namespace {

using belief::Action;
using belief::MotionMode;
using belief::ObjectState;
using belief::Scene;
using belief::WorldState;

constexpr double kTimelineStep = 1.0 / 240.0;  // s; what a hand did by its actions is written down so finely
constexpr double kTimeRounding = 1e-9;         // s; times that differ by less are the same

/// How long an action lasts that a change would break off; a push goes on over a change.
double unbroken_duration(const Action& action) {
  return std::holds_alternative<belief::Push>(action.what) ? 0.0 : belief::duration_of(action);
}

core::Status check(const Scene& scene, const UnannouncedChange& change) {
  const std::string at = "the change of '" + change.object + "'";
  if (!belief::find_object(scene, change.object))
    return core::invalid_input(at + ": scene '" + scene.name + "' has no object of that name");
  if (!(change.time >= 0.0 && change.time <= scene.duration))
    return core::invalid_input(at + ": its time is outside the scene's duration: give 0 to " +
                               std::to_string(scene.duration) + " s");
  if (change.X_WO && !(change.X_WO->translation.cwiseAbs().maxCoeff() <= belief::kLengthRange.high))
    return core::invalid_input(at + ": its place is out of range: " + belief::kLengthRange.remedy);
  for (const Action& action : scene.actions) {
    if (action.time < change.time && change.time < action.time + unbroken_duration(action) - kTimeRounding)
      return core::invalid_input(at + ": its frame, at " + core::fixed_text(change.time, 3) + " s, lies within a " +
                                 belief::kind_of(action) + ", which it would break off: give a time before or after");
  }
  return core::ok_status();
}

/// The hand that holds the object after the actions up to `time`.
std::optional<std::string> holder_at(const Scene& scene, const belief::SceneObject& object, double time) {
  std::optional<std::string> holder = object.held_by;
  for (const Action& action : scene.actions) {
    if (action.time > time || belief::object_of(action) != object.name) continue;
    if (const auto* grasp = std::get_if<belief::Grasp>(&action.what)) holder = grasp->hand;
    if (belief::lets_go(action)) holder.reset();
  }
  return holder;
}

/// X_GO by which a hand takes an object at `time`. Exact where a state is of then, or the hand still holds it in the
/// next one and nothing else has begun; else from the state before. X_WG: the hand's pose by the time.
geometry::Pose grasp_in(const PlayedPart& part, int object, double time,
                        const std::function<geometry::Pose(double)>& X_WG) {
  const std::vector<WorldState>& states = part.trajectory.states;
  const auto next = std::lower_bound(states.begin(), states.end(), time - kTimeRounding,
                                     [](const WorldState& state, double t) { return state.time < t; });
  const auto object_in = [&](const WorldState& state) { return state.objects[static_cast<std::size_t>(object)]; };
  const auto begins_before_next = [&](const Action& action) {
    const double begin = states.front().time + action.time;
    return begin > time + kTimeRounding && begin < next->time - kTimeRounding;
  };
  if (next != states.end() && (next->time <= time + kTimeRounding ||
                               (object_in(*next).mode == MotionMode::kHeld &&
                                std::none_of(part.actions.begin(), part.actions.end(), begins_before_next))))
    return X_WG(next->time).inverse() * object_in(*next).X_WO;
  const WorldState& last = *std::prev(next);  // actions begin with the part's first state or later
  const ObjectState then = object_in(last);
  geometry::Pose X_WO = then.X_WO;
  X_WO.translation += (time - last.time) * then.V_WO.linear;
  X_WO.rotation = geometry::exp_rotation((time - last.time) * then.V_WO.angular) * X_WO.rotation;
  return X_WG(time).inverse() * X_WO;
}

/// Where a hand is by what begins in the part before `until`.
geometry::Pose robot_pose_of(const PlayedPart& part, int body, double time, double until) {
  const WorldState& start = part.trajectory.start();
  const auto end = std::find_if(part.actions.begin(), part.actions.end(), [&](const Action& action) {
    return start.time + action.time >= until - kTimeRounding;
  });
  const belief::MotionStart from{&start, [&](int object, double t, const std::function<geometry::Pose(double)>& X_WG) {
                                   return grasp_in(part, object, t, X_WG);
                                 }};
  return belief::robot_pose_at(part.scene, {part.actions.begin(), end}, from, body, time);
}

/// What the hands do from `time` on, by timelines and by the actions before it, as timelines alone. `part` is the one
/// before.
std::vector<belief::KinematicBody> written_down(const Scene& scene, const PlayedPart* part, double time) {
  std::vector<belief::KinematicBody> bodies = scene.robot;
  const bool acted =
      std::any_of(scene.actions.begin(), scene.actions.end(), [&](const Action& action) { return action.time < time; });
  if (!acted || part == nullptr) return bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].timeline.clear();
    for (double t = time; t < scene.duration + kTimelineStep; t += kTimelineStep)
      bodies[i].timeline.push_back({t, robot_pose_of(*part, static_cast<int>(i), t, time)});
  }
  return bodies;
}

/// The objects of the scene, each with its state where it is there.
using Present = std::vector<std::optional<ObjectState>>;

/// What is random in the actions, drawn once for all parts.
void fix_actions(core::RandomStream stream, std::vector<Action>& actions) {
  const auto drawn = simulation::draw_actions(actions, stream);
  for (std::size_t i = 0; i < actions.size(); ++i) simulation::fix_draws(drawn[i], actions[i]);
}

/// What is left of an action at `time`, as one that begins then or later; empty: nothing.
std::optional<Action> rest_of(const Action& action, double time) {
  Action rest = action;
  rest.time = action.time - time;
  if (rest.time >= 0.0) return rest;
  auto* push = std::get_if<belief::Push>(&rest.what);
  if (push == nullptr || rest.time + push->duration <= 0.0) return std::nullopt;
  push->from += -rest.time / push->duration * (push->to - push->from);
  push->duration += rest.time;
  rest.time = 0.0;
  return rest;
}

/// The scene as it goes on at `time` after `before`, with the objects that are there only.
Scene scene_from(const Scene& whole, const PlayedPart* before, const Present& present, double time) {
  Scene scene = whole;
  scene.robot = written_down(whole, before, time);
  scene.objects.clear();
  scene.actions.clear();
  for (std::size_t i = 0; i < whole.objects.size(); ++i) {
    if (!present[i]) continue;
    belief::SceneObject object = whole.objects[i];
    const bool is_held = present[i]->mode == MotionMode::kHeld;
    object.held_by = is_held ? holder_at(whole, object, time) : std::nullopt;
    scene.objects.push_back(std::move(object));
  }
  belief::drop_loose_joints(scene);
  for (const Action& action : whole.actions) {
    const std::string object = belief::object_of(action);
    if (!object.empty() && !belief::find_object(scene, object)) continue;
    if (auto rest = rest_of(action, time)) scene.actions.push_back(*std::move(rest));
  }
  // Outcomes are judged on the whole scene, not on a part of it.
  scene.outcomes.clear();
  scene.exclusive_outcomes.clear();
  return scene;
}

void apply(const UnannouncedChange& change, const WorldState& start, const Scene& scene, Present& present) {
  const auto i = static_cast<std::size_t>(*belief::find_object(scene, change.object));
  if (change.added_velocity) {
    if (!present[i]) return;
    present[i]->V_WO.linear += change.added_velocity->linear;
    present[i]->V_WO.angular += change.added_velocity->angular;
    present[i]->mode = MotionMode::kMoving;
    return;
  }
  if (!change.X_WO) {
    present[i].reset();
    return;
  }
  ObjectState state = start.objects[i];  // with its physical parameters
  state.X_WO = *change.X_WO;
  state.V_WO = {};
  state.mode = MotionMode::kMoving;
  present[i] = state;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

}  // namespace

double frame_of_change(const Scene& scene, double time, double interval) {
  const double frame = std::min(std::round(time / interval) * interval, scene.duration);
  // An action at this frame comes neither before it nor after it by rounding, which would lose the action.
  for (const Action& action : scene.actions)
    if (std::abs(action.time - frame) <= kTimeRounding) return action.time;
  return frame;
}

geometry::Pose robot_pose_in(std::span<const PlayedPart> parts, int body, double time) {
  std::size_t last = 0;
  while (last + 1 < parts.size() && parts[last + 1].trajectory.start().time <= time + kTimeRounding) ++last;
  return robot_pose_of(parts[last], body, time, std::numeric_limits<double>::infinity());
}

core::Result<UnannouncedChange> removal_from_text(const std::string& text) {
  const std::vector<std::string> parts = split(text, ':');
  const std::optional<double> time = interfaces::finite_number(parts[0]);
  if (parts.size() != 2 || !time || parts[1].empty())
    return core::invalid_input("--remove SECONDS:OBJECT, as 1.5:cup; this is not: " + text);
  return UnannouncedChange{*time, parts[1], std::nullopt};
}

core::Result<UnannouncedChange> put_from_text(const std::string& text) {
  const core::Status bad = core::invalid_input(
      "--put SECONDS:OBJECT:X,Y,Z or SECONDS:OBJECT:X,Y,Z,YAW_DEG, as 1.5:cup:0.1,0,0.05; this is "
      "not: " +
      text);
  const std::vector<std::string> parts = split(text, ':');
  const std::optional<double> time = interfaces::finite_number(parts[0]);
  if (parts.size() != 3 || !time || parts[1].empty()) return bad;
  std::vector<double> values;
  for (const std::string& part : split(parts[2], ',')) {
    const std::optional<double> value = interfaces::finite_number(part);
    if (!value) return bad;
    values.push_back(*value);
  }
  if (values.size() != 3 && values.size() != 4) return bad;
  geometry::Pose X_WO = geometry::Pose::from_translation({values[0], values[1], values[2]});
  if (values.size() == 4) X_WO.rotation = geometry::exp_rotation({0.0, 0.0, values[3] * std::numbers::pi / 180.0});
  return UnannouncedChange{*time, parts[1], X_WO};
}

core::Result<std::vector<PlayedPart>> play_scene(const Scene& scene, std::vector<UnannouncedChange> changes,
                                                 const simulation::SimulatorFactory& simulators, double interval,
                                                 std::uint64_t seed, core::ThreadPool& pool,
                                                 const core::Cancellation* cancellation) {
  for (UnannouncedChange& change : changes) {
    PRESCENE_RETURN_IF_ERROR(check(scene, change));
    change.time = frame_of_change(scene, change.time, interval);
    PRESCENE_RETURN_IF_ERROR(check(scene, change));  // an action may have begun until then
  }
  std::stable_sort(changes.begin(), changes.end(), [](const auto& a, const auto& b) { return a.time < b.time; });

  core::RandomStream stream(seed, core::Purpose::kScenario);
  std::vector<double> uniforms(static_cast<std::size_t>(belief::start_dimensions(scene)));
  for (double& u : uniforms) u = stream.uniform();
  const WorldState start = belief::draw_start(scene, uniforms);
  Present present(start.objects.begin(), start.objects.end());

  const core::RandomStream action_draws(seed, core::Purpose::kAction);
  Scene fixed = scene;
  fix_actions(action_draws.at(0, 0), fixed.actions);
  std::vector<PlayedPart> parts;
  double time = 0.0;
  for (std::size_t next = 0;;) {
    while (next < changes.size() && changes[next].time <= time) apply(changes[next++], start, scene, present);
    const double until = next < changes.size() ? std::min(changes[next].time, scene.duration) : scene.duration;
    PlayedPart part{
        changes.empty() ? scene : scene_from(fixed, parts.empty() ? nullptr : &parts.back(), present, time), {}, {}};
    part.actions = changes.empty() ? fixed.actions : part.scene.actions;
    WorldState from;
    from.time = time;
    for (const std::optional<ObjectState>& object : present)
      if (object) from.objects.push_back(*object);
    for (const belief::Joint& joint : part.scene.joints)
      from.joints.push_back(start.joints[static_cast<std::size_t>(*belief::find_joint(scene, joint.name))]);
    simulation::RunRequest request;
    request.actions = part.scene.actions;
    request.stop.duration = until - time;
    request.stop.stop_at_rest = false;
    request.stop.world_radius = belief::world_radius(part.scene);
    request.sample_interval = interval;
    std::vector<WorldState>& states = part.trajectory.states;
    if (until > time) {
      PRESCENE_TRY(const auto simulator, simulators(part.scene, 1.0));
      simulator->run({&from, 1}, request, action_draws, 0, pool, {&part.trajectory, 1}, cancellation);
      if (part.trajectory.end == belief::TrajectoryEnd::kCancelled)
        return core::cancelled("stopped on request before the scene was played to its end");
    } else {
      states = {from};
    }
    std::size_t i = 0;
    for (std::optional<ObjectState>& object : present)
      if (object) object = states.back().objects[i++];
    const bool last = next >= changes.size();
    if (!last) states.pop_back();  // it is the next part's first
    parts.push_back(std::move(part));
    if (last) return parts;
    time = until;
  }
}

}  // namespace prescene::service
