// SPDX-License-Identifier: Apache-2.0
// What the page gets of a scene and of a belief step, as JSON, and the pictures beside it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {

/// A step to be shown: a snapshot and the frame that made it. Cheap to hand over: belief and images are shared.
struct ShownStep {
  std::shared_ptr<const belief::Belief> belief;
  belief::Observation observation;
  double seconds = 0.0;  ///< Wall time that the step took.
  std::vector<std::string> degraded;
  std::shared_ptr<const BeliefSummary> summary = {};  ///< As published; null = that of `belief`.
  /// Of several cameras the newest frame of each by its number, this step's among them; empty where there is one.
  std::map<int, belief::Observation> frames = {};
};
BeliefSummary summary_of(const ShownStep& step);

/// {"op": "scene", "name", "cameras": [name...] (of several), "gravity", "models": [{"name", "color", "mesh"}],
/// "objects": [{"name", "model"}], "supports": [{"name", "color", "mesh", "pose"}], "robot": the same}. A mesh is
/// {"vertices": [x, y, z, ...], "triangles": [a, b, c, ...]}, of at most some thousand triangles; a pose [x, y, z, qw,
/// qx, qy, qz].
nlohmann::ordered_json scene_document(const belief::Scene& scene);
/// Equal for scenes whose documents differ in poses at most, which steps contain.
std::uint64_t scene_shape_hash(const belief::Scene& scene);

/// {"op": "step", "index", "step", "stamp_ns", "objects": [{"name", "state", "held_by" (the hand, or null),
/// "confidence", "existence", "pose", "spread" (m, standard deviation of the position), "speed", "visible_share",
/// "parameters", "lessons", "ghosts": [pose...] (particles by weight, at most 24, without those near the mean),
/// "region": [x, y, z, ...] (positions drawn from the belief, only where the object is not tracked)}], "camera":
/// {"pose", "width", "height", "fx", "fy", "cx", "cy"}, "cameras" (of several; the same by number, null where a camera
/// has given no frame), "robot": [pose...], "supports": [pose...], "seconds", "degraded"}
nlohmann::ordered_json step_document(const ShownStep& step, const BeliefSummary& summary, std::uint64_t index);

/// The camera's picture as a JPEG of at most `most_width` pixels across, made smaller by a whole factor.
std::string picture_jpeg(const belief::Observation& observation, int most_width, int quality);

}  // namespace prescene::service
