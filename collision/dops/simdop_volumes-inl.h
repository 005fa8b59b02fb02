// SPDX-License-Identifier: Apache-2.0
// SIMDop's tests of the volumes below two nodes against each other. Included once for each instruction set.
#if defined(PRESCENE_COLLISION_DOPS_SIMDOP_VOLUMES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_DOPS_SIMDOP_VOLUMES_INL_H_
#undef PRESCENE_COLLISION_DOPS_SIMDOP_VOLUMES_INL_H_
#else
#define PRESCENE_COLLISION_DOPS_SIMDOP_VOLUMES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>

#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/triangle_pairs-inl.h"
#include "simdop_steps.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class D>
HWY_INLINE hn::Vec<D> load_planes(D d, const float* planes) {
  return hn::LoadU(d, planes);
}
template <class D>
HWY_INLINE hn::Vec<D> load_planes(D d, const std::uint16_t* planes) {
  const hn::Rebind<hwy::float16_t, D> halves;
  return hn::PromoteTo(d, hn::LoadU(halves, reinterpret_cast<const hwy::float16_t*>(planes)));
}

template <class D>
HWY_INLINE hn::Vec<D> broadcast_plane(D d, const float* plane) {
  return hn::Set(d, *plane);
}
template <class D>
HWY_INLINE hn::Vec<D> broadcast_plane(D d, const std::uint16_t* plane) {
  const hn::Rebind<hwy::float16_t, D> halves;
  const hn::Rebind<std::uint16_t, D> words;
  return hn::PromoteTo(d, hn::BitCast(halves, hn::Set(words, *plane)));
}

/// `count` planes in single precision; both arrays go on for a vector.
HWY_INLINE void unpack_planes(const std::uint16_t* planes, std::size_t count, float* single) {
  const PairTag d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) hn::Store(load_planes(d, planes + i), d, single + i);
}

HWY_INLINE float scalar_plane(const float* plane) { return *plane; }
HWY_INLINE float scalar_plane(const std::uint16_t* plane) { return from_half(*plane); }

/// The constants of all steps when planes are relative to points of the nodes; aligned.
HWY_INLINE void shift_constants(const SimdopSteps& steps, const SimdopTree::Node& a, const SimdopTree::Node& b,
                                float* shifted) {
  const PairTag d;
  for (std::size_t s = 0; s < steps.count; s += hn::Lanes(d)) {
    auto constant = hn::Load(d, &steps.constant[s]);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto by_a = hn::Set(d, SimdopTree::kShift * static_cast<float>(a.shift[c]));
      const auto by_b = hn::Set(d, SimdopTree::kShift * static_cast<float>(b.shift[c]));
      constant = hn::NegMulAdd(by_a, hn::Load(d, &steps.shift_a[c][s]), constant);
      constant = hn::NegMulAdd(by_b, hn::Load(d, &steps.shift_b[c][s]), constant);
    }
    hn::Store(constant, d, shifted + s);
  }
}

/// For each child of a in `wanted_a` the children of b in `wanted_b` whose volumes are not certainly disjoint from its.
using Overlaps = std::array<std::uint32_t, 16>;

// Lane l of a row of four: number l modulo 4, or number l / 4 of it, beginning with l = first.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE hn::Vec<PairTag> all_of_four(PairTag d, const float* row, std::size_t first) {
  return hn::Set(d, row[first % 4]);
}
HWY_INLINE hn::Vec<PairTag> each_of_four(PairTag d, const float* row, std::size_t first) {
  return hn::Set(d, row[first / 4]);
}
#else
HWY_INLINE hn::Vec<PairTag> all_of_four(PairTag d, const float* row, std::size_t /*first*/) {
  return hn::LoadDup128(d, row);
}
HWY_INLINE hn::Vec<PairTag> each_of_four(PairTag d, const float* row, std::size_t first) {
  const auto lanes = hn::Iota(hn::RebindToSigned<PairTag>(), static_cast<std::int32_t>(first));
  return hn::TableLookupLanes(all_of_four(d, row, first), hn::IndicesFromVec(d, hn::ShiftRight<2>(lanes)));
}
#endif

/// What the planes of A must reach at least along step s, for volumes of B from `planes_b` on, a plane every `stride`.
template <class D, class Plane>
HWY_INLINE hn::Vec<D> realigned_lanes(D d, const SimdopSteps& steps, const float* constant, std::size_t s,
                                      const Plane* planes_b, std::size_t stride) {
  auto bound = hn::Set(d, constant[s]);
  for (std::size_t n = 0; n < 3; ++n) {
    const Plane* row = planes_b + static_cast<std::size_t>(steps.planes[n][s]) * stride;
    bound = hn::NegMulAdd(hn::Set(d, steps.weights[n][s]), load_planes(d, row), bound);
  }
  return bound;
}

/// A volume and all children of a node; the children's planes are realigned when first needed.
template <std::size_t kBranching, class Plane>
HWY_INLINE void one_versus_all(const SimdopSteps& steps, const float* constant, const Plane* planes_a,
                               std::uint32_t wanted_a, const Plane* planes_b, std::uint32_t wanted_b,
                               Overlaps& overlaps) {
  const HWY_CAPPED(float, kBranching) d;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN std::array<float, SimdopSteps::kMost * kBranching> bounds;
  for (std::size_t first = 0; first < kBranching; first += lanes) {
    const auto wanted = mask_of_bits(d, wanted_b >> first);
    if (hn::AllFalse(d, wanted)) continue;
    std::size_t done = 0;
    for (std::uint32_t rest = wanted_a; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest));
      auto alive = wanted;
      for (std::size_t s = 0; s < steps.count; s += 2) {
        if (s >= done) {
          hn::Store(realigned_lanes(d, steps, constant, s, planes_b + first, kBranching), d, &bounds[s * lanes]);
          hn::Store(realigned_lanes(d, steps, constant, s + 1, planes_b + first, kBranching), d,
                    &bounds[(s + 1) * lanes]);
          done = s + 2;
        }
        const auto upper = broadcast_plane(d, planes_a + s * kBranching + i);
        const auto lower = broadcast_plane(d, planes_a + (s + 1) * kBranching + i);
        const auto apart = hn::Or(hn::Lt(upper, hn::Load(d, &bounds[s * lanes])),
                                  hn::Lt(lower, hn::Load(d, &bounds[(s + 1) * lanes])));
        alive = hn::AndNot(apart, alive);
        if (hn::AllFalse(d, alive)) break;
      }
      overlaps[i] |= bits_of_mask(d, alive) << first;
    }
  }
}

/// A row of planes in single precision: where it is, or in `buffer`.
template <std::size_t kBranching, class D>
HWY_INLINE void unpack_row(D /*d*/, const float* /*row*/, float* /*buffer*/) {}
template <std::size_t kBranching, class D>
HWY_INLINE void unpack_row(D d, const std::uint16_t* row, float* buffer) {
  for (std::size_t lane = 0; lane < kBranching; lane += hn::Lanes(d))
    hn::Store(load_planes(d, row + lane), d, buffer + lane);
}
HWY_INLINE const float* unpacked(const float* planes, const float* /*buffer*/) { return planes; }
HWY_INLINE const float* unpacked(const std::uint16_t* /*planes*/, const float* buffer) { return buffer; }

/// Each wanted child of b and all children of a; the rows of both are unpacked and realigned when first needed.
template <std::size_t kBranching, class Plane>
HWY_INLINE void all_versus_each(const SimdopSteps& steps, const float* constant, const Plane* planes_a,
                                std::uint32_t wanted_a, const Plane* planes_b, std::uint32_t wanted_b,
                                Overlaps& overlaps) {
  const HWY_CAPPED(float, kBranching) d;
  HWY_ALIGN std::array<float, SimdopSteps::kMost * kBranching> bounds;
  HWY_ALIGN std::array<float, sizeof(Plane) == 2 ? SimdopSteps::kMost * kBranching : 1> buffer;
  const float* rows_a = unpacked(planes_a, buffer.data());
  std::size_t done = 0;
  for (std::uint32_t rest = wanted_b; rest != 0; rest &= rest - 1) {
    const auto child_b = static_cast<std::size_t>(std::countr_zero(rest));
    for (std::size_t first = 0; first < kBranching; first += hn::Lanes(d)) {
      auto alive = mask_of_bits(d, wanted_a >> first);
      for (std::size_t s = 0; s < steps.count && !hn::AllFalse(d, alive); s += 2) {
        for (; done < s + 2; ++done) {
          unpack_row<kBranching>(d, planes_a + done * kBranching, buffer.data() + done * kBranching);
          for (std::size_t lane = 0; lane < kBranching; lane += hn::Lanes(d)) {
            hn::Store(realigned_lanes(d, steps, constant, done, planes_b + lane, kBranching), d,
                      &bounds[done * kBranching + lane]);
          }
        }
        const float* rows = rows_a + s * kBranching + first;
        const auto upper = hn::Lt(hn::LoadU(d, rows), hn::Set(d, bounds[s * kBranching + child_b]));
        const auto lower = hn::Lt(hn::LoadU(d, rows + kBranching), hn::Set(d, bounds[(s + 1) * kBranching + child_b]));
        alive = hn::AndNot(hn::Or(upper, lower), alive);
      }
      for (std::uint32_t found = bits_of_mask(d, alive) << first; found != 0; found &= found - 1)
        overlaps[static_cast<std::size_t>(std::countr_zero(found))] |= 1U << child_b;
    }
  }
}

/// All children of a and one of b: what a leaf of B is tested with.
template <std::size_t kBranching, class Plane>
HWY_INLINE void all_versus_one(const SimdopSteps& steps, const float* constant, const Plane* planes_a,
                               std::uint32_t wanted_a, const Plane* planes_b, std::size_t child_b, Overlaps& overlaps) {
  const HWY_CAPPED(float, kBranching) d;
  std::array<float, SimdopSteps::kMost> bounds;
  std::size_t done = 0;
  for (std::size_t first = 0; first < kBranching; first += hn::Lanes(d)) {
    auto alive = mask_of_bits(d, wanted_a >> first);
    for (std::size_t s = 0; s < steps.count && !hn::AllFalse(d, alive); s += 2) {
      for (; done < s + 2; ++done) {
        bounds[done] = constant[done];
        for (std::size_t n = 0; n < 3; ++n) {
          const Plane* plane = planes_b + static_cast<std::size_t>(steps.planes[n][done]) * kBranching + child_b;
          bounds[done] -= steps.weights[n][done] * scalar_plane(plane);
        }
      }
      const auto upper = load_planes(d, planes_a + s * kBranching + first);
      const auto lower = load_planes(d, planes_a + (s + 1) * kBranching + first);
      alive = hn::AndNot(hn::Or(hn::Lt(upper, hn::Set(d, bounds[s])), hn::Lt(lower, hn::Set(d, bounds[s + 1]))), alive);
    }
    for (std::uint32_t rest = bits_of_mask(d, alive) << first; rest != 0; rest &= rest - 1)
      overlaps[static_cast<std::size_t>(std::countr_zero(rest))] |= 1U << child_b;
  }
}

/// As realigned_lanes, for all of four volumes.
HWY_INLINE hn::Vec<PairTag> realigned_fours(PairTag d, const SimdopSteps& steps, const float* constant, std::size_t s,
                                            const float* planes_b, std::size_t first) {
  auto bound = hn::Set(d, constant[s]);
  for (std::size_t n = 0; n < 3; ++n) {
    const float* row = planes_b + 4 * static_cast<std::size_t>(steps.planes[n][s]);
    bound = hn::NegMulAdd(hn::Set(d, steps.weights[n][s]), all_of_four(d, row, first), bound);
  }
  return bound;
}

/// All 16 pairs of the children of two nodes.
HWY_INLINE void four_versus_four(const SimdopSteps& steps, const float* constant, const float* planes_a,
                                 std::uint32_t wanted_a, const float* planes_b, std::uint32_t wanted_b,
                                 Overlaps& overlaps) {
  const PairTag d;
  std::uint32_t wanted = 0;
  for (std::uint32_t i = 0; i < 4; ++i) wanted |= (wanted_a >> i & 1U) != 0 ? wanted_b << 4U * i : 0U;
  std::uint32_t found = 0;
  for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
    auto alive = mask_of_bits(d, wanted >> first);
    for (std::size_t s = 0; s < steps.count && !hn::AllFalse(d, alive); s += 2) {
      const auto upper =
          hn::Lt(each_of_four(d, planes_a + 4 * s, first), realigned_fours(d, steps, constant, s, planes_b, first));
      const auto lower = hn::Lt(each_of_four(d, planes_a + 4 * (s + 1), first),
                                realigned_fours(d, steps, constant, s + 1, planes_b, first));
      alive = hn::AndNot(hn::Or(upper, lower), alive);
    }
    found |= bits_of_mask(d, alive) << first;
  }
  for (std::size_t i = 0; i < 4; ++i) overlaps[i] |= found >> 4 * i & 15U;
}

/// Pair after pair, with planes that lie child by child.
template <std::size_t kBranching, class Plane>
HWY_INLINE void one_versus_one(const SimdopSteps& steps, const float* constant, const Plane* planes_a,
                               std::uint32_t wanted_a, const Plane* planes_b, std::uint32_t wanted_b,
                               Overlaps& overlaps) {
  const PairTag d;
  const hn::RebindToSigned<PairTag> indices;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t k = steps.count;
  HWY_ALIGN std::array<float, SimdopSteps::kMost> single;
  HWY_ALIGN std::array<float, SimdopSteps::kMost> bounds;
  for (std::uint32_t rest_b = wanted_b; rest_b != 0; rest_b &= rest_b - 1) {
    const auto child_b = static_cast<std::size_t>(std::countr_zero(rest_b));
    for (std::size_t s = 0; s < k; s += lanes) hn::Store(load_planes(d, planes_b + child_b * k + s), d, &single[s]);
    std::size_t done = 0;
    for (std::uint32_t rest_a = wanted_a; rest_a != 0; rest_a &= rest_a - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest_a));
      bool apart = false;
      for (std::size_t s = 0; s < k && !apart; s += lanes) {
        if (s >= done) {
          auto sum = hn::Load(d, constant + s);
          for (std::size_t n = 0; n < 3; ++n) {
            const auto planes = hn::GatherIndex(d, single.data(), hn::Load(indices, &steps.planes[n][s]));
            sum = hn::NegMulAdd(hn::Load(d, &steps.weights[n][s]), planes, sum);
          }
          hn::Store(sum, d, &bounds[s]);
          done = s + lanes;
        }
        const auto below = hn::Lt(load_planes(d, planes_a + i * k + s), hn::Load(d, &bounds[s]));
        apart = !hn::AllFalse(d, hn::And(below, hn::FirstN(d, std::min(lanes, k - s))));
      }
      if (!apart) overlaps[i] |= 1U << child_b;
    }
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
