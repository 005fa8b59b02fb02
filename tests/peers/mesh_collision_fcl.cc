// SPDX-License-Identifier: Apache-2.0
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <chrono>
#include <vector>

#include "prescene/core/check.h"
#include "tests/peers/mesh_collision.h"

namespace prescene::tests {
namespace {

Eigen::Isometry3d isometry(const collision::Transform& X_AB) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col)
      X.linear()(row, col) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(3 * row + col)]);
    X.translation()[row] = static_cast<double>(X_AB.translation[static_cast<std::size_t>(row)]);
  }
  return X;
}

template <class Volume>
class FclPair : public MeshPairPeer {
 public:
  FclPair(const collision::Mesh& mesh_a, const collision::Mesh& mesh_b) {
    build(mesh_a, &model_a_, &cost_a_);
    build(mesh_b, &model_b_, &cost_b_);
    distance_request_.enable_nearest_points = false;
  }

  bool collide(const collision::Transform& X_AB) override {
    collision_result_.clear();
    fcl::collide(&model_a_, Eigen::Isometry3d::Identity(), &model_b_, isometry(X_AB), collision_request_,
                 collision_result_);
    return collision_result_.isCollision();
  }

  std::optional<double> distance(const collision::Transform& X_AB) override {
    if (!std::is_same_v<Volume, fcl::OBBRSSd>) return std::nullopt;
    distance_result_.clear();
    fcl::distance(&model_a_, Eigen::Isometry3d::Identity(), &model_b_, isometry(X_AB), distance_request_,
                  distance_result_);
    return distance_result_.min_distance;
  }

  std::string_view differs() const override { return ""; }

 private:
  static void build(const collision::Mesh& mesh, fcl::BVHModel<Volume>* model, MeshPeerCost* cost) {
    const auto start = std::chrono::steady_clock::now();
    model->beginModel(static_cast<int>(mesh.triangle_count()), static_cast<int>(mesh.vertices().size()));
    std::vector<Eigen::Vector3d> vertices;
    vertices.reserve(mesh.vertices().size());
    for (const Eigen::Vector3f& vertex : mesh.vertices()) vertices.push_back(vertex.cast<double>());
    std::vector<fcl::Triangle> triangles;
    triangles.reserve(mesh.triangles().size());
    for (const auto& t : mesh.triangles()) triangles.emplace_back(t[0], t[1], t[2]);
    model->addSubModel(vertices, triangles);
    model->endModel();
    cost->build = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    cost->bytes = static_cast<std::size_t>(model->getNumBVs()) * sizeof(fcl::BVNode<Volume>) +
                  mesh.triangle_count() * sizeof(unsigned);
  }

  fcl::BVHModel<Volume> model_a_, model_b_;
  fcl::CollisionRequestd collision_request_;  // one contact, without its place
  fcl::CollisionResultd collision_result_;
  fcl::DistanceRequestd distance_request_;
  fcl::DistanceResultd distance_result_;
};

}  // namespace

std::unique_ptr<MeshPairPeer> make_fcl_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b,
                                            FclVolume volume) {
  if (volume == FclVolume::kObb) return std::make_unique<FclPair<fcl::OBBd>>(*mesh_a, *mesh_b);
  return std::make_unique<FclPair<fcl::OBBRSSd>>(*mesh_a, *mesh_b);
}

}  // namespace prescene::tests
