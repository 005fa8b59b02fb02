// SPDX-License-Identifier: Apache-2.0
// What a valid scene may still not be meant to say.
#include <algorithm>

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

}  // namespace

void warn_of_oddities(const LocatedValue& document, const belief::Scene& scene, Problems& problems) {
  if (scene.supports.empty())
    problems.warn(document.place, "", "the scene has no support, so everything falls", "add a table or a 'ground'");
  for (const belief::Action& action : scene.actions) {
    if (action.time <= scene.duration) continue;
    const LocatedValue& at = *document.find("actions");
    problems.warn(
        at.place, at.path,
        "an action is at " + number_text(action.time) + " s, after the end at " + number_text(scene.duration) + " s",
        "raise 'duration'");
  }
  if (const LocatedValue* objects = document.find("objects")) warn_of_mass_ratios(*objects, scene, problems);
}

}  // namespace prescene::interfaces
