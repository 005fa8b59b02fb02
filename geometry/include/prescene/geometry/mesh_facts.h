// SPDX-License-Identifier: Apache-2.0
// What is asked of the same mesh in every frame and whenever a simulator is made, worked out once: for a scan of
// 100,000 triangles each of these takes a millisecond or more.
//
//   const double reach = facts_of(cup).reach;   // in each frame
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

struct MeshFacts {
  std::uint64_t content = 0;  ///< content_hash()
  Box box;                    ///< bounding_box()
  double radius = 0.0;        ///< m: radius_about() the middle of the box
  double reach = 0.0;         ///< m: radius_about() the origin of the mesh's frame
};

/// Worked out when the mesh is first asked about, and kept as long as it lives. `mesh` is not null (checked) and does
/// not change any more. Safe to call from several threads.
MeshFacts facts_of(const std::shared_ptr<const TriangleMesh>& mesh);

/// How often facts were worked out (not found) in this process, for tests.
std::size_t mesh_facts_made();

}  // namespace prescene::geometry
