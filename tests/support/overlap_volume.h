// SPDX-License-Identifier: Apache-2.0
// How much of two solids overlaps, by counting cells: good to some percent, enough to place bodies into each other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"

namespace prescene::tests {

/// The inside of a mesh as a grid of cells with `resolution` cells along the longest edge of its box. A cell is inside
/// when a ray along z to its centre crosses the surface an odd number of times. Open meshes have an inside too,
/// roughly.
class SolidCells {
 public:
  explicit SolidCells(const collision::Mesh& mesh, int resolution = 48);

  /// Centres of the cells that are inside, in the mesh's frame.
  const std::vector<Eigen::Vector3f>& inside() const { return inside_; }
  /// Of all cells that are inside, m^3.
  double volume() const;
  bool contains(const Eigen::Vector3f& p) const;

 private:
  std::size_t index(int x, int y, int z) const;
  void fill_column(int x, int y, std::vector<float>* crossings);

  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float cell_ = 0.0F;
  Eigen::Vector3i count_ = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> filled_;
  std::vector<Eigen::Vector3f> inside_;
};

/// Volume of the overlap as a share of the smaller solid's volume; 0 when either has no inside.
double overlap_share(const SolidCells& a, const SolidCells& b, const collision::Transform& X_AB);

}  // namespace prescene::tests
