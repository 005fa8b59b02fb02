// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of collision take for granted.
#pragma once

#include <hwy/highway.h>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/triangle_pairs-inl.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::collision::given_collision {

extern core::ThreadPool pool;
extern QueryScratch scratch;
extern const TriangleTree cup, table;
extern const Transform X_CT, X_CW;
extern const geometry::Pose X_AB, X_WA, X_WB, X_AB_start, X_AB_end, X_WC;
extern const Eigen::Vector3d p_CQ;

namespace hierarchy_h {
extern const std::vector<Item> items;
}

namespace mesh_h {
extern const geometry::TriangleMesh geometry_mesh;
}

namespace ray_queries_h {
extern const Ray ray;
extern const std::vector<Ray> rays_of_a_depth_image;
extern const std::span<std::optional<RayHit>> hits;
}  // namespace ray_queries_h

namespace rigid_motion_h {
extern const geometry::Twist V_AB;
extern const Eigen::Vector3d centre_of_mass_B;
}  // namespace rigid_motion_h

namespace transform_h {
extern const TriangleTree tree_a, tree_b;
}

namespace tree_file_h {
struct Node {
  float size;
};
extern const Mesh mesh;
extern const std::uint64_t hash;
extern const std::filesystem::path path;
extern const TreeFileKey key;
extern const Array<Node> nodes, triangles;
}  // namespace tree_file_h

namespace triangle_tree_h {
extern const std::shared_ptr<const Mesh> mesh;
}

}  // namespace prescene::collision::given_collision

namespace prescene::collision::HWY_NAMESPACE::given_collision {

extern const float* const a;
extern const float* const b;
extern const float* const leaf_a;
extern const float* const leaf_b;
extern const float nearest_so_far;
extern const std::uint32_t active;
extern const PairTag d;
extern const Corners<PairTag>&corners_a, &corners_b;
extern const hn::Mask<PairTag>& mask;

}  // namespace prescene::collision::HWY_NAMESPACE::given_collision
