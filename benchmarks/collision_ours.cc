// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <utility>

#include "prescene/benchmarks/collision_algorithms.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::benchmarks {
namespace {

using collision::QueryCounts;
using collision::QueryScratch;
using collision::Transform;
using collision::TriangleTree;
using collision::TriangleTreeOptions;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class TriangleTreeSolver : public PairSolver {
 public:
  TriangleTreeSolver(const CollisionMesh& a, const CollisionMesh& b, const TriangleTreeOptions& options)
      : a_(build(a, options, &cost_a)), b_(build(b, options, &cost_b)) {}

  bool collide(const Transform& X_AB) override { return collision::collide(a_, b_, X_AB, scratch_); }
  WorkCounts count(const Transform& X_AB) override {
    QueryCounts counts;
    collision::collide(a_, b_, X_AB, scratch_, &counts);
    return {static_cast<double>(counts.volume_tests), static_cast<double>(counts.triangle_tests)};
  }

 private:
  static TriangleTree build(const CollisionMesh& mesh, const TriangleTreeOptions& options, BuildCost* cost) {
    core::ThreadPool one(1);
    const double start = seconds_now();
    TriangleTree tree = TriangleTree::build(mesh, options, one);
    cost->seconds = seconds_now() - start;
    cost->bytes = static_cast<double>(tree.memory().node_bytes + tree.memory().reference_bytes);
    return tree;
  }

  TriangleTree a_, b_;
  QueryScratch scratch_;
};

Algorithm triangle_tree(std::string_view name, const TriangleTreeOptions& options) {
  Algorithm algorithm;
  algorithm.name = name;
  algorithm.ours = true;
  algorithm.has_counts = true;
  algorithm.make = [options](const CollisionMesh& a, const CollisionMesh& b) {
    return std::make_unique<TriangleTreeSolver>(a, b, options);
  };
  return algorithm;
}

}  // namespace

std::vector<Algorithm> our_algorithms() {
  std::vector<Algorithm> algorithms;
  algorithms.push_back(triangle_tree(kDefaultTree, {}));
  algorithms.push_back(triangle_tree("default tree, frames not rotated", {.rotated_frames = false}));
  return algorithms;
}

}  // namespace prescene::benchmarks
