// SPDX-License-Identifier: Apache-2.0
// The scene of a belief as JSON: how it differs from the one that was given.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "prescene/belief/scene.h"

namespace prescene::service {

/// The names of what `scene` has of `given`, with what holds each object; and what was found and `given` does not have:
/// supports, objects, and models of new objects.
nlohmann::ordered_json scene_json(const belief::Scene& scene, const belief::Scene& given);
/// `given` itself where nothing differs. Null where the text is none that scene_json() wrote of such a scene.
std::shared_ptr<const belief::Scene> scene_from(const nlohmann::ordered_json& json,
                                                const std::shared_ptr<const belief::Scene>& given);

}  // namespace prescene::service
