// SPDX-License-Identifier: Apache-2.0
// Other people's libraries answering our question: do two rigid triangle meshes touch, and how far apart are they? Each
// is given the same single-precision triangles and the same single-precision X_AB. What differs from our question is
// told by `differs()`.
//
//   std::unique_ptr<MeshPairPeer> fcl = make_fcl_pair(mesh_a, mesh_b, FclVolume::kObbRss);
//   if (fcl->collide(X_AB)) ...
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>

#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"

namespace prescene::tests {

using CollisionMesh = std::shared_ptr<const collision::Mesh>;

/// What it took to make one library's model of a mesh.
struct MeshPeerCost {
  double build = 0.0;                ///< s
  std::optional<std::size_t> bytes;  ///< Nodes and references to triangles, not the vertices and indices; if known.
};

/// Two meshes in the form that a library wants. Not for use by several threads at once.
class MeshPairPeer {
 public:
  virtual ~MeshPairPeer() = default;
  MeshPairPeer(const MeshPairPeer&) = delete;
  MeshPairPeer& operator=(const MeshPairPeer&) = delete;

  /// Whether the meshes touch; the library is asked to stop at the first contact if it can.
  virtual bool collide(const collision::Transform& X_AB) = 0;
  /// m, zero or less for touching meshes; nothing if the library has no such query.
  virtual std::optional<double> distance(const collision::Transform& X_AB) = 0;
  /// What the library does not do as we do; empty if it does all as asked, but for rounding.
  virtual std::string_view differs() const = 0;

  const MeshPeerCost& cost_a() const { return cost_a_; }
  const MeshPeerCost& cost_b() const { return cost_b_; }

 protected:
  MeshPairPeer() = default;
  MeshPeerCost cost_a_;
  MeshPeerCost cost_b_;
};

enum class FclVolume { kObbRss, kObb };

/// FCL in double precision: a BVHModel of each mesh, asked for one contact without its place; distance only with
/// OBBRSS. B's vertices are moved in double precision, so that answers can differ by the rounding of our transform.
std::unique_ptr<MeshPairPeer> make_fcl_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b, FclVolume volume);

enum class GimpactQuery {
  kFirstContact,  ///< A descent of our own over the public trees of boxes that ends at the first pair of triangles.
  kAllContacts,  ///< As shipped: btGImpactCollisionAlgorithm, which collects all pairs of boxes and makes all contacts.
};

/// Bullet's GImpact in double precision (Debian's -float64 libraries), margin zero, shared vertices read as floats.
/// It is made for solids: a triangle also touches what lies behind it within its box, so that thin shells give false
/// contacts. Boxes are rounded to the nearest of 65,535 steps over the mesh and a metre around it, not outwards.
std::unique_ptr<MeshPairPeer> make_gimpact_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b,
                                                GimpactQuery query);

/// ODE's trimesh (OPCODE inside) through dCollide, asked for one unimportant contact. It collects all pairs of
/// triangles first and then makes contacts of them; pairs that give no contact do not count.
std::unique_ptr<MeshPairPeer> make_ode_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b);

/// Embree's rtcCollide over user geometries of triangles, which are tested in double precision by separating axes.
/// Embree has no query between moved scenes: B's vertices are moved and its tree refitted in each query, and the query
/// cannot be stopped, only its remaining triangle tests left out.
std::unique_ptr<MeshPairPeer> make_embree_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b);

}  // namespace prescene::tests
