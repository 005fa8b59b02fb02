// SPDX-License-Identifier: Apache-2.0
// What a mesh's surface is like: where it has sharp edges and corners, and where its facets stand for one that bends.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "prescene/collision/mesh.h"

namespace prescene::collision {

/// An edge that stands out, and the normals of the faces beside it.
struct SharpEdge {
  Eigen::Vector3d from, to;  ///< m
  Eigen::Vector3d normal_a, normal_b;
};

struct SharpCorner {
  Eigen::Vector3d point;    ///< m
  Eigen::Vector3d outward;  ///< Of unit length.
};

/// Vectors are over the mesh's triangles where nothing else is said.
struct SurfaceFeatures {
  double volume = 0.0;  ///< m^3; not above 0: turned inside out, or it encloses nothing.
  std::vector<Eigen::Vector3d> normals;
  std::vector<double> areas;  ///< m^2
  /// Most that the surface bends across an edge that is not sharp, 1/m; 0 on flat faces.
  std::vector<double> bends;
  /// How far spheres may rise over a facet that stands for a surface that bends, m.
  std::vector<double> rises;
  /// At the corners of each triangle, of the surface that its facets stand for: means by area over the triangles around
  /// a corner that no sharp edge parts from it.
  std::vector<std::array<Eigen::Vector3d, 3>> corner_normals;
  std::vector<SharpEdge> edges;
  std::vector<SharpCorner> corners;
};

SurfaceFeatures surface_features(const Mesh& mesh);

}  // namespace prescene::collision
