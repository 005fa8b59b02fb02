// SPDX-License-Identifier: Apache-2.0
#include "tests/peers/hull_distance.h"

#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl/narrowphase/distance.h>

#include <memory>
#include <vector>

namespace prescene::tests {
namespace {

std::shared_ptr<fcl::Convexd> convex_of(const geometry::TriangleMesh& mesh) {
  auto vertices = std::make_shared<std::vector<Eigen::Vector3d>>(mesh.vertices);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& triangle : mesh.triangles) {
    faces->push_back(3);
    for (const std::uint32_t index : triangle) faces->push_back(static_cast<int>(index));
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(mesh.triangles.size()), faces);
}

fcl::CollisionObjectd object_of(const PlacedHull& hull) {
  return fcl::CollisionObjectd(convex_of(*hull.mesh), Eigen::Isometry3d(hull.X_WM.matrix()));
}

}  // namespace

double hull_distance_by_fcl(const PlacedHull& a, const PlacedHull& b) {
  const fcl::CollisionObjectd object_a = object_of(a), object_b = object_of(b);
  fcl::DistanceRequestd request;
  request.enable_signed_distance = true;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  fcl::DistanceResultd result;
  fcl::distance(&object_a, &object_b, request, result);
  return result.min_distance;
}

}  // namespace prescene::tests
