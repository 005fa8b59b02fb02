// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "mesh_parts.h"
#include "prescene/collision/exact_triangles.h"
#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

constexpr std::size_t kMostTriangles = std::size_t{1} << 30U;

core::Status refuse(std::string_view name, const std::string& what) {
  return core::invalid_input("mesh '" + std::string(name) + "': " + what);
}

core::Status check(const std::vector<Vector3f>& vertices, const std::vector<TriangleIndices>& triangles,
                   std::string_view name) {
  if (triangles.empty()) return refuse(name, "it has no triangles; give a mesh with at least one");
  if (triangles.size() > kMostTriangles) {
    return refuse(name, "it has " + std::to_string(triangles.size()) + " triangles; at most " +
                            std::to_string(kMostTriangles) + " are allowed: simplify or split it");
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const std::uint32_t index : triangles[i]) {
      if (index >= vertices.size()) {
        return refuse(name, "triangle " + std::to_string(i) + " uses vertex " + std::to_string(index) + " of " +
                                std::to_string(vertices.size()) + "; mend its indices or drop it (repair_mesh does)");
      }
    }
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vector3f& p = vertices[i];
    if (!p.allFinite()) {
      return refuse(name, "vertex " + std::to_string(i) + " is not finite; mend or drop it (repair_mesh does)");
    }
    const float largest = p.cwiseAbs().maxCoeff();
    if (largest > kLargestCoordinate) {
      return refuse(name, "vertex " + std::to_string(i) + " has a coordinate of " + std::to_string(largest) +
                              " m; the limit is 1e9 m: check the unit of the file");
    }
  }
  return core::ok_status();
}

MeshReport examine(const std::vector<Vector3f>& vertices, const std::vector<TriangleIndices>& triangles) {
  MeshReport report;
  using Corners = std::array<std::array<float, 3>, 3>;
  std::vector<Corners> sorted(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const TriangleIndices& t = triangles[i];
    if (is_degenerate({vertices[t[0]], vertices[t[1]], vertices[t[2]]})) ++report.degenerate_triangles;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3f& p = vertices[t[k]];
      sorted[i][k] = {p.x(), p.y(), p.z()};
    }
    std::sort(sorted[i].begin(), sorted[i].end());
  }
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] == sorted[i - 1]) ++report.duplicate_triangles;
  }
  return report;
}

}  // namespace

std::string MeshReport::text() const {
  std::string text;
  if (degenerate_triangles > 0) text = std::to_string(degenerate_triangles) + " triangles without area";
  if (duplicate_triangles > 0) {
    text += (text.empty() ? "" : ", ") + std::to_string(duplicate_triangles) + " duplicate triangles";
  }
  return text;
}

core::Result<std::shared_ptr<const Mesh>> Mesh::make(const geometry::TriangleMesh& mesh, std::string_view name) {
  std::vector<Vector3f> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const geometry::Vector3d& p : mesh.vertices) vertices.emplace_back(p.cast<float>());
  return make(std::move(vertices), mesh.triangles, name);
}

core::Result<std::shared_ptr<const Mesh>> Mesh::make(std::vector<Vector3f> vertices,
                                                     std::vector<TriangleIndices> triangles, std::string_view name) {
  PRESCENE_RETURN_IF_ERROR(check(vertices, triangles, name));
  std::shared_ptr<Mesh> mesh(new Mesh());
  mesh->vertices_ = std::move(vertices);
  mesh->triangles_ = std::move(triangles);
  mesh->name_ = name;
  mesh->report_ = examine(mesh->vertices_, mesh->triangles_);

  core::Hasher hasher;
  hasher.value(mesh->vertices_.size()).value(mesh->triangles_.size());
  hasher.bytes(mesh->vertices_.data(), mesh->vertices_.size() * sizeof(Vector3f));
  hasher.bytes(mesh->triangles_.data(), mesh->triangles_.size() * sizeof(TriangleIndices));
  mesh->content_hash_ = hasher.digest();

  Vector3f low = mesh->vertices_[mesh->triangles_[0][0]];
  Vector3f high = low;
  for (const TriangleIndices& t : mesh->triangles_) {
    for (const std::uint32_t index : t) {
      low = low.cwiseMin(mesh->vertices_[index]);
      high = high.cwiseMax(mesh->vertices_[index]);
    }
  }
  mesh->size_ = static_cast<float>((high - low).cast<double>().norm());
  return std::shared_ptr<const Mesh>(std::move(mesh));
}

const std::vector<Vector3f>& Mesh::corners_of_parts() const {
  std::call_once(parts_found_, [this] { corners_of_parts_ = collision::corners_of_parts(vertices_, triangles_); });
  return corners_of_parts_;
}

}  // namespace prescene::collision
