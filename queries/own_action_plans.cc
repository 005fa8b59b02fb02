// SPDX-License-Identifier: Apache-2.0
// The scene's own actions: which one, what is like it where there is none, and those of a hand that holds nothing yet.
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "own_action_plan.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/core/text.h"

namespace prescene::queries {
namespace {

using belief::Action;
using geometry::Vector3d;

// What is done where the scene does no such thing.
constexpr double kOwnTurn = 45.0 * geometry::kDegree, kOwnWay = 0.1;
// By how much a number of a question may be beyond an end; as of the schema's bounds.
constexpr double kEndTolerance = 1e-9;

std::string moved_object(const belief::Scene& scene, const Action& action) {
  const auto* move = std::get_if<belief::MoveJoint>(&action.what);
  if (move == nullptr) return belief::object_of(action);
  const std::optional<int> joint = belief::find_joint(scene, move->joint);
  return joint ? scene.joints[static_cast<std::size_t>(*joint)].child : std::string();
}

class GraspPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const belief::Grip grip = std::get<belief::Grasp>(own_.what).grip.value_or(belief::Grip{});
    PRESCENE_RETURN_IF_ERROR(add_force("grip_force", grip.force, scene_values));
    add_size("pad_length", grip.pad_length, scene_values);
    return add_time(scene_values);
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& grasp = std::get<belief::Grasp>(action.what);
    if (!chosen("grip_force") && !chosen("pad_length")) return action;
    belief::Grip grip = grasp.grip.value_or(belief::Grip{});
    choose("grip_force", values, grip.force);
    choose("pad_length", values, grip.pad_length);
    grasp.grip = grip;
    return action;
  }
};

class PullPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::Pull>(own_.what);
    PRESCENE_RETURN_IF_ERROR(add_force("force", own.force, scene_values));
    add_size("distance", own.by.norm(), scene_values);
    add_direction("direction_deg", own.by, scene_values);
    add_size("duration", own.duration, scene_values);
    return add_time(scene_values);
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& pull = std::get<belief::Pull>(action.what);
    double distance = pull.by.norm();
    Vector3d along = pull.by / distance;
    choose("distance", values, distance);
    if (chosen("direction_deg")) {
      const double angle = geometry::kDegree * value("direction_deg", values);
      along = {std::cos(angle), std::sin(angle), 0.0};
    }
    pull.by = distance * along;
    choose("force", values, pull.force);
    choose("duration", values, pull.duration);
    return action;
  }
};

class MoveJointPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::MoveJoint>(own_.what);
    joint_ = &scene_->joints[static_cast<std::size_t>(*belief::find_joint(*scene_, own.joint))];
    const bool slides = joint_->type == belief::JointType::kSlider;
    const double unit = slides ? 1.0 : geometry::kDegree;
    // By the whole name: "to" is another parameter than "to_deg", not short for it.
    const auto names = [other = slides ? "to_deg" : "to"](const auto& one) { return one.name == other; };
    if (std::ranges::any_of(query_.free, names) || std::ranges::any_of(query_.fixed, names))
      return core::invalid_input(
          "the joint '" + own.joint + "' is " +
          (slides ? "a slider: its position is 'to', in metres" : "a hinge: its position is 'to_deg', in degrees"));
    const double reach = slides ? 0.3 : 180.0;
    const double low = std::isfinite(joint_->low) ? joint_->low / unit : -reach;
    const double high = std::isfinite(joint_->high) ? joint_->high / unit : std::max(reach, low);
    scene_values.push_back({slides ? "to" : "to_deg", own.to / unit, std::min(low, high), high});
    PRESCENE_RETURN_IF_ERROR(add_force("force", own.force, scene_values));
    add_size("duration", own.duration, scene_values);
    return add_time(scene_values);
  }
  std::optional<std::string> obstacle(std::span<const double> values) override {
    const double to = std::get<belief::MoveJoint>(exact(values).what).to;
    if (to >= joint_->low - 1e-9 && to <= joint_->high + 1e-9) return std::nullopt;
    return "the joint " + joint_->name + " does not get there";
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& move = std::get<belief::MoveJoint>(action.what);
    if (joint_->type == belief::JointType::kSlider)
      choose("to", values, move.to);
    else
      choose_angle("to_deg", values, move.to);
    choose("force", values, move.force);
    choose("duration", values, move.duration);
    return action;
  }

 private:
  const belief::Joint* joint_ = nullptr;
};

/// A number of the question, and where it is there.
struct AskedNumber {
  std::string place;
  double value = 0.0;
};
std::vector<AskedNumber> numbers_asked(const belief::AchieveQuery& query, const std::string& name) {
  std::vector<AskedNumber> asked;
  for (const belief::ParameterRange& range : query.free) {
    if (range.name != name) continue;
    for (const std::optional<double>& end : {range.low, range.high})
      if (end) asked.push_back({"free." + name, *end});
  }
  for (const belief::ParameterValue& fixed : query.fixed)
    if (fixed.name == name) asked.push_back({"fixed." + name, fixed.value});
  return asked;
}

}  // namespace

core::Status OwnActionPlan::add_force(const char* name, const belief::ScalarDistribution& own,
                                      std::vector<SceneValue>& scene_values) {
  const double mean = belief::mean(own);
  SceneValue value{name, mean, kLeastFactor * mean, kMostFactor * mean};
  if (const auto* normal = std::get_if<belief::NormalScalar>(&own)) {
    const std::string whose = "the scene's own " + belief::kind_of(own_) + " cuts its normal distribution there";
    for (const AskedNumber& asked : numbers_asked(query_, name)) {
      if (asked.value > normal->high + kEndTolerance)
        return core::invalid_input(core::rounded_text(asked.value) + " is out of range: " + whose +
                                   ", so that less would be drawn: give at most " + core::rounded_text(normal->high) +
                                   ", or raise its 'max' in the scene")
            .at(asked.place);
      if (asked.value < normal->low - kEndTolerance)
        return core::invalid_input(core::rounded_text(asked.value) + " is out of range: " + whose +
                                   ", so that more would be drawn: give at least " + core::rounded_text(normal->low) +
                                   ", or lower its 'min' in the scene")
            .at(asked.place);
    }
    const auto searched = [&](const std::optional<double> belief::ParameterRange::*end) {
      return std::ranges::any_of(query_.free,
                                 [&](const auto& range) { return range.name == name && !(range.*end).has_value(); });
    };
    const auto remark = [&](const char* to, double end) {
      remarks_.push_back("'" + std::string(name) + "' is searched no " + to + " than " + core::rounded_text(end) +
                         ": " + whose + ".");
    };
    if (value.low < normal->low && searched(&belief::ParameterRange::low)) remark("lower", normal->low);
    if (value.high > normal->high && searched(&belief::ParameterRange::high)) remark("higher", normal->high);
    value.low = std::max(value.low, normal->low);
    value.high = std::min(value.high, normal->high);
  }
  scene_values.push_back(std::move(value));
  return {};
}

belief::Pose OwnActionPlan::begin_pose() const {
  const std::span<const Action> before(scene_->actions.data(), at_.value_or(scene_->actions.size()));
  double time = own_.time;
  if (const auto carry = carry_before())
    time = std::max(time, before[*carry].time + belief::duration_of(before[*carry]));
  return belief::object_pose_at(*scene_, before, {&prior_.likeliest, {}}, static_cast<int>(index_), time);
}

OwnActionPlan::Slot OwnActionPlan::slot() const {
  Slot slot;
  for (std::size_t i = 0; i < scene_->actions.size(); ++i) {
    const Action& other = scene_->actions[i];
    // What happens to the object is not what a hand does with it.
    if (i == at_ || std::holds_alternative<belief::Bump>(other.what) || moved_object(*scene_, other) != name_) continue;
    if (at_ && i < *at_) {
      const double over = other.time + belief::duration_of(other);
      if (over <= slot.from) continue;
      slot.from = over;
      slot.before = &other;
    } else if ((at_ || belief::lets_go(other)) && other.time < slot.until) {
      slot.until = other.time;
      slot.after = &other;
    }
  }
  // The scene may begin it while the one before is not over.
  slot.from = std::min(slot.from, own_.time);
  slot.until = std::max(slot.until, own_.time);
  return slot;
}

core::Status OwnActionPlan::add_time(std::vector<SceneValue>& scene_values) const {
  const Slot slot = this->slot();
  const auto named = [&](const Action& action) {
    return "the scene's " + belief::kind_of(action) + " of '" + name_ + "'";
  };
  for (const AskedNumber& asked : numbers_asked(query_, "time")) {
    if (slot.before != nullptr && asked.value < slot.from - kEndTolerance)
      return core::invalid_input(core::rounded_text(asked.value) + " is out of range: " + named(*slot.before) +
                                 " comes before: give " + core::rounded_text(slot.from) + " s or later")
          .at(asked.place);
    if (slot.after != nullptr && asked.value > slot.until + kEndTolerance)
      return core::invalid_input(core::rounded_text(asked.value) + " is out of range: " + named(*slot.after) +
                                 " comes after: give " + core::rounded_text(slot.until) + " s or earlier")
          .at(asked.place);
  }
  scene_values.push_back({"time", own_.time, slot.from, std::min(own_.time + 1.0, slot.until)});
  return {};
}

std::optional<std::size_t> own_action(const belief::Scene& scene, const std::string& kind, const std::string& object) {
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < scene.actions.size(); ++i)
    if (belief::kind_of(scene.actions[i]) == kind && moved_object(scene, scene.actions[i]) == object) last = i;
  return last;
}

std::string object_of_own(const belief::Scene& scene, const std::string& kind) {
  std::string found;
  for (const Action& action : scene.actions) {
    if (belief::kind_of(action) != kind) continue;
    const std::string object = moved_object(scene, action);
    if (!found.empty() && object != found) return {};
    found = object;
  }
  return found;
}

namespace {

/// Where the scene has none: one like it, at once.
core::Result<Action> like_own(const belief::Scene& scene, const std::string& kind, const std::string& object) {
  if (kind == "tilt") return Action{0.0, belief::Tilt{object, Vector3d::UnitX(), kOwnTurn}};
  if (kind == "pour") return Action{0.0, belief::Pour{object, Vector3d::UnitX(), kOwnTurn}};
  if (kind == "insert") return Action{0.0, belief::Insert{object}};
  if (kind == "pull") return Action{0.0, belief::Pull{object, kOwnWay * Vector3d::UnitX()}};
  if (kind == "transport")
    return core::invalid_input("the scene carries '" + object +
                               "' nowhere, so that there is no speed to choose: give it an action transport of '" +
                               object + "'");
  if (kind == "move_joint") {
    for (const belief::Joint& joint : scene.joints)
      if (joint.child == object)
        return Action{0.0, belief::MoveJoint{joint.name, joint.type, std::clamp(0.0, joint.low, joint.high)}};
    return core::invalid_input("'" + object + "' hangs on no joint: name an object that does (object)");
  }
  if (scene.robot.size() != 1)
    return core::invalid_input(scene.robot.empty()
                                   ? "the scene has no robot body that could grasp '" + object + "'"
                                   : "which robot body is to grasp '" + object +
                                         "'? The scene has several: give it an action grasp of '" + object + "'");
  return Action{0.0, belief::Grasp{object, scene.robot.front().name}};
}

template <class Plan>
std::unique_ptr<OwnActionPlan> make(const OwnActionPlan::Own& own) {
  return std::make_unique<Plan>(own);
}

/// All but a delay are of other actions.
core::Status check_only_delay(const belief::ActionErrors& errors, const std::string& kind) {
  const char* key = !errors.position.isZero(0.0)   ? "position"
                    : !errors.rotation.isZero(0.0) ? "rotation_deg"
                    : errors.disturbance           ? "velocity"
                    : belief::dimensions(errors.lateral_error) > 0 || belief::mean(errors.lateral_error) != 0.0
                        ? "lateral_error"
                        : nullptr;
  if (key == nullptr) return {};
  return core::invalid_input("errors." + std::string(key) + ": that is of " +
                             (key == std::string("lateral_error") ? "a push"
                              : key == std::string("velocity")    ? "an opening hand"
                                                                  : "a place") +
                             "; give errors.delay to '" + kind +
                             "', and what else is not exact as distributions in the scene's own action");
}

}  // namespace

core::Result<std::unique_ptr<PlannedAction>> plan_own_action(const Prior& prior, const belief::AchieveQuery& query,
                                                             const std::string& kind, std::size_t index,
                                                             std::vector<SceneValue>& scene_values) {
  PRESCENE_RETURN_IF_ERROR(check_only_delay(query.errors, kind));
  const belief::Scene& scene = *prior.scene;
  const belief::SceneObject& object = scene.objects[index];
  if ((kind == "pull" || kind == "grasp") && object.held_by)
    return core::invalid_input("'" + object.name + "' is held by " + *object.held_by + ", so that a " + kind +
                               " changes nothing: name an object that is free");
  const std::optional<std::size_t> at = own_action(scene, kind, object.name);
  PRESCENE_TRY(Action own, at ? core::Result<Action>(scene.actions[*at]) : like_own(scene, kind, object.name));
  const OwnActionPlan::Own known{prior, query, index, std::move(own), at};
  std::unique_ptr<OwnActionPlan> plan = kind == "tilt"         ? make_tilt_plan(known)
                                        : kind == "pour"       ? make_pour_plan(known)
                                        : kind == "insert"     ? make_insert_plan(known)
                                        : kind == "grasp"      ? make<GraspPlan>(known)
                                        : kind == "pull"       ? make<PullPlan>(known)
                                        : kind == "move_joint" ? make<MoveJointPlan>(known)
                                                               : make_transport_plan(known);
  PRESCENE_RETURN_IF_ERROR(plan->prepare(scene_values));
  return std::unique_ptr<PlannedAction>(std::move(plan));
}

}  // namespace prescene::queries
