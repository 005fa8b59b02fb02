// SPDX-License-Identifier: Apache-2.0
// Plans of what a hand does with a thing: one of the scene's own actions, or one like it, some numbers of which are
// searched. Whatever is neither free nor given stays as the scene has it, with its distribution.
#pragma once

#include "planned_action.h"

namespace prescene::queries {

/// The last of the scene's own actions of a kind ("tilt") that moves an object; of move_joint, what hangs on the joint.
std::optional<std::size_t> own_action(const belief::Scene& scene, const std::string& kind, const std::string& object);
/// The one object that the scene's own actions of this kind move; empty if they move none or several.
std::string object_of_own(const belief::Scene& scene, const std::string& kind);

/// "tilt", "pour", "insert", "grasp", "pull", "move_joint" and "transport". `index` is that of the object in the
/// prior's scene. kInvalidInput where the scene lacks what a parameter that is searched or given is about.
core::Result<std::unique_ptr<PlannedAction>> plan_own_action(const Prior& prior, const belief::AchieveQuery& query,
                                                             const std::string& kind, std::size_t index,
                                                             std::vector<SceneValue>& scene_values);

}  // namespace prescene::queries
