// SPDX-License-Identifier: Apache-2.0
#include "bop_models.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "prescene/filter/proposals/render_scene.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/rendering/surface_color.h"

namespace prescene::service {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;
using nlohmann::ordered_json;

constexpr double kMillimetres = 1000.0;  // in a metre

/// What cameras see of the model (MeshCache), in mm.
TriangleMesh mesh_in_mm(const belief::ObjectModel& model) {
  return geometry::scaled(model.visual ? *model.visual : belief::collision_mesh(model), kMillimetres);
}

/// Sums of the triangles' normals, weighted by the angle at the vertex [Thurmer 1998].
std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3d> normals(mesh.vertices.size(), Vector3d::Zero());
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vector3d& at = mesh.vertices[triangle[corner]];
      const Vector3d next = mesh.vertices[triangle[(corner + 1) % 3]] - at;
      const Vector3d last = mesh.vertices[triangle[(corner + 2) % 3]] - at;
      const Vector3d normal = next.cross(last);
      const double length = normal.norm();
      if (length > 0.0) normals[triangle[corner]] += std::atan2(length, next.dot(last)) / length * normal;
    }
  }
  for (Vector3d& normal : normals) {
    const double length = normal.norm();
    normal = length > 0.0 ? Vector3d(normal / length) : Vector3d::UnitZ();
  }
  return normals;
}

/// A texture becomes the mean of its colours at the vertex.
std::vector<geometry::Rgb> vertex_colors(const belief::ObjectModel& model, const TriangleMesh& mesh) {
  std::vector<geometry::Rgb> colors(mesh.vertices.size(), filter::material_of(model.surface, model.color).color);
  if (!model.visual || !model.look) return colors;
  const geometry::MeshLook& look = *model.look;
  if (look.texture_places.empty()) return look.vertex_colors.empty() ? colors : look.vertex_colors;
  std::vector<rendering::LinearRgb> sums(colors.size(), rendering::LinearRgb::Zero());
  std::vector<int> counts(colors.size(), 0);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = mesh.triangles[i][corner];
      sums[vertex] += rendering::texture_at(*look.texture, look.texture_places[i][corner].cast<double>());
      ++counts[vertex];
    }
  }
  for (std::size_t i = 0; i < colors.size(); ++i)
    if (counts[i] > 0) colors[i] = rendering::srgb(sums[i] / counts[i]);
  return colors;
}

/// The largest distance of two vertices.
double diameter_of(const TriangleMesh& mesh) {
  const auto hull = geometry::convex_hull(mesh.vertices);
  std::vector<Vector3d> points = hull ? hull->vertices : mesh.vertices;
  // From the outermost inwards: what is nearer to the centre than half of the best has no better partner.
  const Vector3d centre = geometry::bounding_box(mesh).center();
  std::sort(points.begin(), points.end(), [&](const Vector3d& a, const Vector3d& b) {
    return (a - centre).squaredNorm() > (b - centre).squaredNorm();
  });
  double largest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double radius = (points[i] - centre).norm();
    for (std::size_t j = i + 1; j < points.size() && radius + (points[j] - centre).norm() > largest; ++j)
      largest = std::max(largest, (points[i] - points[j]).norm());
  }
  return largest;
}

ordered_json three(const Vector3d& v) { return ordered_json::array({v.x(), v.y(), v.z()}); }

ordered_json turn_about(const Vector3d& axis, const Vector3d& p_OoC) {
  return {{"axis", three(axis)}, {"offset", three(kMillimetres * p_OoC)}};
}

/// Row by row, 4 x 4.
ordered_json rotation_about(const geometry::Quaterniond& rotation, const Vector3d& p_OoC) {
  const geometry::Matrix3d R = rotation.normalized().toRotationMatrix();
  const Vector3d moved = kMillimetres * (p_OoC - R * p_OoC);
  ordered_json matrix = ordered_json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix.push_back(R(row, column));
    matrix.push_back(moved[row]);
  }
  for (const double value : {0.0, 0.0, 0.0, 1.0}) matrix.push_back(value);
  return matrix;
}

void add_symmetries(const geometry::SymmetryGroup& group, ordered_json& info) {
  ordered_json turns = ordered_json::array();
  if (group.ball) {
    for (int i = 0; i < 3; ++i) turns.push_back(turn_about(Vector3d::Unit(i), group.p_BoC));
  } else {
    ordered_json rotations = ordered_json::array();
    for (const auto& rotation : group.rotations) rotations.push_back(rotation_about(rotation, group.p_BoC));
    if (!rotations.empty()) info["symmetries_discrete"] = rotations;
    if (group.axis) turns.push_back(turn_about(*group.axis, group.p_BoC));
  }
  if (!turns.empty()) info["symmetries_continuous"] = turns;
}

}  // namespace

std::string bop_model_ply(const belief::ObjectModel& model) {
  const TriangleMesh mesh = mesh_in_mm(model);
  return interfaces::encode_ply(mesh, interfaces::MeshEncoding::kText, vertex_colors(model, mesh),
                                vertex_normals(mesh));
}

ordered_json bop_model_info(const belief::ObjectModel& model) {
  const TriangleMesh mesh = mesh_in_mm(model);
  const geometry::Box box = geometry::bounding_box(mesh);
  ordered_json info = {{"diameter", diameter_of(mesh)}, {"min_x", box.min().x()},    {"min_y", box.min().y()},
                       {"min_z", box.min().z()},        {"size_x", box.sizes().x()}, {"size_y", box.sizes().y()},
                       {"size_z", box.sizes().z()}};
  add_symmetries(model.symmetry, info);
  return info;
}

}  // namespace prescene::service
