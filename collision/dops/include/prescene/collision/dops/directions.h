// SPDX-License-Identifier: Apache-2.0
// The directions of k-DOPs: polytopes with k planes whose normals are the same for all volumes, in antipodal pairs
// [Klosowski et al. 1998]. A volume is stored as its k planes: how far it reaches in each of the k directions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/collision/mesh.h"

namespace prescene::collision {

inline constexpr std::array<int, 7> kDopSizes = {6, 14, 18, 24, 26, 32, 46};
inline constexpr std::size_t kMostDopAxes = 23;

using DopAxis = std::array<double, 3>;  ///< Of unit length.

/// A direction as a sum of three others with weights that are not negative.
struct DopCone {
  std::array<std::uint8_t, 3> directions;
  std::array<double, 3> weights;
};

class DopDirections {
 public:
  /// k = 6: the coordinate axes; 14: and the corners of a cube; 18: and, instead, its edges; 26: all of these; 24, 32
  /// and 46: the coordinate axes and others that keep as far from them and each other as repulsion drives them.
  /// `k` is one of kDopSizes (checked).
  static const DopDirections& of(int k);

  int k() const { return static_cast<int>(2 * axes_.size()); }
  /// In the order in which tests go through them: coordinate axes first, each next one far from those before.
  std::span<const DopAxis> axes() const { return axes_; }
  /// Direction i is axis i, direction axes().size() + i its opposite.
  DopAxis direction(std::size_t i) const;
  std::size_t opposite(std::size_t i) const { return i < axes_.size() ? i + axes_.size() : i - axes_.size(); }
  /// The cone of three neighbouring directions in which `direction` lies.
  DopCone cone(const DopAxis& direction) const;

 private:
  // Three directions between which no other lies, counter-clockwise from outside; neighbour i lies across the edge
  // opposite corner i. The rows of `inverse` turn a direction into its weights.
  struct Facet {
    std::array<std::uint8_t, 3> corners;
    std::array<std::uint8_t, 3> neighbours;
    std::array<DopAxis, 3> inverse;
  };

  explicit DopDirections(std::vector<DopAxis> axes);
  template <int k>
  static const DopDirections& made_once();
  void find_facets();
  void link_facets();
  std::size_t walk(std::size_t facet, const DopAxis& direction) const;

  std::vector<DopAxis> axes_;
  std::vector<Facet> facets_;
  std::array<std::uint8_t, 24> starts_ = {};  // By octant and longest coordinate: a facet that is not far.
};

}  // namespace prescene::collision
