// SPDX-License-Identifier: Apache-2.0
// A triangle mesh as the collision library sees it: single precision, checked once, so that everything behind it may
// trust it. Trees keep a shared pointer to the mesh that they were built over.
//
//   PRESCENE_TRY(std::shared_ptr<const Mesh> cup, Mesh::make(geometry_mesh, "cup"));
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::collision {

using Eigen::Vector3f;
using TriangleIndices = std::array<std::uint32_t, 3>;

/// Coordinates beyond this are refused, m: products of three of them must stay finite in single precision.
inline constexpr float kLargestCoordinate = 1e9F;

/// What is unusual about a mesh. None of it hinders a query: degenerate triangles are segments or points and collide
/// as such, duplicates answer twice.
struct MeshReport {
  int degenerate_triangles = 0;  ///< Corners in a line, decided exactly.
  int duplicate_triangles = 0;   ///< With the same three corner positions as an earlier one.
  std::string text() const;      ///< One line for a person; empty when there is nothing to say.

  friend bool operator==(const MeshReport&, const MeshReport&) = default;
};

class Mesh {
 public:
  /// The mesh rounded to single precision. Fails with kInvalidInput, naming the mesh and the index, when there are no
  /// triangles, more than 2^30 of them, an index is out of range, or a coordinate is not finite or beyond
  /// kLargestCoordinate.
  static core::Result<std::shared_ptr<const Mesh>> make(const geometry::TriangleMesh& mesh, std::string_view name);
  static core::Result<std::shared_ptr<const Mesh>> make(std::vector<Vector3f> vertices,
                                                        std::vector<TriangleIndices> triangles, std::string_view name);

  /// m, in the mesh's frame.
  const std::vector<Vector3f>& vertices() const { return vertices_; }
  const std::vector<TriangleIndices>& triangles() const { return triangles_; }
  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(triangles_.size()); }
  std::array<Vector3f, 3> corners(std::uint32_t triangle) const {
    const TriangleIndices& t = triangles_[triangle];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }
  const std::string& name() const { return name_; }
  const MeshReport& report() const { return report_; }
  /// Identity of the vertices and triangles, for caches; the name does not count.
  std::uint64_t content_hash() const { return content_hash_; }
  /// Length of the bounding box's diagonal, m: what is called the size of an object.
  float size() const { return size_; }
  /// A corner of each piece, m: triangles are of one piece where corners of theirs are at the same place. Found when
  /// it is first asked for, in about a tenth of a microsecond a vertex, by whichever thread asks.
  const std::vector<Vector3f>& corners_of_parts() const;

 private:
  Mesh() = default;

  std::vector<Vector3f> vertices_;
  std::vector<TriangleIndices> triangles_;
  std::string name_;
  MeshReport report_;
  std::uint64_t content_hash_ = 0;
  float size_ = 0.0F;
  mutable std::once_flag parts_found_;
  mutable std::vector<Vector3f> corners_of_parts_;
};

}  // namespace prescene::collision
