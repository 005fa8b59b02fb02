// SPDX-License-Identifier: Apache-2.0
// What a mesh file holds, and a model made of it.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/scene_files/model_file.h"

namespace prescene::service {

struct MeshInspectionOptions {
  interfaces::MeshReadOptions read;
  double density = 500.0;            ///< kg/m^3: about that of filled household packages.
  double symmetry_tolerance = 0.02;  ///< Of the surface, as a share of the mesh's radius.
  /// What the mesh is to collide as in a model made of it; else a scene goes by its shape
  /// (docs/reference/scene_files.md).
  std::optional<belief::MeshUse> use;
  core::ProgressSink progress;  ///< May be empty. `read.cancellation` stops all steps.
};

/// What the lockstep stepper makes of a mesh that collides as its convex hull (docs/reference/simulation.md).
struct LockstepHull {
  std::size_t vertices = 0;  ///< Of the hull.
  std::size_t kept = 0;      ///< Of the hull that is simulated.
  double error = 0.0;  ///< m, how far that stays behind at most (simulation::RoundedPolytope); 0 = it is the hull.
};

struct MeshInspection {
  std::filesystem::path path;
  interfaces::LoadedMesh loaded;
  geometry::MeshTopology topology;
  geometry::Box box;
  double surface_area = 0.0;                     ///< m^2
  std::optional<geometry::MassProperties> mass;  ///< At the density; empty when the mesh is not closed.
  /// Of the convex hull, when the mesh itself is not closed.
  std::optional<geometry::MassProperties> hull_mass;
  bool inside_out = false;  ///< It encloses a volume, but its triangles face inwards.
  double density = 0.0;
  geometry::SymmetryGroup symmetry;                  ///< A suggestion.
  std::vector<geometry::RestingPose> resting_poses;  ///< Likeliest first; empty for a flat mesh.
  /// Of a closed mesh the share of its convex hull that is hollow, see interfaces::hidden_hollow().
  std::optional<double> hollow;
  std::optional<LockstepHull> lockstep_hull;  ///< Empty for a flat mesh.
  std::optional<std::string> doubtful_scale;  ///< A sentence for a person, see interfaces::scale_hint().
  std::vector<std::string> remarks;           ///< Sentences for a person: hollows that get lost, holes, repairs.
};

core::Result<MeshInspection> inspect_mesh(const std::filesystem::path& path, const MeshInspectionOptions& options);

/// m. How high the origin of the mesh's frame, which a scene's `position` is of, is above what the mesh lies on.
/// `pose`: one of the inspection's.
double origin_height(const MeshInspection& inspection, const geometry::RestingPose& pose);

nlohmann::ordered_json to_json(const MeshInspection& inspection);
/// A model file that scene files can name (docs/reference/scene_files.md): the mesh, mass properties and symmetry, with
/// remarks as comments. `model_path` is where it will lie: the mesh is named relative to it. Fails with kInvalidInput
/// for a flat mesh, and where a scene could not use the model (of 100 m, say). The file says what the mesh collides as
/// only where the options do.
core::Result<interfaces::ModelFile> model_file(const MeshInspection& inspection, const MeshInspectionOptions& options,
                                               const std::filesystem::path& model_path);
/// "none", "continuous about z, both ways round", "4 turns about z", ...
std::string symmetry_text(const geometry::SymmetryGroup& symmetry);

}  // namespace prescene::service
