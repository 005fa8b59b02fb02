// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "benchmarks/collision_algorithms.h"
#include "prescene/core/check.h"
#include "tests/peers/mesh_collision.h"

namespace prescene::benchmarks {
namespace {

using collision::Transform;
using tests::MeshPairPeer;

class PeerSolver : public PairSolver {
 public:
  explicit PeerSolver(std::unique_ptr<MeshPairPeer> peer) : peer_(std::move(peer)) {
    cost_a = cost_of(peer_->cost_a());
    cost_b = cost_of(peer_->cost_b());
  }
  bool collide(const Transform& X_AB) override { return peer_->collide(X_AB); }
  double distance(const Transform& X_AB) override { return peer_->distance(X_AB).value(); }
  std::string_view differs() const override { return peer_->differs(); }

 private:
  static BuildCost cost_of(const tests::MeshPeerCost& cost) {
    BuildCost of;
    of.seconds = cost.build;
    if (cost.bytes) of.bytes = static_cast<double>(*cost.bytes);
    return of;
  }
  std::unique_ptr<MeshPairPeer> peer_;
};

Algorithm peer(std::string_view name,
               std::function<std::unique_ptr<MeshPairPeer>(const CollisionMesh&, const CollisionMesh&)> make) {
  Algorithm algorithm;
  algorithm.name = name;
  algorithm.make = [make = std::move(make)](const CollisionMesh& a, const CollisionMesh& b) {
    return std::make_unique<PeerSolver>(make(a, b));
  };
  return algorithm;
}

}  // namespace

double PairSolver::distance(const Transform& /*X_AB*/) { PRESCENE_CHECK_MSG(false, "has no distance"); }
void PairSolver::collide_batch(std::span<const Transform> /*X_AB*/, std::span<bool> /*answers*/) {
  PRESCENE_CHECK_MSG(false, "has no batches");
}
WorkCounts PairSolver::count(const Transform& /*X_AB*/) { PRESCENE_CHECK_MSG(false, "has no counts"); }

std::vector<Algorithm> peer_algorithms() {
  using tests::FclVolume;
  using tests::GimpactQuery;
  std::vector<Algorithm> algorithms;
  algorithms.push_back(peer(kFcl, [](const CollisionMesh& a, const CollisionMesh& b) {
    return tests::make_fcl_pair(a, b, FclVolume::kObbRss);
  }));
  algorithms.back().has_distance = true;
  algorithms.push_back(peer("FCL OBB", [](const CollisionMesh& a, const CollisionMesh& b) {
    return tests::make_fcl_pair(a, b, FclVolume::kObb);
  }));
  algorithms.push_back(peer(kGimpact, [](const CollisionMesh& a, const CollisionMesh& b) {
    return tests::make_gimpact_pair(a, b, GimpactQuery::kFirstContact);
  }));
  algorithms.push_back(peer("Bullet GImpact as shipped", [](const CollisionMesh& a, const CollisionMesh& b) {
    return tests::make_gimpact_pair(a, b, GimpactQuery::kAllContacts);
  }));
  algorithms.back().slow = true;
  algorithms.push_back(peer(kOde, tests::make_ode_pair));
  algorithms.back().slow = true;
  algorithms.push_back(peer(kEmbree, tests::make_embree_pair));
  algorithms.back().slow = true;
  return algorithms;
}

}  // namespace prescene::benchmarks
