// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sphere_distance.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "prescene/collision/spheres/scalar_sphere_queries.h"
#include "sphere_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

using NodePair = SphereScratch::NodePair;
template <std::size_t kBranching>
using ChildTag = hn::CappedTag<float, kBranching>;

template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | (static_cast<std::uint32_t>(bytes[1]) << 8U);
}

/// A stack with room for all that one pair of nodes can push.
class PairStack {
 public:
  explicit PairStack(std::vector<NodePair>* pairs) : pairs_(pairs) { make_room(); }
  std::size_t size() const { return size_; }
  NodePair pop() { return data_[--size_]; }
  void make_room() {
    if (pairs_->size() < size_ + SphereTree::kMostBranching) pairs_->resize(2 * (size_ + SphereTree::kMostBranching));
    data_ = pairs_->data();
  }
  void push(const NodePair& pair) { data_[size_++] = pair; }
  /// Of those above `first`, that with the smallest bound is popped first.
  void sort_from(std::size_t first) {
    std::sort(data_ + first, data_ + size_, [](const NodePair& x, const NodePair& y) { return x.bound > y.bound; });
  }

 private:
  std::vector<NodePair>* pairs_;
  NodePair* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Centres of the children of a node of B in A's frame, in memory.
struct PlacedCentres {
  HWY_ALIGN float x[SphereTree::kMostBranching];
  HWY_ALIGN float y[SphereTree::kMostBranching];
  HWY_ALIGN float z[SphereTree::kMostBranching];
};

template <std::size_t kBranching>
HWY_INLINE Children placed_in_memory(const SphereTree& b, std::uint32_t node, const Transform& X_AB,
                                     PlacedCentres* centres) {
  const ChildTag<kBranching> d;
  const Children from = children_of<kBranching>(b, node);
  const float* r = X_AB.rotation.data();
  const float* t = X_AB.translation.data();
  for (std::size_t i = 0; i < kBranching; i += hn::Lanes(d)) {
    const auto x = hn::LoadU(d, from.x + i);
    const auto y = hn::LoadU(d, from.y + i);
    const auto z = hn::LoadU(d, from.z + i);
    float* to[] = {centres->x + i, centres->y + i, centres->z + i};
    for (std::size_t row = 0; row < 3; ++row) {
      const auto xy = hn::Add(hn::Mul(hn::Set(d, r[3 * row]), x), hn::Mul(hn::Set(d, r[3 * row + 1]), y));
      hn::Store(hn::Add(hn::Add(xy, hn::Mul(hn::Set(d, r[3 * row + 2]), z)), hn::Set(d, t[row])), d, to[row]);
    }
  }
  return {centres->x, centres->y, centres->z, from.radius};
}

/// Distances of the `count` children from a sphere, and which of them are below a limit: unused lanes are below
/// infinity.
template <std::size_t kBranching>
HWY_INLINE std::uint32_t gaps_below(const Children& children, std::size_t count, const PackedSphere& sphere,
                                    float slack, float limit, float* gaps) {
  const ChildTag<kBranching> d;
  const auto radius = hn::Set(d, sphere.radius + slack);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kBranching; i += hn::Lanes(d)) {
    const auto dx = hn::Sub(hn::LoadU(d, children.x + i), hn::Set(d, sphere.centre.x()));
    const auto dy = hn::Sub(hn::LoadU(d, children.y + i), hn::Set(d, sphere.centre.y()));
    const auto dz = hn::Sub(hn::LoadU(d, children.z + i), hn::Set(d, sphere.centre.z()));
    const auto squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
    const auto gap = hn::Sub(hn::Sqrt(squared), hn::Add(radius, hn::LoadU(d, children.radius + i)));
    hn::Store(gap, d, gaps + i);
    bits |= bits_of(d, hn::Lt(gap, hn::Set(d, limit))) << i;
  }
  return bits & ((1U << count) - 1U);
}

template <std::size_t kBranching>
void search(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch,
            NearestSpheres* nearest) {
  const float slack = slack_of(a, b, X_AB);
  PairStack stack(&scratch->pairs);
  stack.push({0, 0, a.root(), placed(X_AB, b.root()), -std::numeric_limits<float>::infinity()});
  PlacedCentres centres;
  HWY_ALIGN float gaps[SphereTree::kMostBranching];
  while (stack.size() > 0) {
    const NodePair pair = stack.pop();
    if (pair.bound >= nearest->limit) continue;
    const SphereTree::Node node_a = a.nodes()[pair.a];
    const SphereTree::Node node_b = b.nodes()[pair.b];
    stack.make_room();
    const std::size_t before = stack.size();
    if (node_a.is_bottom() && node_b.is_bottom()) {
      const Children children_a = children_of<kBranching>(a, pair.a);
      const Children children_b = placed_in_memory<kBranching>(b, pair.b, X_AB, &centres);
      for (std::uint32_t near =
               gaps_below<kBranching>(children_a, node_a.count, pair.sphere_b, slack, nearest->limit, gaps);
           near != 0; near &= near - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(near));
        for (std::uint32_t bits =
                 gaps_below<kBranching>(children_b, node_b.count, children_a[i], slack, nearest->limit, gaps);
             bits != 0; bits &= bits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
          if (gaps[k] < nearest->limit)
            nearest->take(distance_of(a, b, X_AB, {a.order()[node_a.first + i], b.order()[node_b.first + k]}));
        }
      }
      continue;
    }
    if (node_b.is_bottom() || (!node_a.is_bottom() && pair.sphere_a.radius >= pair.sphere_b.radius)) {
      const Children children_a = children_of<kBranching>(a, pair.a);
      for (std::uint32_t bits =
               gaps_below<kBranching>(children_a, node_a.count, pair.sphere_b, slack, nearest->limit, gaps);
           bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
        stack.push({node_a.first + i, pair.b, children_a[i], pair.sphere_b, gaps[i]});
      }
    } else {
      const Children children_b = placed_in_memory<kBranching>(b, pair.b, X_AB, &centres);
      for (std::uint32_t bits =
               gaps_below<kBranching>(children_b, node_b.count, pair.sphere_a, slack, nearest->limit, gaps);
           bits != 0; bits &= bits - 1) {
        const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
        stack.push({pair.a, node_b.first + k, pair.sphere_a, children_b[k], gaps[k]});
      }
    }
    stack.sort_from(before);
  }
}

void distance_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch,
                    NearestSpheres* nearest) {
  switch (a.branching()) {
    case 4:
      return search<4>(a, b, X_AB, scratch, nearest);
    case 8:
      return search<8>(a, b, X_AB, scratch, nearest);
    default:
      return search<16>(a, b, X_AB, scratch, nearest);
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(distance_lanes);

std::optional<SphereDistance> distance(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                                       SphereScratch& scratch, double below, std::optional<SpherePair> seed) {
  if (a.branching() != b.branching()) return scalar::distance(a, b, X_AB, scratch, below, seed);
  NearestSpheres nearest;
  nearest.lower_to(below);
  if (seed && is_pair_of(a, b, *seed)) nearest.take(distance_of(a, b, X_AB, *seed));
  HWY_DYNAMIC_DISPATCH(distance_lanes)(a, b, X_AB, &scratch, &nearest);
  return nearest.found;
}

}  // namespace prescene::collision
#endif  // HWY_ONCE
