// SPDX-License-Identifier: Apache-2.0
// Depth frames of imagined scenes: some of a scene's models and things that nobody knows of, put down and dropped,
// settled by physics, seen by a camera with noise; and the truth.
#pragma once

#include <memory>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/random.h"
#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/rendering/renderer.h"
#include "prescene/service/backends.h"

namespace prescene::service {

struct ImaginedObject {
  int model = 0;  ///< Index into the models of the scene that was given.
  geometry::Pose X_WO;
  bool expected = false;  ///< Enough of it is visible to expect that it is found.
};

struct ImaginedFrame {
  /// All models; objects of those that are looked for, there or not, anywhere; some or all of the supports.
  std::shared_ptr<const belief::Scene> scene;
  belief::Observation observation;
  std::vector<ImaginedObject> truth;
};

/// `rests` of each of the scene's models. Everything is drawn from `draws`.
core::Result<ImaginedFrame> imagine_frame(const belief::Scene& given,
                                          const std::vector<std::vector<filter::LearnedRest>>& rests,
                                          Backends& backends, rendering::Renderer& renderer, core::RandomStream draws);

}  // namespace prescene::service
