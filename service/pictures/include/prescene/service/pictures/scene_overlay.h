// SPDX-License-Identifier: Apache-2.0
// A frame compared with what a scene file says is there, before anything is tracked: whether the camera's pose and the
// scene's supports are right shows best in a picture.
#pragma once

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/service/backends.h"

namespace prescene::service {

/// How the depth of a frame agrees with the scene's supports and robot bodies.
struct SurroundingsFit {
  double in_view = 0.0;            ///< Share of the image's pixels where they should be seen.
  double measured = 0.0;           ///< Of these, share with depth.
  double fitting = 0.0;            ///< Of those, share within 2 cm, or 2 % of the depth if that is more.
  double median_difference = 0.0;  ///< Of those, measured minus expected depth, m; 0 where nothing is measured.
};

struct SceneOverlay {
  /// The frame's picture with the outlines of supports, robot bodies (as observed) and objects at the means of their
  /// starts, tinted where nothing of the scene hides them, and named. Objects that may lie anyhow are left out.
  geometry::ColorImage picture;
  SurroundingsFit fit;
};

/// Errors of Renderer::render.
core::Result<SceneOverlay> scene_overlay(const belief::Scene& scene, const belief::Observation& observation,
                                         Backends& backends);

}  // namespace prescene::service
