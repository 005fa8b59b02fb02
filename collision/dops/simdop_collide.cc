// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/core/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simdop_collide.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "pair_batch-inl.h"
#include "simdop_volumes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

inline const float* planes_of(const SimdopTree& tree, float /*kind*/) { return tree.single_planes().data(); }
inline const std::uint16_t* planes_of(const SimdopTree& tree, std::uint16_t /*kind*/) {
  return tree.half_planes().data();
}

/// Number, among the set bits of `mask`, of bit `i`.
inline std::uint32_t rank(std::uint32_t mask, std::size_t i) {
  return static_cast<std::uint32_t>(std::popcount(mask & ((1U << i) - 1U)));
}

template <std::size_t kBranching, class Plane, SimdopTraversal kTraversal>
class SimdopQuery {
 public:
  SimdopQuery(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch* scratch,
              QueryCounts* counts)
      : a_(a),
        b_(b),
        stack_(scratch->node_pairs()),
        counts_(counts),
        steps_(DopDirections::of(a.options().k),
               Realignment(DopDirections::of(a.options().k), a.space(), b.space(), X_AB)),
        planes_a_(planes_of(a, Plane{})),
        planes_b_(planes_of(b, Plane{})),
        batch_(a.mesh(), b.mesh(), X_AB, counts) {}

  bool run() {
    stack_.clear();
    push(0, a_.nodes()[0].children, 0, b_.nodes()[0].children);
    while (!stack_.empty()) {
      const NodePair pair = stack_.back();
      stack_.pop_back();
      Overlaps overlaps = {};
      find_overlaps(pair, overlaps);
      if (counts_ != nullptr) {
        ++counts_->node_pairs;
        counts_->volume_tests +=
            static_cast<std::uint64_t>(std::popcount(pair.a_children) * std::popcount(pair.b_children));
      }
      if (descend(pair, overlaps)) return true;
    }
    return batch_.flush();
  }

 private:
  HWY_INLINE void push(std::uint32_t a, std::uint32_t a_children, std::uint32_t b, std::uint32_t b_children) {
    stack_.push_back({a, b, static_cast<std::uint16_t>(a_children), static_cast<std::uint16_t>(b_children)});
    hwy::Prefetch(planes_a_ + a * kBranching * steps_.count);
    hwy::Prefetch(planes_b_ + b * kBranching * steps_.count);
  }

  HWY_INLINE void find_overlaps(const NodePair& pair, Overlaps& overlaps) const {
    const std::size_t size = kBranching * steps_.count;
    const Plane* planes_a = planes_a_ + pair.a * size;
    const Plane* planes_b = planes_b_ + pair.b * size;
    if constexpr (sizeof(Plane) == 2) {
      HWY_ALIGN std::array<float, SimdopSteps::kMost> constant;
      shift_constants(steps_, a_.nodes()[pair.a], b_.nodes()[pair.b], constant.data());
      // Rows that are shorter than a vector are unpacked together, longer ones when they are needed.
      if constexpr (kBranching < 16 && kTraversal != SimdopTraversal::kOneVersusOne) {
        HWY_ALIGN std::array<float, SimdopSteps::kMost * kBranching> single_a;
        HWY_ALIGN std::array<float, SimdopSteps::kMost * kBranching> single_b;
        unpack_planes(planes_a, size, single_a.data());
        unpack_planes(planes_b, size, single_b.data());
        find_overlaps(pair, constant.data(), single_a.data(), single_b.data(), overlaps);
      } else {
        find_overlaps(pair, constant.data(), planes_a, planes_b, overlaps);
      }
    } else {
      find_overlaps(pair, steps_.constant.data(), planes_a, planes_b, overlaps);
    }
  }

  template <class Stored>
  HWY_INLINE void find_overlaps(const NodePair& pair, const float* constant, const Stored* planes_a,
                                const Stored* planes_b, Overlaps& overlaps) const {
    const std::uint32_t wanted_a = pair.a_children;
    const std::uint32_t wanted_b = pair.b_children;
    if constexpr (kTraversal == SimdopTraversal::kOneVersusOne) {
      one_versus_one<kBranching>(steps_, constant, planes_a, wanted_a, planes_b, wanted_b, overlaps);
    } else if (std::has_single_bit(wanted_b)) {
      const auto child_b = static_cast<std::size_t>(std::countr_zero(wanted_b));
      all_versus_one<kBranching>(steps_, constant, planes_a, wanted_a, planes_b, child_b, overlaps);
    } else if constexpr (kTraversal == SimdopTraversal::kFourVersusFour) {
      four_versus_four(steps_, constant, planes_a, wanted_a, planes_b, wanted_b, overlaps);
    } else if (std::has_single_bit(wanted_a)) {
      one_versus_all<kBranching>(steps_, constant, planes_a, wanted_a, planes_b, wanted_b, overlaps);
    } else {
      all_versus_each<kBranching>(steps_, constant, planes_a, wanted_a, planes_b, wanted_b, overlaps);
    }
  }

  HWY_INLINE bool descend(const NodePair& pair, const Overlaps& overlaps) {
    const SimdopTree::Node& a = a_.nodes()[pair.a];
    const SimdopTree::Node& b = b_.nodes()[pair.b];
    for (std::uint32_t rest_a = pair.a_children; rest_a != 0; rest_a &= rest_a - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest_a));
      const bool leaf_a = (a.leaves >> i & 1U) != 0;
      const std::uint32_t inner_a = leaf_a ? 0 : a.first_node + rank(a.children & ~a.leaves, i);
      for (std::uint32_t rest_b = overlaps[i]; rest_b != 0; rest_b &= rest_b - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(rest_b));
        const bool leaf_b = (b.leaves >> k & 1U) != 0;
        const std::uint32_t inner_b = leaf_b ? 0 : b.first_node + rank(b.children & ~b.leaves, k);
        if (leaf_a && leaf_b) {
          if (add_leaves(a.first_leaf + rank(a.leaves, i), b.first_leaf + rank(b.leaves, k))) return true;
        } else if (leaf_a) {
          push(pair.a, 1U << i, inner_b, b_.nodes()[inner_b].children);
        } else if (leaf_b) {
          push(inner_a, a_.nodes()[inner_a].children, pair.b, 1U << k);
        } else {
          push(inner_a, a_.nodes()[inner_a].children, inner_b, b_.nodes()[inner_b].children);
        }
      }
    }
    return false;
  }

  static std::uint32_t begin_of(const SimdopTree& tree, std::uint32_t leaf) {
    return tree.leaf_begin().empty() ? leaf : tree.leaf_begin()[leaf];
  }

  HWY_INLINE bool add_leaves(std::uint32_t leaf_a, std::uint32_t leaf_b) {
    for (std::uint32_t i = begin_of(a_, leaf_a); i < begin_of(a_, leaf_a + 1); ++i) {
      for (std::uint32_t k = begin_of(b_, leaf_b); k < begin_of(b_, leaf_b + 1); ++k) {
        if (batch_.add(a_.order()[i], b_.order()[k])) return true;
      }
    }
    return false;
  }

  const SimdopTree& a_;
  const SimdopTree& b_;
  std::vector<NodePair>& stack_;
  QueryCounts* counts_;
  SimdopSteps steps_;
  const Plane* planes_a_;
  const Plane* planes_b_;
  PairBatch batch_;
};

template <std::size_t kBranching, class Plane>
bool collide_traversing(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch* scratch,
                        QueryCounts* counts) {
  if (a.options().traversal == SimdopTraversal::kOneVersusOne)
    return SimdopQuery<kBranching, Plane, SimdopTraversal::kOneVersusOne>(a, b, X_AB, scratch, counts).run();
  if constexpr (kBranching == 4) {
    if (a.options().traversal == SimdopTraversal::kFourVersusFour)
      return SimdopQuery<4, Plane, SimdopTraversal::kFourVersusFour>(a, b, X_AB, scratch, counts).run();
  }
  return SimdopQuery<kBranching, Plane, SimdopTraversal::kOneVersusAll>(a, b, X_AB, scratch, counts).run();
}

template <class Plane>
bool collide_planes(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch* scratch,
                    QueryCounts* counts) {
  switch (a.options().branching) {
    case 2:
      return collide_traversing<2, Plane>(a, b, X_AB, scratch, counts);
    case 4:
      return collide_traversing<4, Plane>(a, b, X_AB, scratch, counts);
    case 8:
      return collide_traversing<8, Plane>(a, b, X_AB, scratch, counts);
    default:
      return collide_traversing<16, Plane>(a, b, X_AB, scratch, counts);
  }
}

bool collide_simdop(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch* scratch,
                    QueryCounts* counts) {
  if (a.options().precision == PlanePrecision::kHalf) return collide_planes<std::uint16_t>(a, b, X_AB, scratch, counts);
  return collide_planes<float>(a, b, X_AB, scratch, counts);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(collide_simdop);

bool collide(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB, QueryScratch& scratch,
             QueryCounts* counts) {
  const SimdopOptions& x = a.options();
  const SimdopOptions& y = b.options();
  PRESCENE_CHECK(x.k == y.k && x.branching == y.branching && x.precision == y.precision && x.traversal == y.traversal);
  return HWY_DYNAMIC_DISPATCH(collide_simdop)(a, b, X_AB, &scratch, counts);
}

}  // namespace prescene::collision
#endif
