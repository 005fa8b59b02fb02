// SPDX-License-Identifier: Apache-2.0
// A camera's picture with the belief drawn over it.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/geometry/image.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {

/// The colour image, or the depth image in greys where there is none.
geometry::ColorImage picture_of(const belief::Observation& observation);

/// The published objects that are not lost, then the supports that were found in the sequence, then what is known
/// besides: the instance of the number that stands at its place in `names` is that object or support.
rendering::RenderScene drawn_belief(const belief::Scene& scene, const BeliefSummary& summary,
                                    const belief::Observation& observation, filter::MeshCache& meshes,
                                    std::vector<std::string>* names);

/// Draws where an object may be: the ellipse in the picture that holds 90 % of its position, to first order, dotted.
void draw_region(const ObjectSummary& object, const geometry::PinholeCamera& camera, const geometry::Pose& X_WC,
                 geometry::Rgb color, geometry::ColorImage& picture);

/// That picture with the outlines of all objects that are not lost, and of supports that were found, where the belief
/// has them, tinted where nothing known hides them; in the order of interfaces::series_color. Of objects that are
/// neither tracked nor lost, the region where they may be is dotted. Errors of Renderer::render.
core::Result<geometry::ColorImage> belief_overlay(const belief::Scene& scene, const BeliefSummary& summary,
                                                  const belief::Observation& observation, Backends& backends);

}  // namespace prescene::service
