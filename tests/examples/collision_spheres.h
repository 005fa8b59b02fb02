// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of collision/spheres take for granted.
#pragma once

#include <filesystem>
#include <memory>

#include "prescene/collision/mesh.h"
#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision::given_collision_spheres {

extern core::ThreadPool pool;
extern SphereScratch scratch;
extern const std::shared_ptr<const Mesh> mesh;
extern const SphereTree cup, table, carton;
extern const Transform X_CT, X_CW, X_CS;
extern const geometry::Pose X_AB_start, X_AB_end, X_CT_start, X_CT_end, X_WA, X_WB, X_WC, X_WT;
extern const geometry::Matrix6d C_A, C_B, C_C;

namespace continuous_shape_queries_h {
extern const HalfSpace table;
}

namespace distance_probability_h {
extern const Eigen::Vector3d p_CaCb;
extern const Eigen::Matrix3d covariance;
extern const double radius_a, radius_b;
}  // namespace distance_probability_h

namespace sphere_tree_h {
extern const std::shared_ptr<SpherePacking> packing;
}

namespace sphere_tree_file_h {
extern const std::filesystem::path path;
extern const PackingOptions packing_options;
extern const SphereTreeOptions tree_options;
}  // namespace sphere_tree_file_h

namespace surface_spheres_h {
extern const std::size_t place;
}

namespace uncertain_shape_queries_h {
extern const HalfSpace table;
}

}  // namespace prescene::collision::given_collision_spheres
