// SPDX-License-Identifier: Apache-2.0
#include "planned_action.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "own_action.h"
#include "prescene/core/check.h"
#include "prescene/core/spelling.h"
#include "prescene/core/text.h"

namespace prescene::queries {
namespace {

using belief::ActionParameter;

/// "placed", "poured out".
std::string done_with(const std::string& action) {
  if (action == "place") return "placed";
  if (action == "release") return "released";
  if (action == "pour") return "poured out";
  if (action == "tilt") return "tilted";
  return action == "insert" ? "inserted" : "carried";
}

/// The object that the action is about, in the prior's scene.
core::Result<std::size_t> object_of(const Prior& prior, const belief::AchieveQuery& query,
                                    const belief::ActionSchema& schema, const belief::Outcome& wanted) {
  const belief::Scene& scene = *prior.scene;
  std::vector<std::string> held;
  for (const belief::SceneObject& object : scene.objects)
    if (object.held_by) held.push_back(object.name);
  std::string name = query.object;
  if (name.empty() && schema.of_scene) name = object_of_own(scene, schema.name);
  if (name.empty() && schema.of_held && held.size() == 1) name = held.front();
  if (name.empty() && schema.of_held && held.empty())
    return core::invalid_input("nothing is held by a robot body, so nothing can be " + done_with(schema.name) +
                               ": grasp an object first (in a scene file: held_by)");
  if (name.empty() && schema.of_held)
    return core::invalid_input("several objects are held: name the one to " + schema.name + " (object)");
  if (name.empty()) name = wanted.object;
  const std::optional<int> index = belief::find_object(scene, name);
  if (!index) return no_such_object(prior, name);
  const bool in_scene = schema.of_scene && own_action(scene, schema.name, name);
  if (schema.of_held && !in_scene && !scene.objects[static_cast<std::size_t>(*index)].held_by)
    return core::invalid_input("'" + name + "' is not held by a robot body, so it can't be " + done_with(schema.name) +
                               ": name an object that is held" + (held.empty() ? "" : ", like " + held.front()));
  return static_cast<std::size_t>(*index);
}

core::Status check_within(const ActionParameter& parameter, double value, const std::string& place) {
  if (std::isfinite(value) && value >= parameter.least - 1e-9 && value <= parameter.most + 1e-9) return {};
  return core::invalid_input(core::rounded_text(value) + " is out of range: give " + parameter.unit + " between " +
                             core::rounded_text(parameter.least) + " and " + core::rounded_text(parameter.most))
      .at(place);
}

/// "position" stands for x and y.
std::vector<belief::ParameterRange> single_ranges(const std::vector<belief::ParameterRange>& asked) {
  std::vector<belief::ParameterRange> single;
  for (const belief::ParameterRange& range : asked) {
    if (range.name != "position") {
      single.push_back(range);
      continue;
    }
    for (const char* name : {"x", "y"}) single.push_back({name, range.low, range.high});
  }
  return single;
}

}  // namespace

double PlannedAction::value(const std::string& name, std::span<const double> values) const {
  for (std::size_t i = 0; i < free_.size(); ++i)
    if (free_[i].schema.name == name) return values[i];
  for (const belief::ParameterValue& fixed : fixed_)
    if (fixed.name == name) return fixed.value;
  PRESCENE_CHECK_MSG(false, "an action without the parameter " + name);
}

core::Result<std::unique_ptr<PlannedAction>> plan_action(const Prior& prior, const belief::AchieveQuery& query,
                                                         const belief::Outcome& wanted, core::ThreadPool& pool) {
  PRESCENE_TRY(const belief::ActionSchema* schema, belief::find_action_schema(query.action));
  PRESCENE_TRY(const std::size_t index, object_of(prior, query, *schema, wanted));
  if (query.free.empty()) {
    std::string names;
    for (const ActionParameter& parameter : schema->parameters) names += (names.empty() ? "" : ", ") + parameter.name;
    return core::invalid_input("no parameter is free: name at least one of " + names);
  }
  // Names first, so that a wrong one is told before what the scene lacks.
  std::vector<std::pair<const ActionParameter*, belief::ParameterRange>> free;
  for (const belief::ParameterRange& range : single_ranges(query.free)) {
    const auto parameter = belief::find_action_parameter(*schema, range.name);
    if (!parameter) return parameter.status().at("free");
    for (const auto& [other, unused] : free)
      if (other == *parameter) return core::invalid_input("free: '" + range.name + "' is there twice: name it once");
    free.emplace_back(*parameter, range);
  }
  std::vector<std::pair<const ActionParameter*, double>> fixed;
  for (const belief::ParameterValue& value : query.fixed) {
    const auto parameter = belief::find_action_parameter(*schema, value.name);
    if (!parameter) return parameter.status().at("fixed");
    PRESCENE_RETURN_IF_ERROR(check_within(**parameter, value.value, "fixed." + value.name));
    for (const auto& [other, unused] : fixed)
      if (other == *parameter) return core::invalid_input("fixed: '" + value.name + "' is there twice: give it once");
    for (const auto& [other, unused] : free)
      if (other == *parameter)
        return core::invalid_input("'" + value.name + "' is both free and fixed: take it out of one of them");
    fixed.emplace_back(*parameter, value.value);
  }

  std::vector<SceneValue> scene_values;
  core::Result<std::unique_ptr<PlannedAction>> plan =
      schema->of_scene          ? plan_own_action(prior, query, schema->name, index, scene_values)
      : schema->name == "place" ? plan_place(prior, query, wanted, index, pool, scene_values)
      : schema->name == "push"  ? plan_push(prior, query, index, pool, scene_values)
      : schema->name == "bump"  ? plan_bump(prior, query, index, scene_values)
                                : plan_release(prior, query, index, scene_values);
  if (!plan) return plan;
  PlannedAction& made = **plan;
  made.object_ = prior.scene->objects[index].name;
  const auto of_scene = [&](const std::string& name) -> const SceneValue* {
    const auto found =
        std::find_if(scene_values.begin(), scene_values.end(), [&](const SceneValue& one) { return one.name == name; });
    return found == scene_values.end() ? nullptr : &*found;
  };
  for (const auto& [parameter, range] : free) {
    FreeParameter& one = made.free_.emplace_back();
    one.schema = *parameter;
    const SceneValue* known = of_scene(parameter->name);
    const auto within = [&, bounds = parameter](double end) { return std::clamp(end, bounds->least, bounds->most); };
    one.low = range.low.value_or(known ? within(known->low) : parameter->low.value_or(parameter->least));
    one.high = range.high.value_or(known ? within(known->high) : parameter->high.value_or(parameter->most));
    PRESCENE_RETURN_IF_ERROR(check_within(*parameter, one.low, "free." + range.name));
    PRESCENE_RETURN_IF_ERROR(check_within(*parameter, one.high, "free." + range.name));
    if (!(one.low < one.high))
      return core::invalid_input("the range of free." + range.name + " from " + core::rounded_text(one.low) + " to " +
                                 core::rounded_text(one.high) + " is empty: give a range, or fix the parameter");
  }
  for (const ActionParameter& parameter : schema->parameters) {
    if (std::any_of(free.begin(), free.end(), [&](const auto& one) { return one.first == &parameter; })) continue;
    const auto given =
        std::find_if(fixed.begin(), fixed.end(), [&](const auto& one) { return one.first == &parameter; });
    const SceneValue* known = of_scene(parameter.name);
    made.fixed_.push_back({parameter.name, given != fixed.end() ? given->second
                                           : known              ? known->value
                                                                : parameter.value.value_or(0.0)});
  }
  return plan;
}

const belief::Action* own_release(const belief::Scene& scene, const std::string& object) {
  for (const belief::Action& action : scene.actions) {
    const auto* release = std::get_if<belief::Release>(&action.what);
    if (release != nullptr && release->object == object) return &action;
  }
  return nullptr;
}

std::pair<double, double> heights_of(const geometry::TriangleMesh& mesh, const geometry::Quaterniond& rotation) {
  const geometry::Vector3d up = rotation.conjugate() * geometry::Vector3d::UnitZ();
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const geometry::Vector3d& vertex : mesh.vertices) {
    low = std::min(low, up.dot(vertex));
    high = std::max(high, up.dot(vertex));
  }
  return {low, high};
}

}  // namespace prescene::queries
