// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/dop_tree.h"

#include <utility>
#include <vector>

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/triangle_pairs.h"
#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

// A volume of B as A sees it, direction by direction as far as it was asked for.
struct RealignedDop {
  std::array<float, 2 * kMostDopAxes> bounds;
  const float* planes = nullptr;
  std::size_t axes_done = 0;
};

TriangleCoordinates coordinates(const Triangle& t) {
  return {t[0].x(), t[0].y(), t[0].z(), t[1].x(), t[1].y(), t[1].z(), t[2].x(), t[2].y(), t[2].z()};
}

// Recursion instead of a stack of its own: trees are at most kDeepestNode levels deep.
template <bool kCounting>
class Query {
 public:
  Query(const DopTree& a, const DopTree& b, const Transform& X_AB, QueryCounts* counts)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        realignment_(DopDirections::of(a.options().k), a.space(), b.space(), X_AB),
        axes_(static_cast<std::size_t>(a.options().k) / 2),
        counts_(counts) {}

  bool roots() {
    RealignedDop root{.bounds = {}, .planes = b_.planes(0), .axes_done = 0};
    return !disjoint(0, root) && collide(0, 0);
  }

 private:
  bool disjoint(std::uint32_t a, RealignedDop& b) {
    if constexpr (kCounting) ++counts_->volume_tests;
    const float* planes = a_.planes(a);
    for (std::size_t i = 0; i < axes_; ++i) {
      if (i >= b.axes_done) {
        b.bounds[i] = realigned(realignment_.directions[i], b.planes);
        b.bounds[axes_ + i] = realigned(realignment_.directions[axes_ + i], b.planes);
        b.axes_done = i + 1;
      }
      if (planes[i] < b.bounds[i] || planes[axes_ + i] < b.bounds[axes_ + i]) return true;
    }
    return false;
  }

  bool collide(std::uint32_t a, std::uint32_t b) {
    const DopTree::Node& node_a = a_.nodes()[a];
    const DopTree::Node& node_b = b_.nodes()[b];
    if constexpr (kCounting) ++counts_->node_pairs;
    if (node_a.is_leaf() && node_b.is_leaf()) return leaves(node_a, node_b);
    std::array<RealignedDop, 2> dops;
    const std::uint32_t first_b = node_b.is_leaf() ? b : node_b.first;
    const std::uint32_t count_b = node_b.is_leaf() ? 1 : 2;
    const std::uint32_t first_a = node_a.is_leaf() ? a : node_a.first;
    const std::uint32_t count_a = node_a.is_leaf() ? 1 : 2;
    for (std::uint32_t k = 0; k < count_b; ++k) {
      dops[k].planes = b_.planes(first_b + k);
      dops[k].axes_done = 0;
    }
    for (std::uint32_t i = 0; i < count_a; ++i) {
      for (std::uint32_t k = 0; k < count_b; ++k) {
        if (!disjoint(first_a + i, dops[k]) && collide(first_a + i, first_b + k)) return true;
      }
    }
    return false;
  }

  bool leaves(const DopTree::Node& a, const DopTree::Node& b) {
    for (std::uint32_t k = b.first; k < b.first + b.triangles; ++k) {
      Triangle triangle_b = b_.mesh().corners(b_.order()[k]);
      for (Vector3f& corner : triangle_b) corner = X_AB_ * corner;
      const TriangleCoordinates coordinates_b = coordinates(triangle_b);
      for (std::uint32_t i = a.first; i < a.first + a.triangles; ++i) {
        const Triangle triangle_a = a_.mesh().corners(a_.order()[i]);
        const PairVerdict verdict = test_triangle_pair(coordinates(triangle_a), coordinates_b);
        if constexpr (kCounting) {
          ++counts_->triangle_tests;
          counts_->exact_tests += verdict.unsure;
        }
        if (verdict.hit != 0 || (verdict.unsure != 0 && triangles_intersect(triangle_a, triangle_b))) return true;
      }
    }
    return false;
  }

  const DopTree& a_;
  const DopTree& b_;
  const Transform& X_AB_;
  Realignment realignment_;
  std::size_t axes_;
  QueryCounts* counts_;
};

}  // namespace

DopTree DopTree::build(std::shared_ptr<const Mesh> mesh, const DopTreeOptions& options, core::ThreadPool& pool) {
  PRESCENE_CHECK(mesh != nullptr);
  const DopDirections& directions = DopDirections::of(options.k);
  DopTree tree;
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  Hierarchy shape = build_hierarchy(
      triangle_items(*mesh), {.builder = options.builder, .branching = 2, .leaf_items = options.leaf_items}, pool);
  std::vector<Node> nodes(shape.nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Hierarchy::Node& node = shape.nodes[i];
    nodes[i] = node.is_leaf() ? Node{node.begin, node.end - node.begin} : Node{node.first_child, 0};
  }
  tree.planes_ = Array<float>(fit_planes(directions, tree.space_, *mesh, shape, pool));
  tree.mesh_ = std::move(mesh);
  tree.nodes_ = Array<Node>(std::move(nodes));
  tree.order_ = Array<std::uint32_t>(std::move(shape.order));
  return tree;
}

bool collide(const DopTree& a, const DopTree& b, const Transform& X_AB, QueryCounts* counts) {
  PRESCENE_CHECK(a.options().k == b.options().k);
  return counts == nullptr ? Query<false>(a, b, X_AB, counts).roots() : Query<true>(a, b, X_AB, counts).roots();
}

}  // namespace prescene::collision
