// SPDX-License-Identifier: Apache-2.0
// The impulses that rows start from: those of the step before.
#if defined(PRESCENE_SIMULATION_IMPULSE_WARM_START_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_IMPULSE_WARM_START_INL_H_
#undef PRESCENE_SIMULATION_IMPULSE_WARM_START_INL_H_
#else
#define PRESCENE_SIMULATION_IMPULSE_WARM_START_INL_H_
#endif

#include <algorithm>
#include <type_traits>

#include "impulse_rows-inl.h"
#include "lane_math-inl.h"
#include "lane_state.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/rules/sphere_rules.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// Each impulse of the step before goes to the contact that is nearest to where it acted among those that bear
/// (kBearing), and to no other: what bore is borne once.
template <bool kMany>
void ContactRows<kMany>::find_heirs(const RowGroup& group, int warm_count, V reach) {
  const D d;
  for (int j = 0; j < warm_count; ++j) {
    const Vec3<V> place{hn::Load(d, warm_[j][0]), hn::Load(d, warm_[j][1]), hn::Load(d, warm_[j][2])};
    const V part = hn::Load(d, warm_[j][7]);
    V heir = set<V>(-1.0);
    V nearest = reach * reach;
    for (int row = group.first; row < group.first + group.count; ++row) {
      const Vec3<V> apart = place - get3(row, kPosition);
      const V squared = dot(apart, apart);
      const auto bears = hn::Le(get(row, kAtEnd), set<V>(kBearing));
      const auto nearer = hn::And(hn::And(hn::Eq(get(row, kPart), part), bears), hn::Lt(squared, nearest));
      nearest = select(nearer, squared, nearest);
      heir = select(nearer, set<V>(static_cast<double>(row)), heir);
    }
    hn::Store(heir, d, heirs_[j]);
  }
}

template <bool kMany>
void ContactRows<kMany>::warm_start(Rates* changes) {
  const D d;
  int loaded = -1;  // the object whose warm contacts these are
  int warm_count = 0;
  for (const RowGroup& group : groups()) {
    if (loaded != group.a) {
      loaded = group.a;
      warm_count = 0;
      for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        warm_count = std::max(warm_count, state_.warm_count[static_cast<std::size_t>(state_.at(group.a, slots_[i]))]);
      }
      for (int j = 0; j < warm_count; ++j) {
        for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
          const int at = state_.at(group.a, slots_[i]);
          const bool there = j < state_.warm_count[static_cast<std::size_t>(at)];
          const WarmContact& warm = state_.warm(at)[j];
          for (std::size_t f = 0; f < 3; ++f) {
            warm_[j][f][i] = there ? warm.position[f] : Real(0);
            warm_[j][4 + f][i] = there ? warm.friction[f] : Real(0);
          }
          warm_[j][3][i] = there ? warm.impulse : Real(0);
          warm_[j][7][i] = there ? static_cast<Real>(warm.part) : Real(-2);
        }
      }
    }
    // A contact moves on its bodies by what they slide in a step.
    V reach = object(group.a).travel + set<V>(kSameContact);
    V pulled = object(group.a).pulled;
    if (kMany && group.b >= 0) {
      reach = reach + object(group.b).travel;
      pulled = hn::Max(pulled, object(group.b).pulled);
    }
    const V share = hn::Min(set<V>(1.0), pulled * set<V>(1.0 / settings_.dt));
    Rates& a = changes[group.a];
    Rates& b = changes[kMany && group.b >= 0 ? group.b : group.a];
    find_heirs(group, warm_count, reach);
    for (int row = group.first; row < group.first + group.count; ++row) {
      V impulse = set<V>(0.0);
      Vec3<V> slip = set3<V>(0.0, 0.0, 0.0);
      for (int j = 0; j < warm_count; ++j) {
        const auto column = [&](std::size_t f) HWY_ATTR { return hn::Load(d, warm_[j][f]); };
        const V counts =
            hn::IfThenElseZero(hn::Eq(hn::Load(d, heirs_[j]), set<V>(static_cast<double>(row))), set<V>(1.0));
        impulse = impulse + counts * column(3);
        slip = slip + Vec3<V>{column(4), column(5), column(6)} * counts;
      }
      // A guess, never more than it was: an impact that something at rest bore was as much in a part of a step.
      impulse = impulse * share;
      slip = slip * share;
      V slip_1 = dot(slip, get3(row, kTangent1));
      V slip_2 = dot(slip, get3(row, kTangent2));
      const V limit = get(row, kMu) * impulse;
      const V size = hn::Sqrt(slip_1 * slip_1 + slip_2 * slip_2);
      const auto too_large = hn::Gt(size, limit);
      const V scale = select(too_large, limit / select(too_large, size, set<V>(1.0)), set<V>(1.0));
      slip_1 = slip_1 * scale;
      slip_2 = slip_2 * scale;
      put(row, kImpulse, impulse);
      put(row, kSlip1, slip_1);
      put(row, kSlip2, slip_2);
      const auto apply_all = [&](auto pair) HWY_ATTR {
        constexpr bool kPair = decltype(pair)::value;
        apply<kPair>(group, axis<kPair>(row, kNormal), impulse, a, b);
        apply<kPair>(group, axis<kPair>(row, kTangent1), slip_1, a, b);
        apply<kPair>(group, axis<kPair>(row, kTangent2), slip_2, a, b);
      };
      if (kMany && group.b >= 0) {
        apply_all(std::bool_constant<kMany>());
      } else {
        apply_all(std::false_type());
      }
    }
  }
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
