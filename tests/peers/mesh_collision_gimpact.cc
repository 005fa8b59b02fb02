// SPDX-License-Identifier: Apache-2.0
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>

#include <array>
#include <chrono>
#include <utility>
#include <vector>

#include "tests/peers/mesh_collision.h"

namespace prescene::tests {
namespace {

btTransform bullet_transform(const collision::Transform& X_AB) {
  std::array<btScalar, 9> r;
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = static_cast<btScalar>(X_AB.rotation[i]);
  const btMatrix3x3 basis(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]);
  const auto& t = X_AB.translation;
  return btTransform(basis,
                     btVector3(static_cast<btScalar>(t[0]), static_cast<btScalar>(t[1]), static_cast<btScalar>(t[2])));
}

/// A shape over the vertices and indices of the mesh, which it does not copy.
class GimpactMesh {
 public:
  GimpactMesh(CollisionMesh mesh, MeshPeerCost* cost) : mesh_(std::move(mesh)) {
    const auto start = std::chrono::steady_clock::now();
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(mesh_->triangle_count());
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(mesh_->triangles().data());
    part.m_triangleIndexStride = sizeof(collision::TriangleIndices);
    part.m_numVertices = static_cast<int>(mesh_->vertices().size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(mesh_->vertices().data());
    part.m_vertexStride = sizeof(Eigen::Vector3f);
    part.m_vertexType = PHY_FLOAT;
    triangles_.addIndexedMesh(part, PHY_INTEGER);
    shape_ = std::make_unique<btGImpactMeshShape>(&triangles_);
    shape_->setMargin(0.0);
    shape_->updateBound();
    cost->build = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    cost->bytes = static_cast<std::size_t>(tree().getNodeCount()) * sizeof(BT_QUANTIZED_BVH_NODE);
  }

  btGImpactMeshShape& shape() { return *shape_; }
  btGImpactMeshShapePart& part() { return *shape_->getMeshPart(0); }
  const btGImpactBoxSet& tree() const { return *shape_->getMeshPart(0)->getBoxSet(); }

 private:
  CollisionMesh mesh_;
  btTriangleIndexVertexArray triangles_;
  std::unique_ptr<btGImpactMeshShape> shape_;
};

class GimpactPair : public MeshPairPeer {
 public:
  GimpactPair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) : a_(mesh_a, &cost_a_), b_(mesh_b, &cost_b_) {}
  std::optional<double> distance(const collision::Transform& /*X_AB*/) override { return std::nullopt; }

 protected:
  GimpactMesh a_, b_;
};

class FirstContactPair : public GimpactPair {
 public:
  FirstContactPair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) : GimpactPair(mesh_a, mesh_b) {
    // Vertices are only readable while locked.
    a_.part().lockChildShapes();
    b_.part().lockChildShapes();
  }
  ~FirstContactPair() override {
    a_.part().unlockChildShapes();
    b_.part().unlockChildShapes();
  }

  bool collide(const collision::Transform& X_AB) override {
    const btTransform X = bullet_transform(X_AB);
    BT_BOX_BOX_TRANSFORM_CACHE cache;
    cache.calc_from_homogenic(btTransform::getIdentity(), X);
    const btGImpactBoxSet &tree_a = a_.tree(), &tree_b = b_.tree();
    stack_.assign(1, {0, 0});
    while (!stack_.empty()) {
      const auto [node_a, node_b] = stack_.back();
      stack_.pop_back();
      btAABB box_a, box_b;
      tree_a.getNodeBound(node_a, box_a);
      tree_b.getNodeBound(node_b, box_b);
      const bool leaf_a = tree_a.isLeafNode(node_a), leaf_b = tree_b.isLeafNode(node_b);
      // The full test of 15 axes for pairs of leaves only, as the library does.
      if (!box_a.overlapping_trans_cache(box_b, cache, leaf_a && leaf_b)) continue;
      if (leaf_a && leaf_b) {
        if (triangles_touch(tree_a.getNodeData(node_a), tree_b.getNodeData(node_b), X)) return true;
        continue;
      }
      push_children(node_a, node_b, leaf_a, leaf_b);
    }
    return false;
  }

  std::string_view differs() const override {
    return "triangles are one-sided: also what lies behind them, inside their box, counts; boxes are not rounded "
           "outwards";
  }

 private:
  void push_children(int node_a, int node_b, bool leaf_a, bool leaf_b) {
    const btGImpactBoxSet &tree_a = a_.tree(), &tree_b = b_.tree();
    const int left_a = leaf_a ? node_a : tree_a.getLeftNode(node_a);
    const int left_b = leaf_b ? node_b : tree_b.getLeftNode(node_b);
    if (!leaf_a && !leaf_b) stack_.emplace_back(tree_a.getRightNode(node_a), tree_b.getRightNode(node_b));
    if (!leaf_a) stack_.emplace_back(tree_a.getRightNode(node_a), left_b);
    if (!leaf_b) stack_.emplace_back(left_a, tree_b.getRightNode(node_b));
    stack_.emplace_back(left_a, left_b);
  }

  bool triangles_touch(int index_a, int index_b, const btTransform& X_AB) {
    btPrimitiveTriangle triangle_a, triangle_b;
    a_.part().getPrimitiveManager()->get_primitive_triangle(index_a, triangle_a);
    b_.part().getPrimitiveManager()->get_primitive_triangle(index_b, triangle_b);
    triangle_b.applyTransform(X_AB);
    triangle_a.buildTriPlane();
    triangle_b.buildTriPlane();
    if (!triangle_a.overlap_test_conservative(triangle_b)) return false;
    GIM_TRIANGLE_CONTACT contact;
    return triangle_a.find_triangle_collision_clip_method(triangle_b, contact);
  }

  std::vector<std::pair<int, int>> stack_;
};

/// Remembers whether there was a contact.
class AnyContact : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;
  void addContactPoint(const btVector3& /*normal*/, const btVector3& /*point*/, btScalar /*depth*/) override {
    found = true;
  }
  bool found = false;
};

class AllContactsPair : public GimpactPair {
 public:
  AllContactsPair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b)
      : GimpactPair(mesh_a, mesh_b), dispatcher_(&configuration_) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
    object_a_.setCollisionShape(&a_.shape());
    object_b_.setCollisionShape(&b_.shape());
    algorithm_ = dispatcher_.findAlgorithm(&wrapper_a_, &wrapper_b_, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  ~AllContactsPair() override {
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
  }

  bool collide(const collision::Transform& X_AB) override {
    object_b_.setWorldTransform(bullet_transform(X_AB));
    AnyContact result(&wrapper_a_, &wrapper_b_);
    algorithm_->processCollision(&wrapper_a_, &wrapper_b_, info_, &result);
    return result.found;
  }

  std::string_view differs() const override {
    return "makes all contacts; triangles are one-sided: also what lies behind them counts; boxes are not rounded "
           "outwards";
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDispatcherInfo info_;
  btCollisionObject object_a_, object_b_;
  btCollisionObjectWrapper wrapper_a_ = {nullptr, &a_.shape(), &object_a_, object_a_.getWorldTransform(), -1, -1};
  btCollisionObjectWrapper wrapper_b_ = {nullptr, &b_.shape(), &object_b_, object_b_.getWorldTransform(), -1, -1};
  btCollisionAlgorithm* algorithm_ = nullptr;
};

}  // namespace

std::unique_ptr<MeshPairPeer> make_gimpact_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b,
                                                GimpactQuery query) {
  if (query == GimpactQuery::kAllContacts) return std::make_unique<AllContactsPair>(mesh_a, mesh_b);
  return std::make_unique<FirstContactPair>(mesh_a, mesh_b);
}

}  // namespace prescene::tests
