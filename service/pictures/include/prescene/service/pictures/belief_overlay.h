// SPDX-License-Identifier: Apache-2.0
// A camera's picture with the belief drawn over it.
#pragma once

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {

/// The colour image, or the depth image in greys where there is none.
geometry::ColorImage picture_of(const belief::Observation& observation);

/// That picture with the outlines of all objects that are not lost, and of supports that were found, where the belief
/// has them, tinted where nothing known hides them; in the order of interfaces::series_color. Errors of
/// Renderer::render.
core::Result<geometry::ColorImage> belief_overlay(const belief::Scene& scene, const BeliefSummary& summary,
                                                  const belief::Observation& observation, Backends& backends);

}  // namespace prescene::service
