// SPDX-License-Identifier: Apache-2.0
// What the triangles of a round surface wrongly say: depth residuals take the facets of a cylinder for faces, and would
// tell how it is turned about its axis.
#pragma once

#include "prescene/geometry/pose.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::filter {

/// By how much flat triangles move the foot of a normal along a surface that is round in truth, m (root of the mean
/// square over the area of such triangles): those that meet others at 1 to 30 degrees, by their width. 0 where there
/// are none.
double facet_lever(const rendering::RenderMesh& mesh);

/// Takes from Gauss-Newton equations (coordinates of rendering::PoseLinearisation) what facets alone say of rotations
/// about the axes of the body through p_OQ, wherever the axis of the round part is: errors of the levers add their
/// square to the information. It is taken from what is known of such a turn with everything else free to follow, so
/// that H stays positive semi-definite.
void without_facets(double facet_lever, const geometry::Quaterniond& R_CO, const geometry::Vector3d& p_OQ,
                    geometry::Matrix6d& H, geometry::Vector6d& g);

}  // namespace prescene::filter
