// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/mesh_inspection.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "lockstep_hull.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/cancellable.h"
#include "prescene/interfaces/scene_files/mesh_use.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

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

namespace {

/// Says which step is being done; the shares are those of an open sphere of a million triangles.
class Steps {
 public:
  explicit Steps(const MeshInspectionOptions& options) : options_(options) {}

  core::Status begin(double fraction, const char* what) const {
    if (options_.progress) options_.progress({fraction, {}, what});
    if (options_.read.cancellation && options_.read.cancellation->requested())
      return core::cancelled("the inspection was stopped");
    return core::ok_status();
  }

 private:
  const MeshInspectionOptions& options_;
};

/// What becomes of hollows in a scene.
std::optional<std::string> hollow_remark(const MeshInspection& found, const MeshInspectionOptions& options) {
  const auto fills = [&] {
    return options.use == belief::MeshUse::kConvexHull || options.use == belief::MeshUse::kConvexParts;
  };
  if (!found.mass && found.hull_mass && found.inside_out && (!options.use || fills()))
    return "in a scene it collides as its convex hull, because it is inside out: nothing gets into its hollows; turn "
           "its triangles around";
  if (!found.mass && found.hull_mass && (!options.use || fills()))
    return "in a scene it collides as its convex hull, because it is not closed: nothing gets into its hollows; close "
           "it";
  if (!found.hollow || *found.hollow <= interfaces::kLargestHiddenHollow) return std::nullopt;
  const std::string share = core::fixed_text(100.0 * *found.hollow, 0) + " % of its convex hull is hollow";
  if (fills())
    return share + ", and with use: " + interfaces::word_of(*options.use) +
           " nothing gets into that; leave --use out, or choose spheres or decompose";
  if (options.use) return std::nullopt;
  return share + ": in a scene it collides as spheres, which keep that, unless the key 'use' says otherwise";
}

/// The solid angle of the closed surface as seen from `p`, over that of a sphere: 1 inside, 0 outside
/// (Van Oosterom & Strackee 1983, each triangle).
double winding_number(const geometry::TriangleMesh& mesh, const geometry::Vector3d& p) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    const geometry::Vector3d a = mesh.vertices[t[0]] - p;
    const geometry::Vector3d b = mesh.vertices[t[1]] - p;
    const geometry::Vector3d c = mesh.vertices[t[2]] - p;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (2.0 * std::numbers::pi);
}

/// A part that is inside out is a cavity where it lies in another part; elsewhere its volume would be subtracted.
std::optional<std::string> reversed_parts_remark(const geometry::TriangleMesh& mesh) {
  constexpr std::size_t kLooks = 16;  // Vertices of a part at which is looked; a part that sticks out shows by a few.
  constexpr std::size_t kMostParts = 32;  // At each vertex the whole mesh is gone through.
  std::vector<geometry::TriangleMesh> cavities;
  geometry::TriangleMesh solid;
  for (geometry::TriangleMesh& part : geometry::connected_components(mesh)) {
    if (geometry::signed_volume(part) < 0.0) {
      if (cavities.size() < kMostParts) cavities.push_back(std::move(part));
      continue;
    }
    const auto first = static_cast<std::uint32_t>(solid.vertices.size());
    solid.vertices.insert(solid.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) solid.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  std::size_t parts = 0;
  std::size_t triangles = 0;
  for (const geometry::TriangleMesh& part : cavities) {
    const std::size_t stride = std::max<std::size_t>(1, part.vertices.size() / kLooks);
    bool outside = false;
    for (std::size_t i = 0; i < part.vertices.size() && !outside; i += stride)
      outside = winding_number(solid, part.vertices[i]) < 0.5;
    if (!outside) continue;
    ++parts;
    triangles += part.triangles.size();
  }
  if (parts == 0) return std::nullopt;
  return std::to_string(parts) + (parts == 1 ? " part" : " parts") + " of " + std::to_string(triangles) +
         " triangles that lie outside of the others are inside out, so that their volume is subtracted: turn these "
         "triangles around, or give the mass yourself";
}

/// What belongs to a unit or density that is none.
core::Status check_sizes(const MeshInspection& found) {
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  const bool finite = found.box.sizes().allFinite() && std::isfinite(found.surface_area) &&
                      (!mass || (std::isfinite(mass->mass) && mass->p_BoBcm.allFinite() && mass->I_BBcm_B.allFinite()));
  if (finite) return core::ok_status();
  return core::invalid_input(found.path.string() +
                             ": sizes or masses are beyond all numbers: choose another --scale or --density");
}

/// As `validate` checks the file. The mesh is the one that was found.
core::Status check_model(const interfaces::ModelFile& file, const MeshInspection& found,
                         const std::filesystem::path& model_path) {
  interfaces::SceneFileOptions options;
  options.read_mesh = [&found](const interfaces::MeshRequest&) -> core::Result<geometry::TriangleMesh> {
    return found.loaded.mesh;
  };
  core::Status status =
      interfaces::parse_model(interfaces::model_yaml(file), model_path.string(), model_path.stem().string(), options)
          .status();
  if (status.ok()) return status;
  return core::invalid_input(found.path.string() + ": a model of it would not be valid: choose another --scale or " +
                             "--density\n" + status.message());
}

}  // namespace

core::Result<MeshInspection> inspect_mesh(const std::filesystem::path& path, const MeshInspectionOptions& options) {
  const Steps steps(options);
  MeshInspection found;
  found.path = path;
  found.density = options.density;
  PRESCENE_RETURN_IF_ERROR(steps.begin(0.0, "reading and repairing"));
  PRESCENE_TRY(found.loaded, interfaces::read_mesh(path, options.read));
  const geometry::TriangleMesh& mesh = found.loaded.mesh;
  PRESCENE_RETURN_IF_ERROR(steps.begin(0.3, "edges"));
  found.topology = geometry::mesh_topology(mesh);
  found.box = geometry::bounding_box(mesh);
  found.doubtful_scale = interfaces::scale_hint(found.box, options.read.metres_per_unit);
  found.surface_area = geometry::surface_area(mesh);
  found.remarks = found.loaded.warnings;
  if (found.loaded.unread_look)
    found.remarks.push_back(std::string(interfaces::kUnreadLook) + ": " + std::string(interfaces::kUnreadLookRemedy));

  PRESCENE_RETURN_IF_ERROR(steps.begin(0.35, "mass"));
  const auto closed = geometry::mass_properties(mesh, options.density);
  if (closed) {
    found.mass = *closed;
  } else {
    found.inside_out = found.topology.bounds_volume() && geometry::signed_volume(mesh) < 0.0;
    found.remarks.push_back(found.inside_out
                                ? "inside out: its triangles are clockwise seen from outside; turn them around"
                                : "no volume of its own: " + closed.status().message());
  }
  if (closed && found.topology.components > 1) {
    if (auto remark = reversed_parts_remark(mesh)) found.remarks.push_back(*std::move(remark));
  }
  PRESCENE_RETURN_IF_ERROR(steps.begin(0.4, "convex hull"));
  auto hull = geometry::convex_hull(mesh.vertices, options.read.cancellation);
  if (!hull && hull.status().code() == core::StatusCode::kCancelled) return hull.status();
  if (hull) {
    const auto hull_mass = geometry::mass_properties(*hull, options.density);
    if (hull_mass && closed) found.hollow = std::max(0.0, 1.0 - closed->mass / hull_mass->mass);
    if (hull_mass && !closed) found.hull_mass = *hull_mass;
  } else {
    found.remarks.push_back("flat: " + hull.status().message());
  }
  PRESCENE_RETURN_IF_ERROR(check_sizes(found));
  if (auto remark = hollow_remark(found, options)) found.remarks.push_back(*std::move(remark));

  PRESCENE_RETURN_IF_ERROR(steps.begin(0.65, "simplified hull"));
  if (hull) {
    if (const auto simplified = lockstep_hull(*hull)) found.lockstep_hull = *simplified;
  }
  PRESCENE_RETURN_IF_ERROR(steps.begin(0.75, "symmetry"));
  const double radius = 0.5 * found.box.diagonal().norm();
  found.symmetry = geometry::suggest_symmetry(mesh, options.symmetry_tolerance * radius);
  PRESCENE_RETURN_IF_ERROR(steps.begin(0.85, "resting poses"));
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  if (mass && hull) {
    const auto poses = geometry::resting_poses_of_hull(*std::move(hull), mass->p_BoBcm);
    if (poses) {
      found.resting_poses = *poses;
    } else {
      found.remarks.push_back("no resting poses: " + poses.status().message());
    }
  }
  PRESCENE_RETURN_IF_ERROR(steps.begin(1.0, ""));
  return found;
}

double origin_height(const MeshInspection& found, const geometry::RestingPose& pose) {
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  return pose.height - (pose.R_WB * mass->p_BoBcm).z();
}

ordered_json to_json(const MeshInspection& found) {
  ordered_json poses = ordered_json::array();
  for (const geometry::RestingPose& pose : found.resting_poses) {
    const geometry::Quaterniond& R = pose.R_WB;
    poses.push_back({{"rotation", {{"quaternion_wxyz", {R.w(), R.x(), R.y(), R.z()}}}},
                     {"height", pose.height},
                     {"origin_height", origin_height(found, pose)},
                     {"tip_angle_deg", pose.tip_angle * geometry::kDegreesPerRadian},
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
  json["hollow_share_of_hull"] = found.hollow ? ordered_json(*found.hollow) : ordered_json();
  json["lockstep_hull"] = found.lockstep_hull ? ordered_json({{"vertices", found.lockstep_hull->vertices},
                                                              {"kept", found.lockstep_hull->kept},
                                                              {"error", found.lockstep_hull->error}})
                                              : ordered_json();
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
  file.use = options.use;
  file.model.mass = belief::FixedScalar{mass->mass};
  file.model.center_of_mass = belief::Vector3Distribution::fixed(mass->p_BoBcm);
  file.model.unit_inertia = mass->I_BBcm_B / mass->mass;
  file.model.symmetry = found.symmetry;
  file.remarks = {"Made from " + found.path.filename().string() +
                  "; a scene names it as {file: " + model_path.filename().string() + "}."};
  file.remarks.insert(file.remarks.end(), found.remarks.begin(), found.remarks.end());
  file.remarks.push_back("The mass is that of " + core::rounded_text(found.density) + " kg/m^3" +
                         (found.mass ? "" : " in its convex hull") + ": weigh the object.");
  PRESCENE_RETURN_IF_ERROR(check_model(file, found, model_path));
  return file;
}

}  // namespace prescene::service
