// SPDX-License-Identifier: Apache-2.0
// Collision shapes as the convex parts that lanes compute with.
#pragma once

#include <string>
#include <vector>

#include "lane_state.h"
#include "prescene/belief/object_model.h"
#include "prescene/simulation/shape_store.h"

namespace prescene::simulation {

inline std::array<double, 3> plain(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }
inline std::array<double, 9> plain(const geometry::Matrix3d& R) {
  std::array<double, 9> rows;
  for (int i = 0; i < 9; ++i) rows[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  return rows;
}

/// A primitive about its own frame.
ConvexPart convex_part(const geometry::Primitive& primitive, double rounding);

/// Appends the parts of a body's shapes; X_LB is from the body's frame to that of the lanes. kUnsupported says of which
/// body and shape and why.
core::Status add_shapes(const std::string& name, const std::vector<belief::CollisionShape>& collision,
                        const geometry::Pose& X_LB, double rounding, ShapeStore& shapes,
                        const DecompositionSettings& decomposition, std::vector<ConvexPart>& parts);

}  // namespace prescene::simulation
