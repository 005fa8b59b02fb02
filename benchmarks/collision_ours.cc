// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <type_traits>
#include <utility>

#include "benchmarks/collision_algorithms.h"
#include "prescene/collision/batch_queries.h"
#include "prescene/collision/distance_queries.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/clock.h"

namespace prescene::benchmarks {
namespace {

using collision::Boxtree;
using collision::BoxtreeOptions;
using collision::Builder;
using collision::BvhLiteOptions;
using collision::BvhLiteScratch;
using collision::BvhLiteTree;
using collision::DopTree;
using collision::DopTreeOptions;
using collision::PlainBoxtree;
using collision::PlanePrecision;
using collision::QueryCounts;
using collision::QueryScratch;
using collision::SimdopOptions;
using collision::SimdopTraversal;
using collision::SimdopTree;
using collision::Transform;
using collision::TriangleTree;
using collision::TriangleTreeOptions;

template <class Tree>
std::size_t bytes_of(const Tree& tree) {
  if constexpr (std::is_same_v<Tree, TriangleTree>)
    return tree.memory().node_bytes + tree.memory().reference_bytes;
  else
    return tree.bytes();
}

/// Trees of one kind of both meshes, built with one thread.
template <class Tree, class Options>
class TreeSolver : public PairSolver {
 public:
  TreeSolver(const CollisionMesh& a, const CollisionMesh& b, const Options& options)
      : a_(build(a, options, &cost_a)), b_(build(b, options, &cost_b)) {}

  bool collide(const Transform& X_AB) override { return ask(X_AB, nullptr); }

  void collide_batch(std::span<const Transform> X_AB, std::span<bool> answers) override {
    if constexpr (std::is_same_v<Tree, TriangleTree>) {
      collision::collide(a_, b_, X_AB, answers, scratch_);
    } else {
      PairSolver::collide_batch(X_AB, answers);
    }
  }

  double distance(const Transform& X_AB) override {
    if constexpr (std::is_same_v<Tree, TriangleTree>) {
      return collision::distance(a_, b_, X_AB, {}, scratch_)->distance;
    } else {
      return PairSolver::distance(X_AB);
    }
  }

  WorkCounts count(const Transform& X_AB) override {
    QueryCounts counts;
    ask(X_AB, &counts);
    return {static_cast<double>(counts.volume_tests), static_cast<double>(counts.triangle_tests)};
  }

 private:
  bool ask(const Transform& X_AB, QueryCounts* counts) {
    if constexpr (std::is_same_v<Tree, DopTree> || std::is_same_v<Tree, Boxtree> || std::is_same_v<Tree, PlainBoxtree>)
      return collision::collide(a_, b_, X_AB, counts);
    else
      return collision::collide(a_, b_, X_AB, scratch_, counts);
  }

  static Tree build(const CollisionMesh& mesh, const Options& options, BuildCost* cost) {
    core::ThreadPool one(1);
    const core::Stopwatch watch;
    Tree tree = Tree::build(mesh, options, one);
    cost->seconds = watch.seconds();
    cost->bytes = static_cast<double>(bytes_of(tree));
    return tree;
  }

  Tree a_, b_;
  std::conditional_t<std::is_same_v<Tree, BvhLiteTree>, BvhLiteScratch, QueryScratch> scratch_;
};

template <class Tree, class Options>
Algorithm algorithm_of(std::string name, const Options& options) {
  Algorithm algorithm;
  algorithm.name = std::move(name);
  algorithm.ours = true;
  algorithm.has_counts = true;
  algorithm.make = [options](const CollisionMesh& a, const CollisionMesh& b) {
    return std::make_unique<TreeSolver<Tree, Options>>(a, b, options);
  };
  return algorithm;
}

Algorithm triangle_tree(std::string_view name, const TriangleTreeOptions& options) {
  Algorithm algorithm = algorithm_of<TriangleTree>(std::string(name), options);
  algorithm.has_batches = true;
  algorithm.has_distance = name == kDefaultTree;
  return algorithm;
}

std::string name_of(SimdopTraversal traversal) {
  switch (traversal) {
    case SimdopTraversal::kOneVersusOne:
      return "1 vs 1";
    case SimdopTraversal::kOneVersusAll:
      return "1 vs n";
    case SimdopTraversal::kFourVersusFour:
      return "4 vs 4";
  }
  return "";
}

}  // namespace

std::string bvhlite_name(const BvhLiteOptions& options) {
  return "BVHLite k=" + std::to_string(options.k) + " n=" + std::to_string(options.branching) + " " +
         std::to_string(options.bits) + " bit, " + std::to_string(options.leaf_items) + " a leaf";
}

std::string simdop_name(const SimdopOptions& options) {
  return "SIMDop k=" + std::to_string(options.k) + " n=" + std::to_string(options.branching) + " " +
         name_of(options.traversal) + (options.precision == PlanePrecision::kHalf ? " 16 bit" : " 32 bit") + ", " +
         std::string(collision::to_string(options.builder));
}

std::string default_tree_name(Builder builder) {
  if (builder == TriangleTreeOptions{}.builder) return std::string(kDefaultTree);
  return std::string(kDefaultTree) + ", " + std::string(collision::to_string(builder));
}

std::vector<Algorithm> our_algorithms() {
  std::vector<Algorithm> algorithms;
  algorithms.push_back(triangle_tree(kDefaultTree, {}));
  algorithms.push_back(triangle_tree("default tree, frames not rotated", {.rotated_frames = false}));
  algorithms.push_back(algorithm_of<SimdopTree>("SIMDop", SimdopOptions{}));
  algorithms.push_back(algorithm_of<BvhLiteTree>("BVHLite", BvhLiteOptions{}));
  algorithms.push_back(algorithm_of<Boxtree>(std::string(kBoxtree), BoxtreeOptions{}));
  algorithms.back().slow = true;
  algorithms.push_back(algorithm_of<PlainBoxtree>(std::string(kPlainBoxtree), BoxtreeOptions{}.builder));
  algorithms.back().slow = true;
  algorithms.push_back(algorithm_of<DopTree>(std::string(kScalarDops), DopTreeOptions{}));
  return algorithms;
}

std::vector<Algorithm> study_algorithms() {
  std::vector<Algorithm> algorithms;
  algorithms.push_back(triangle_tree(kDefaultTree, {}));
  const auto add_simdop = [&](const SimdopOptions& options) {
    algorithms.push_back(algorithm_of<SimdopTree>(simdop_name(options), options));
  };
  for (const Builder builder : collision::kAllBuilders) {
    if (builder != TriangleTreeOptions{}.builder)
      algorithms.push_back(triangle_tree(default_tree_name(builder), {.builder = builder}));
    SimdopOptions options;
    options.builder = builder;
    add_simdop(options);
  }
  for (const int k : collision::kDopSizes) {
    SimdopOptions options;
    if (k == options.k) continue;
    options.k = k;
    add_simdop(options);
  }
  for (const int branching : {2, 4, 8, 16}) {
    SimdopOptions options;
    if (branching == options.branching) continue;
    options.branching = branching;
    add_simdop(options);
  }
  add_simdop({.precision = PlanePrecision::kSingle});
  add_simdop({.branching = 16, .precision = PlanePrecision::kSingle});
  add_simdop({.traversal = SimdopTraversal::kOneVersusOne});
  add_simdop({.branching = 4, .traversal = SimdopTraversal::kFourVersusFour});
  for (const BvhLiteOptions& options :
       {BvhLiteOptions{}, BvhLiteOptions{.bits = 4}, BvhLiteOptions{.bits = 8},
        BvhLiteOptions{.bits = 4, .leaf_items = 4}, BvhLiteOptions{.bits = 4, .leaf_items = 8}, BvhLiteOptions{.k = 26},
        BvhLiteOptions{.k = 26, .branching = 16}})
    algorithms.push_back(algorithm_of<BvhLiteTree>(bvhlite_name(options), options));
  algorithms.push_back(algorithm_of<Boxtree>(std::string(kBoxtree), BoxtreeOptions{}));
  algorithms.back().slow = true;
  algorithms.push_back(algorithm_of<PlainBoxtree>(std::string(kPlainBoxtree), BoxtreeOptions{}.builder));
  algorithms.back().slow = true;
  algorithms.push_back(algorithm_of<Boxtree>("Boxtree, 4 a leaf", BoxtreeOptions{.leaf_items = 4}));
  algorithms.back().slow = true;
  algorithms.push_back(algorithm_of<DopTree>(std::string(kScalarDops), DopTreeOptions{}));
  algorithms.push_back(algorithm_of<DopTree>("scalar binary k-DOP tree, surface area heuristic",
                                             DopTreeOptions{.builder = Builder::kSurfaceAreaHeuristic}));
  algorithms.push_back(algorithm_of<DopTree>("scalar binary k-DOP tree, k=14", DopTreeOptions{.k = 14}));
  return algorithms;
}

}  // namespace prescene::benchmarks
