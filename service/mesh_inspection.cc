// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/mesh_inspection.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

constexpr double kDegrees = 180.0 / std::numbers::pi;

ordered_json vector_json(const geometry::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json mass_json(const geometry::MassProperties& mass) {
  ordered_json inertia = ordered_json::array();
  for (Eigen::Index row = 0; row < 3; ++row) {
    inertia.push_back({mass.I_BBcm_B(row, 0), mass.I_BBcm_B(row, 1), mass.I_BBcm_B(row, 2)});
  }
  return {{"mass", mass.mass}, {"center_of_mass", vector_json(mass.p_BoBcm)}, {"inertia", inertia}};
}

/// The axis's letter where it is one, else its direction.
std::string axis_text(const geometry::Vector3d& axis) {
  constexpr const char* kLetters[] = {"x", "y", "z"};
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (std::abs(axis[i]) > 1.0 - 1e-9) return kLetters[i];
  }
  return "[" + core::rounded_text(axis.x()) + ", " + core::rounded_text(axis.y()) + ", " +
         core::rounded_text(axis.z()) + "]";
}

/// Whether half turns exchange the ends of the continuous axis.
bool flips(const geometry::SymmetryGroup& symmetry) {
  return symmetry.axis &&
         std::any_of(symmetry.rotations.begin(), symmetry.rotations.end(),
                     [&](const geometry::Quaterniond& R) { return (R * *symmetry.axis).dot(*symmetry.axis) < -0.5; });
}

/// Number of turns when the finite group is cyclic, with its axis; 0 otherwise.
int cyclic_order(const geometry::SymmetryGroup& symmetry, geometry::Vector3d* axis) {
  if (symmetry.rotations.empty()) return 0;
  *axis = geometry::log_rotation(symmetry.rotations.front()).normalized();
  for (const geometry::Quaterniond& rotation : symmetry.rotations) {
    if (std::abs(std::abs(geometry::log_rotation(rotation).normalized().dot(*axis)) - 1.0) > 1e-6) return 0;
  }
  return static_cast<int>(symmetry.rotations.size()) + 1;
}

}  // namespace

std::string symmetry_text(const geometry::SymmetryGroup& symmetry) {
  if (symmetry.trivial()) return "none";
  if (symmetry.ball) return "every rotation";
  if (symmetry.axis)
    return "continuous about " + axis_text(*symmetry.axis) + (flips(symmetry) ? ", both ways round" : "");
  geometry::Vector3d axis;
  if (const int order = cyclic_order(symmetry, &axis); order > 1)
    return std::to_string(order) + " turns about " + axis_text(axis);
  return std::to_string(symmetry.rotations.size() + 1) + " rotations about several axes";
}

core::Result<MeshInspection> inspect_mesh(const std::filesystem::path& path, const MeshInspectionOptions& options) {
  MeshInspection found;
  found.path = path;
  found.density = options.density;
  PRESCENE_TRY(found.loaded, interfaces::read_mesh(path, options.read));
  const geometry::TriangleMesh& mesh = found.loaded.mesh;
  found.topology = geometry::mesh_topology(mesh);
  found.box = geometry::bounding_box(mesh);
  found.surface_area = geometry::surface_area(mesh);
  found.remarks = found.loaded.warnings;

  const auto closed = geometry::mass_properties(mesh, options.density);
  if (closed) {
    found.mass = *closed;
  } else {
    found.remarks.push_back("no volume of its own: " + closed.status().message());
  }
  const auto hull = geometry::convex_hull(mesh.vertices);
  if (hull && !closed) {
    const auto hull_mass = geometry::mass_properties(*hull, options.density);
    if (hull_mass) found.hull_mass = *hull_mass;
  }
  if (!hull) found.remarks.push_back("flat: " + hull.status().message());

  const double radius = 0.5 * found.box.diagonal().norm();
  found.symmetry = geometry::suggest_symmetry(mesh, options.symmetry_tolerance * radius);
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  if (mass) {
    const auto poses = geometry::resting_poses(mesh, mass->p_BoBcm);
    if (poses) {
      found.resting_poses = *poses;
    } else {
      found.remarks.push_back("no resting poses: " + poses.status().message());
    }
  }
  return found;
}

ordered_json to_json(const MeshInspection& found) {
  ordered_json poses = ordered_json::array();
  for (const geometry::RestingPose& pose : found.resting_poses) {
    const geometry::Quaterniond& R = pose.R_WB;
    poses.push_back({{"rotation", {R.w(), R.x(), R.y(), R.z()}},
                     {"height", pose.height},
                     {"tip_angle_deg", pose.tip_angle * kDegrees},
                     {"probability", pose.probability}});
  }
  ordered_json json = {{"file", found.path.string()},
                       {"vertices", found.loaded.mesh.vertices.size()},
                       {"triangles", found.loaded.mesh.triangles.size()},
                       {"watertight", found.topology.watertight()},
                       {"oriented", found.topology.oriented()},
                       {"open_edges", found.topology.open_edges},
                       {"non_manifold_edges", found.topology.non_manifold_edges},
                       {"components", found.topology.components},
                       {"box_min", vector_json(found.box.min())},
                       {"box_size", vector_json(found.box.sizes())},
                       {"surface_area", found.surface_area},
                       {"density", found.density}};
  json["solid"] = found.mass ? mass_json(*found.mass) : ordered_json();
  json["hull"] = found.hull_mass ? mass_json(*found.hull_mass) : ordered_json();
  json["volume"] = found.mass ? ordered_json(found.mass->mass / found.density) : ordered_json();
  json["symmetry"] = symmetry_text(found.symmetry);
  json["resting_poses"] = poses;
  json["remarks"] = found.remarks;
  return json;
}

core::Result<interfaces::ModelFile> model_file(const MeshInspection& found, const MeshInspectionOptions& options,
                                               const std::filesystem::path& model_path) {
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  if (!mass) return core::invalid_input(found.path.string() + ": flat: a model needs a volume");
  std::error_code ignored;
  const auto folder = std::filesystem::absolute(model_path, ignored).parent_path();
  const auto relative = std::filesystem::relative(std::filesystem::absolute(found.path, ignored), folder, ignored);
  interfaces::ModelFile file;
  file.mesh_file = relative.empty() ? found.path.string() : relative.generic_string();
  file.scale = options.read.metres_per_unit;
  file.y_up = options.read.up_axis == interfaces::UpAxis::kY;
  file.model.mass = belief::FixedScalar{mass->mass};
  file.model.center_of_mass = belief::Vector3Distribution::fixed(mass->p_BoBcm);
  file.model.unit_inertia = mass->I_BBcm_B / mass->mass;
  file.model.symmetry = found.symmetry;
  file.remarks = {"Made from " + found.path.filename().string() +
                  "; a scene names it as {file: " + model_path.filename().string() + "}."};
  file.remarks.insert(file.remarks.end(), found.remarks.begin(), found.remarks.end());
  file.remarks.push_back("The mass is that of " + core::rounded_text(found.density) + " kg/m^3" +
                         (found.mass ? "" : " in its convex hull") + ": weigh the object.");
  return file;
}

}  // namespace prescene::service
