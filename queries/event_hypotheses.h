// SPDX-License-Identifier: Apache-2.0
// Which events of which objects are weighed, and how probable each is before the frames were seen.
#pragma once

#include <vector>

#include "event_paths.h"
#include "prescene/filter/proposals/render_scene.h"

namespace prescene::queries {

/// Those of the candidates that can be and have a weight. The weight of a kind is shared by all objects that it may
/// happen to, candidates or not. `meshes` knows which objects have the same shape.
std::vector<Hypothesis> hypotheses_about(const std::vector<std::size_t>& candidates, const EventPaths& events,
                                         const belief::EventWeights& weights, filter::MeshCache& meshes);

}  // namespace prescene::queries
