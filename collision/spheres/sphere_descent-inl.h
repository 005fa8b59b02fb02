// SPDX-License-Identifier: Apache-2.0
// Simultaneous descent of two sphere trees of the same branching. Included once for each instruction set.
#include "sphere_rows-inl.h"

#if defined(PRESCENE_COLLISION_SPHERE_DESCENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_SPHERE_DESCENT_INL_H_
#undef PRESCENE_COLLISION_SPHERE_DESCENT_INL_H_
#else
#define PRESCENE_COLLISION_SPHERE_DESCENT_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

using IndexTag = hn::RebindToUnsigned<Tag>;

/// Pairs of nodes, with room for all that one pair of nodes can add.
class PairList {
 public:
  PairList(std::vector<std::uint32_t>* a, std::vector<std::uint32_t>* b) : memory_a_(a), memory_b_(b) { make_room(); }
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  std::uint32_t a(std::size_t i) const { return a_[i]; }
  std::uint32_t b(std::size_t i) const { return b_[i]; }
  HWY_INLINE void make_room() {
    if (memory_a_->size() < size_ + kRoom) grow();
  }
  void push(std::uint32_t a, std::uint32_t b) {
    a_[size_] = a;
    b_[size_] = b;
    ++size_;
  }
  void pop() { --size_; }
  void swap_with_last(std::size_t i) {
    std::swap(a_[i], a_[size_ - 1]);
    std::swap(b_[i], b_[size_ - 1]);
  }
  /// Adds the pairs of children first_a + i and first_b + k of those lanes.
  template <std::size_t kBranching>
  HWY_INLINE void push_lanes(M mask, std::uint32_t first_a, std::uint32_t first_b) {
    const IndexTag d;
    const auto meet = hn::RebindMask(d, mask);
    const auto lane = hn::Iota(d, 0);
    auto b = hn::Add(lane, hn::Set(d, first_b));
    if constexpr (Rows<kBranching>::kRows == 1) {
      hn::StoreU(hn::Set(d, first_a), d, a_ + size_);
    } else {
      const auto row = hn::ShiftRight < kBranching == 4 ? 2 : 3 > (lane);
      const auto a = hn::Add(row, hn::Set(d, first_a));
      b = hn::Sub(b, hn::ShiftLeft < kBranching == 4 ? 2 : 3 > (row));
      hn::StoreU(hn::Compress(a, meet), d, a_ + size_);
    }
    hn::StoreU(hn::Compress(b, meet), d, b_ + size_);
    size_ += hn::CountTrue(Tag(), mask);
  }

 private:
  static constexpr std::size_t kRoom = SphereTree::kMostBranching * SphereTree::kMostBranching + 16;

  void grow() {
    memory_a_->resize(2 * (size_ + kRoom));
    memory_b_->resize(2 * (size_ + kRoom));
    a_ = memory_a_->data();
    b_ = memory_b_->data();
  }

  std::vector<std::uint32_t>* memory_a_;
  std::vector<std::uint32_t>* memory_b_;
  std::uint32_t* a_ = memory_a_->data();
  std::uint32_t* b_ = memory_b_->data();
  std::size_t size_ = 0;
};

/// Adds the pairs of children that may overlap to `list`. One of the nodes is no bottom node; of a bottom node itself
/// goes on. `scores`, where given, gets how much each overlaps, in m^2.
template <std::size_t kBranching, bool kScores>
HWY_INLINE void expand(std::uint32_t index_a, std::uint32_t index_b, SphereTree::Node node_a, SphereTree::Node node_b,
                       const Children& children_a, const PlacedChildren<kBranching>& children_b, float slack,
                       PairList* list, float* scores) {
  const Tag d;
  list->make_room();
  const std::size_t before = list->size();
  if (!node_a.is_bottom() && !node_b.is_bottom()) {
    for_rows<kBranching>(children_a, node_a.count, children_b, slack,
                         [&](std::size_t row, std::size_t lane, const PairVector& pairs) HWY_ATTR {
                           if constexpr (kScores) {
                             const V score = hn::Sub(pairs.reach_squared, pairs.squared);
                             hn::StoreU(hn::Compress(score, pairs.meet), d, scores + (list->size() - before));
                           }
                           list->push_lanes<kBranching>(pairs.meet, node_a.first + static_cast<std::uint32_t>(row),
                                                        node_b.first + static_cast<std::uint32_t>(lane));
                         });
    return;
  }
  // One bit for each child that meets one of the bottom node's spheres.
  std::uint32_t met = 0;
  for_rows<kBranching>(children_a, node_a.count, children_b, slack,
                       [&](std::size_t row, std::size_t lane, const PairVector& pairs) HWY_ATTR {
                         std::uint32_t bits = mask_bits(pairs.meet);
                         constexpr std::uint32_t kRowBits = (1U << std::min(kBranching, kLanes)) - 1U;
                         for (std::size_t i = 0; i < Rows<kBranching>::kRows; ++i) {
                           const std::uint32_t of_row = bits & kRowBits;
                           if (node_a.is_bottom()) {
                             met |= of_row << lane;
                           } else if (of_row != 0) {
                             met |= 1U << (row + i);
                           }
                           bits >>= Rows<kBranching>::kRows == 1 ? 0U : kBranching;
                         }
                       });
  for (; met != 0; met &= met - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(met));
    if constexpr (kScores) scores[list->size() - before] = 0.0F;
    if (node_a.is_bottom()) {
      list->push(index_a, node_b.first + i);
    } else {
      list->push(node_a.first + i, index_b);
    }
  }
}

/// Calls leaves(node of A, node of B, children of A, placed children of B) for each pair of bottom nodes whose spheres
/// may overlap, or be up to `range` apart, until it returns true; then returns true. A level at a time: what a pair
/// needs then never waits for the pair before.
template <std::size_t kBranching, class Leaves>
HWY_INLINE bool for_bottom_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                                 SphereScratch* scratch, const Leaves& leaves, float range = 0.0F) {
  const float slack = slack_of(a, b, X_AB) + range;
  const TransformLanes X_AB_lanes(X_AB);
  if (!meet(a.root(), placed(X_AB, b.root()), slack)) return false;
  PairList first(&scratch->nodes_a, &scratch->nodes_b);
  PairList second(&scratch->next_a, &scratch->next_b);
  PairList* level = &first;
  PairList* next = &second;
  const SphereTree::Node* nodes_a = a.nodes().data();
  const SphereTree::Node* nodes_b = b.nodes().data();
  level->push(0, 0);
  while (level->size() > 0) {
    next->clear();
    for (std::size_t i = 0; i < level->size(); ++i) {
      const std::uint32_t index_a = level->a(i);
      const std::uint32_t index_b = level->b(i);
      const SphereTree::Node node_a = nodes_a[index_a];
      const SphereTree::Node node_b = nodes_b[index_b];
      const Children children_a = children_of<kBranching>(a, index_a);
      const PlacedChildren<kBranching> children_b =
          place_children<kBranching>(children_of<kBranching>(b, index_b), X_AB_lanes);
      if (node_a.is_bottom() && node_b.is_bottom()) {
        if (leaves(node_a, node_b, children_a, children_b)) return true;
      } else {
        expand<kBranching, false>(index_a, index_b, node_a, node_b, children_a, children_b, slack, next, nullptr);
      }
    }
    std::swap(level, next);
  }
  return false;
}

/// The pair of children that overlaps the most, by the square of the sum of the radii less the squared distance.
struct BestPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  bool found = false;
};
template <std::size_t kBranching>
HWY_INLINE BestPair most_overlapping(const Children& children_a, std::size_t count_a,
                                     const PlacedChildren<kBranching>& children_b, float slack) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const V none = hn::Set(d, -1.0F);
  V best = none;
  auto where = hn::Zero(di);  // Row and first lane of the best pair of each lane.
  for_rows<kBranching>(children_a, count_a, children_b, slack,
                       [&](std::size_t row, std::size_t lane, const PairVector& pairs) HWY_ATTR {
                         const V overlap = hn::Sub(pairs.reach_squared, pairs.squared);
                         const V score = hn::IfThenElse(pairs.meet, overlap, none);
                         const M better = hn::Gt(score, best);
                         best = hn::Max(best, score);
                         const auto here = hn::Set(di, static_cast<std::int32_t>(16 * row + lane));
                         where = hn::IfThenElse(hn::RebindMask(di, better), here, where);
                       });
  const V most = hn::MaxOfLanes(d, best);
  if (hn::GetLane(most) < 0.0F) return {};
  const std::intptr_t at = hn::FindFirstTrue(d, hn::Eq(best, most));
  HWY_ALIGN std::int32_t places[kLanes];
  hn::Store(where, di, places);
  const auto place = static_cast<std::uint32_t>(places[at]);
  const auto lane = static_cast<std::uint32_t>(at);
  if constexpr (Rows<kBranching>::kRows == 1) {
    return {place / 16, place % 16 + lane, true};
  } else {
    return {place / 16 + lane / kBranching, lane % kBranching, true};
  }
}

/// Goes down to the most overlapping children only. Finds most overlaps of bodies that overlap much.
template <std::size_t kBranching>
HWY_INLINE bool dive(const SphereTree& a, const SphereTree& b, const TransformLanes& X_AB, float slack) {
  std::uint32_t index_a = 0;
  std::uint32_t index_b = 0;
  while (true) {
    const SphereTree::Node node_a = a.nodes()[index_a];
    const SphereTree::Node node_b = b.nodes()[index_b];
    const bool bottoms = node_a.is_bottom() && node_b.is_bottom();
    const PlacedChildren<kBranching> children_b = place_children<kBranching>(children_of<kBranching>(b, index_b), X_AB);
    const BestPair best = most_overlapping<kBranching>(children_of<kBranching>(a, index_a), node_a.count, children_b,
                                                       bottoms ? 0.0F : slack);
    if (!best.found || bottoms) return best.found;
    if (!node_a.is_bottom()) index_a = node_a.first + best.a;
    if (!node_b.is_bottom()) index_b = node_b.first + best.b;
  }
}

/// Whether any spheres overlap.
template <std::size_t kBranching>
HWY_INLINE bool find_overlap(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch) {
  const float slack = slack_of(a, b, X_AB);
  if (!meet(a.root(), placed(X_AB, b.root()), slack)) return false;
  const TransformLanes X_AB_lanes(X_AB);
  if (dive<kBranching>(a, b, X_AB_lanes, slack)) return true;
  PairList stack(&scratch->nodes_a, &scratch->nodes_b);
  stack.push(0, 0);
  HWY_ALIGN float scores[SphereTree::kMostBranching * SphereTree::kMostBranching + 16];
  while (stack.size() > 0) {
    const std::uint32_t index_a = stack.a(stack.size() - 1);
    const std::uint32_t index_b = stack.b(stack.size() - 1);
    stack.pop();
    const SphereTree::Node node_a = a.nodes()[index_a];
    const SphereTree::Node node_b = b.nodes()[index_b];
    const Children children_a = children_of<kBranching>(a, index_a);
    const PlacedChildren<kBranching> children_b =
        place_children<kBranching>(children_of<kBranching>(b, index_b), X_AB_lanes);
    if (node_a.is_bottom() && node_b.is_bottom()) {
      if (most_overlapping<kBranching>(children_a, node_a.count, children_b, 0.0F).found) return true;
      continue;
    }
    const std::size_t before = stack.size();
    expand<kBranching, true>(index_a, index_b, node_a, node_b, children_a, children_b, slack, &stack, scores);
    const std::size_t added = stack.size() - before;
    if (added < 2) continue;
    const auto most = static_cast<std::size_t>(std::max_element(scores, scores + added) - scores);
    stack.swap_with_last(before + most);
  }
  return false;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // PRESCENE_COLLISION_SPHERE_DESCENT_INL_H_
