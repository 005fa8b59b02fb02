// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <chrono>
#include <mutex>
#include <utility>

#include "tests/peers/mesh_collision.h"

namespace prescene::tests {
namespace {

/// A geometry over the vertices and indices of the mesh, which it does not copy.
class OdeMesh {
 public:
  OdeMesh(CollisionMesh mesh, MeshPeerCost* cost) : mesh_(std::move(mesh)) {
    const auto start = std::chrono::steady_clock::now();
    data_ = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildSingle(data_, mesh_->vertices().data(), sizeof(Eigen::Vector3f),
                                static_cast<int>(mesh_->vertices().size()), mesh_->triangles().data(),
                                static_cast<int>(3 * mesh_->triangles().size()), sizeof(collision::TriangleIndices));
    geometry_ = dCreateTriMesh(nullptr, data_, nullptr, nullptr, nullptr);
    cost->build = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  ~OdeMesh() {
    dGeomDestroy(geometry_);
    dGeomTriMeshDataDestroy(data_);
  }
  OdeMesh(const OdeMesh&) = delete;
  OdeMesh& operator=(const OdeMesh&) = delete;

  dGeomID geometry() const { return geometry_; }

 private:
  CollisionMesh mesh_;
  dTriMeshDataID data_ = nullptr;
  dGeomID geometry_ = nullptr;
};

class OdePair : public MeshPairPeer {
 public:
  OdePair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) : a_(mesh_a, &cost_a_), b_(mesh_b, &cost_b_) {}

  bool collide(const collision::Transform& X_AB) override {
    const auto& r = X_AB.rotation;
    dMatrix3 rotation = {};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t col = 0; col < 3; ++col) rotation[4 * row + col] = static_cast<dReal>(r[3 * row + col]);
    dGeomSetPosition(b_.geometry(), static_cast<dReal>(X_AB.translation[0]), static_cast<dReal>(X_AB.translation[1]),
                     static_cast<dReal>(X_AB.translation[2]));
    dGeomSetRotation(b_.geometry(), rotation);
    dContactGeom contact;
    return dCollide(a_.geometry(), b_.geometry(), static_cast<int>(CONTACTS_UNIMPORTANT | 1U), &contact,
                    sizeof(contact)) > 0;
  }

  std::optional<double> distance(const collision::Transform& /*X_AB*/) override { return std::nullopt; }

  std::string_view differs() const override {
    return "all pairs of triangles are found before the first contact is made; a pair without a contact is none";
  }

 private:
  OdeMesh a_, b_;
};

}  // namespace

std::unique_ptr<MeshPairPeer> make_ode_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) {
  static std::once_flag once;
  std::call_once(once, [] { dInitODE2(0); });
  dAllocateODEDataForThread(dAllocateFlagCollisionData);
  return std::make_unique<OdePair>(mesh_a, mesh_b);
}

}  // namespace prescene::tests
