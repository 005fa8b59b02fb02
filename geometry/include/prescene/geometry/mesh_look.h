// SPDX-License-Identifier: Apache-2.0
// The colours of a mesh's surface.
//
//   MeshLook look;
//   look.vertex_colors.assign(mesh.vertices.size(), Rgb{200, 40, 40});
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "prescene/geometry/image.h"

namespace prescene::geometry {

/// The colours of a mesh's surface, sRGB. Where nothing is given a thing has its material's colour.
struct MeshLook {
  std::vector<Rgb> vertex_colors;  ///< One a vertex, or empty. Blended over a triangle in linear light.
  /// Places in the texture, one for each corner of each triangle, or empty: u to the right and v down, (0, 0) and
  /// (1, 1) are corners of the image, which is repeated beyond. Goes before colours of vertices.
  std::vector<std::array<Eigen::Vector2f, 3>> texture_places;
  std::shared_ptr<const ColorImage> texture;  ///< Needed with places. Read bilinearly, without smaller copies.
};

/// Looks are shared, never changed.
using LookPtr = std::shared_ptr<const MeshLook>;
/// Whether both are the same colours at the same places, or both null.
bool same_look(const LookPtr& a, const LookPtr& b);

}  // namespace prescene::geometry
