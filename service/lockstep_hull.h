// SPDX-License-Identifier: Apache-2.0
// How far the hulls that lockstep simulates stay behind those of a mesh.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/mesh_inspection.h"

namespace prescene::service {

/// Of the shape in a scene alone. `hull` is the convex hull of a mesh. Fails with kInvalidInput where it has no
/// thickness.
core::Result<LockstepHull> lockstep_hull(const geometry::TriangleMesh& hull);

/// A remark on each model, support and robot body with a hull that stays behind by more than 1 % of the diagonal of its
/// mesh's box. `path` is that of the scene file.
void remark_on_simplified_hulls(const belief::Scene& scene, const std::string& path, interfaces::FileReport& report);
/// The same of a model file.
void remark_on_simplified_hulls(const belief::ObjectModel& model, const std::string& path,
                                interfaces::FileReport& report);

}  // namespace prescene::service
