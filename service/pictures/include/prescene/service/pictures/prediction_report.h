// SPDX-License-Identifier: Apache-2.0
// The page about one prediction, and the page about one mesh.
#pragma once

#include <filesystem>

#include "prescene/belief/query.h"
#include "prescene/service/backends.h"
#include "prescene/service/mesh_inspection.h"

namespace prescene::service {

/// `answer` holds a PredictAnswer made from `scene`'s priors. With a camera in the scene, its view with the final
/// positions painted in.
core::Status write_prediction_report(const std::filesystem::path& path, const belief::Scene& scene,
                                     const belief::Answer& answer, Backends& backends);

/// Views of the mesh and of its likeliest resting poses.
core::Status write_mesh_report(const std::filesystem::path& path, const MeshInspection& inspection);

}  // namespace prescene::service
