// SPDX-License-Identifier: Apache-2.0
// Meshes that the near plane cuts, face by face.
#pragma once

#include "pose_tile.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

/// As draw() (pose_kernels.h) of the part from near_depth (m) on.
void draw_cut(const RenderMesh& mesh, const PoseProjection& seen, float near_depth, PoseTile* tile);

}  // namespace prescene::rendering
