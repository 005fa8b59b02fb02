// SPDX-License-Identifier: Apache-2.0
// What a valid scene may still not be meant to say.
#include <algorithm>
#include <array>
#include <vector>

#include "prescene/belief/scene_size.h"
#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

// One remark an object: about the lightest of the others.
void warn_of_mass_ratios(const LocatedValue& objects, const belief::Scene& scene, Problems& problems) {
  const auto mass = [&](const belief::SceneObject& object) { return belief::mean(scene.model_of(object).mass); };
  const auto lightest = std::ranges::min_element(scene.objects, {}, mass);
  for (const belief::SceneObject& object : scene.objects) {
    if (mass(object) <= belief::kGreatestMassRatio * mass(*lightest)) continue;
    const LocatedValue& at = *objects.find(object.name);
    problems.warn(at.place, at.path,
                  "it has more than " + core::rounded_text(belief::kGreatestMassRatio) + " times the mass of " +
                      interfaces::quote(lightest->name) + ", " + core::rounded_text(mass(object)) + " and " +
                      core::rounded_text(mass(*lightest)) + " kg",
                  "trust no outcome in which it rests on that (docs/reference/simulation.md, Limits)");
  }
}

// The same of sizes.
void warn_of_size_ratios(const LocatedValue& objects, const belief::Scene& scene, Problems& problems) {
  std::vector<double> sizes;
  const belief::SceneObject* smallest = nullptr;
  double least = 0.0;
  for (const belief::SceneObject& object : scene.objects) {
    sizes.push_back(belief::object_size(scene.model_of(object)));
    if (sizes.back() <= 0.0 || (smallest != nullptr && sizes.back() >= least)) continue;
    smallest = &object;
    least = sizes.back();
  }
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (smallest == nullptr || sizes[i] <= belief::kGreatestSizeRatio * least) continue;
    const LocatedValue& at = *objects.find(scene.objects[i].name);
    problems.warn(at.place, at.path,
                  "it is more than " + core::rounded_text(belief::kGreatestSizeRatio) + " times as large as " +
                      interfaces::quote(smallest->name) + ", " + core::rounded_text(sizes[i]) + " and " +
                      core::rounded_text(least) + " m",
                  "check the units of both; step and tolerances of the simulation fit the smallest object "
                  "(docs/reference/simulation.md, Limits)");
  }
}

/// The part of the file that makes a thing of which a message says "KIND 'NAME': ..."; null: none is named.
const LocatedValue* named_place(const LocatedValue& document, const std::string& message) {
  struct Section {
    std::string_view kind, key;
  };
  static constexpr std::array<Section, 7> kSections = {{{"model '", "models"},
                                                        {"support '", "supports"},
                                                        {"robot body '", "robot"},
                                                        {"robot body '", "robot_description"},
                                                        {"object '", "objects"},
                                                        {"joint '", "joints"},
                                                        {"outcome '", "outcomes"}}};
  for (const Section& section : kSections) {
    if (!message.starts_with(section.kind)) continue;
    const LocatedValue* at = document.find(section.key);
    if (at == nullptr) continue;
    const std::size_t begin = section.kind.size();
    const LocatedValue* thing = at->find(message.substr(begin, message.find('\'', begin) - begin));
    if (thing != nullptr || section.key == "robot_description") return thing ? thing : at;
  }
  return nullptr;
}

/// The first joint that hangs on itself; null: none does.
const LocatedValue* looping_joint(const LocatedValue& document, const belief::Scene& scene) {
  const LocatedValue* joints = document.find("joints");
  const std::vector<int> order = belief::joint_order(scene);
  if (joints == nullptr || order.size() == scene.joints.size()) return nullptr;
  std::vector<bool> ordered(scene.joints.size(), false);
  for (const int j : order) ordered[static_cast<std::size_t>(j)] = true;
  const auto first = std::find(ordered.begin(), ordered.end(), false) - ordered.begin();
  return joints->find(scene.joints[static_cast<std::size_t>(first)].name);
}

/// The first action that can not be carried out in the scene; null: each can.
const LocatedValue* impossible_action(const LocatedValue& document, const belief::Scene& scene) {
  const LocatedValue* actions = document.find("actions");
  if (actions == nullptr || actions->items.size() != scene.actions.size()) return nullptr;
  belief::Scene alone = scene;
  alone.actions.clear();
  if (!belief::validate(alone).ok()) return nullptr;
  for (std::size_t i = 0; i < scene.actions.size(); ++i) {
    alone.actions = {scene.actions[i]};
    if (!belief::validate(alone).ok()) return &actions->items[i];
  }
  return nullptr;
}

}  // namespace

void add_invalid(const FilePlace& place, std::string_view key, const core::Status& invalid, Problems& problems) {
  const std::string& message = invalid.message();
  const std::size_t colon = message.rfind(": ");
  if (colon == std::string::npos)
    problems.add(place, key, message, "correct it");
  else
    problems.add(place, key, message.substr(0, colon), message.substr(colon + 2));
}

void add_invalid_scene(const LocatedValue& document, const belief::Scene& scene, const core::Status& invalid,
                       Problems& problems) {
  const LocatedValue* at = named_place(document, invalid.message());
  if (at == nullptr) at = looping_joint(document, scene);
  if (at == nullptr) at = impossible_action(document, scene);
  if (at == nullptr)
    add_invalid({document.place.file, 0, 0}, "", invalid, problems);
  else
    add_invalid(at->place, at->path, invalid, problems);
}

void warn_of_oddities(const LocatedValue& document, const belief::Scene& scene, Problems& problems) {
  if (scene.supports.empty())
    problems.warn(document.place, "", "the scene has no support, so everything falls", "add a table or a 'ground'");
  if (scene.objects.empty() && !scene.new_objects)
    problems.warn(document.place, "", "the scene names no object, so there is nothing to track or to predict",
                  "name some under 'objects', or let tracking look for others with 'new_objects: true'");
  for (const belief::Action& action : scene.actions) {
    if (action.time <= scene.duration) continue;
    const LocatedValue& at = *document.find("actions");
    problems.warn(
        at.place, at.path,
        "an action is at " + number_text(action.time) + " s, after the end at " + number_text(scene.duration) + " s",
        "raise 'duration'");
  }
  if (const LocatedValue* objects = document.find("objects")) {
    warn_of_mass_ratios(*objects, scene, problems);
    warn_of_size_ratios(*objects, scene, problems);
  }
}

}  // namespace prescene::interfaces
