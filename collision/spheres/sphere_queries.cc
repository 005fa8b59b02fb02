// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sphere_queries.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "prescene/collision/spheres/scalar_sphere_queries.h"
#include "sphere_descent-inl.h"
#include "sphere_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Calls body with the branching as a constant.
template <class Body>
HWY_INLINE auto with_branching(std::size_t branching, const Body& body) {
  switch (branching) {
    case 4:
      return body(std::integral_constant<std::size_t, 4>());
    case 8:
      return body(std::integral_constant<std::size_t, 8>());
    default:
      return body(std::integral_constant<std::size_t, 16>());
  }
}

bool overlap_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch) {
  return with_branching(a.branching(), [&](auto branching) HWY_ATTR {
    return find_overlap<decltype(branching)::value>(a, b, X_AB, scratch);
  });
}

template <class Sum>
HWY_INLINE void sum_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch,
                          Sum* sum) {
  with_branching(a.branching(), [&](auto branching) HWY_ATTR {
    constexpr std::size_t kBranching = decltype(branching)::value;
    return for_bottom_pairs<kBranching>(a, b, X_AB, scratch,
                                        [&](const SphereTree::Node& node_a, const SphereTree::Node&,
                                            const Children& children_a, const PlacedChildren<kBranching>& children_b)
                                            HWY_ATTR {
                                              gather_pairs<kBranching>(children_a, node_a.count, children_b, sum);
                                              return false;
                                            });
  });
}

void overlap_volume_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch* scratch,
                          SphereOverlap* result) {
  VolumeSum sum(&scratch->gathered);
  sum_pairs(a, b, X_AB, scratch, &sum);
  *result = sum.finish();
}

void penalty_wrench_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                          const PenaltyOptions& options, SphereScratch* scratch, PenaltyWrench* result) {
  ForceSum sum(options.p_AP, &scratch->gathered);
  sum_pairs(a, b, X_AB, scratch, &sum);
  *result = sum.finish(options.stiffness);
}

bool contacts_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB, std::size_t limit,
                    std::vector<SphereContact>* contacts, SphereScratch* scratch) {
  const std::size_t most = contacts->size() + limit;
  return !with_branching(a.branching(), [&](auto branching) HWY_ATTR {
    constexpr std::size_t kBranching = decltype(branching)::value;
    const auto leaves = [&](const SphereTree::Node& node_a, const SphereTree::Node& node_b, const Children& children_a,
                            const PlacedChildren<kBranching>& children_b) HWY_ATTR {
      bool full = false;
      for_rows<kBranching>(children_a, node_a.count, children_b, 0.0F,
                           [&](std::size_t row, std::size_t lane, const PairVector& pairs) HWY_ATTR {
                             for (std::uint32_t bits = mask_bits(pairs.meet); bits != 0 && !full; bits &= bits - 1) {
                               full = contacts->size() == most;
                               if (full) return;
                               const auto at = static_cast<std::size_t>(std::countr_zero(bits));
                               const std::size_t i = row + (Rows<kBranching>::kRows == 1 ? 0 : at / kBranching);
                               const std::size_t k = lane + (Rows<kBranching>::kRows == 1 ? at : at % kBranching);
                               contacts->push_back(make_contact(a, b, children_a[i], children_b[k],
                                                                {node_a.first + static_cast<std::uint32_t>(i),
                                                                 node_b.first + static_cast<std::uint32_t>(k)}));
                             }
                           });
      return full;
    };
    return for_bottom_pairs<kBranching>(a, b, X_AB, scratch, leaves);
  });
}

void near_pairs_lanes(const SphereTree& a, const SphereTree& b, const Transform& X_AB, float range,
                      std::vector<SpherePair>* pairs, SphereScratch* scratch) {
  with_branching(a.branching(), [&](auto branching) HWY_ATTR {
    constexpr std::size_t kBranching = decltype(branching)::value;
    const auto leaves = [&](const SphereTree::Node& node_a, const SphereTree::Node& node_b, const Children& children_a,
                            const PlacedChildren<kBranching>& children_b) HWY_ATTR {
      for_rows<kBranching>(children_a, node_a.count, children_b, range,
                           [&](std::size_t row, std::size_t lane, const PairVector& found) HWY_ATTR {
                             for (std::uint32_t bits = mask_bits(found.meet); bits != 0; bits &= bits - 1) {
                               const auto at = static_cast<std::size_t>(std::countr_zero(bits));
                               const std::size_t i = row + (Rows<kBranching>::kRows == 1 ? 0 : at / kBranching);
                               const std::size_t k = lane + (Rows<kBranching>::kRows == 1 ? at : at % kBranching);
                               pairs->push_back({a.order()[node_a.first + i], b.order()[node_b.first + k]});
                             }
                           });
      return false;
    };
    return for_bottom_pairs<kBranching>(a, b, X_AB, scratch, leaves, range);
  });
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(overlap_lanes);
HWY_EXPORT(overlap_volume_lanes);
HWY_EXPORT(penalty_wrench_lanes);
HWY_EXPORT(contacts_lanes);
HWY_EXPORT(near_pairs_lanes);

bool overlap(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch) {
  if (a.branching() != b.branching()) return scalar::overlap(a, b, X_AB, scratch);
  return HWY_DYNAMIC_DISPATCH(overlap_lanes)(a, b, X_AB, &scratch);
}

SphereOverlap overlap_volume(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch) {
  if (a.branching() != b.branching()) return scalar::overlap_volume(a, b, X_AB, scratch);
  SphereOverlap result;
  HWY_DYNAMIC_DISPATCH(overlap_volume_lanes)(a, b, X_AB, &scratch, &result);
  return result;
}

PenaltyWrench penalty_wrench(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch) {
  if (a.branching() != b.branching()) return scalar::penalty_wrench(a, b, X_AB, options, scratch);
  PenaltyWrench result;
  HWY_DYNAMIC_DISPATCH(penalty_wrench_lanes)(a, b, X_AB, options, &scratch, &result);
  return result;
}

bool contacts(const SphereTree& a, const SphereTree& b, const Transform& X_AB, std::size_t limit,
              std::vector<SphereContact>* contacts, SphereScratch& scratch) {
  if (a.branching() != b.branching()) return scalar::contacts(a, b, X_AB, limit, contacts, scratch);
  return HWY_DYNAMIC_DISPATCH(contacts_lanes)(a, b, X_AB, limit, contacts, &scratch);
}

void near_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB, double range,
                std::vector<SpherePair>* pairs, SphereScratch& scratch) {
  if (a.branching() != b.branching()) return scalar::near_pairs(a, b, X_AB, range, pairs, scratch);
  HWY_DYNAMIC_DISPATCH(near_pairs_lanes)(a, b, X_AB, static_cast<float>(range), pairs, &scratch);
}

}  // namespace prescene::collision
#endif  // HWY_ONCE
