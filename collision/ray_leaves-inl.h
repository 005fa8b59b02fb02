// SPDX-License-Identifier: Apache-2.0
// A ray against the four triangles of a leaf, in double precision: `meet` of ray_triangle.h, operation by operation.
// Included once for each instruction set.
#if defined(PRESCENE_COLLISION_RAY_LEAVES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_RAY_LEAVES_INL_H_
#undef PRESCENE_COLLISION_RAY_LEAVES_INL_H_
#else
#define PRESCENE_COLLISION_RAY_LEAVES_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "prescene/collision/ray_triangle.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What is known of a ray's nearest hit.
struct NearestHit {
  double s;  ///< Metres along z; the end of the ray while there is no hit.
  std::uint32_t triangle = kNoTriangle;
  std::array<double, 3> areas = {0, 0, 0};
  double sum = 0.0;
};

/// Of the four triangles where there is a hit.
struct BlockHits {
  HWY_ALIGN double s[4];
  HWY_ALIGN double areas[3][4];
  HWY_ALIGN double sum[4];
};

/// Which triangles of a block are hit.
HWY_INLINE std::uint32_t meet_block(const ShearedRay& ray, const TriangleBlock& block, BlockHits* hits) {
  const hn::CappedTag<double, 4> d;
  using V = hn::Vec<hn::CappedTag<double, 4>>;
  const hn::Rebind<float, hn::CappedTag<double, 4>> df;
  const V zero = hn::Zero(d);
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    V x[3];
    V y[3];
    V z[3];
    for (int i = 0; i < 3; ++i) {
      const auto from_origin = [&](int k) HWY_ATTR {
        const auto coordinate = hn::LoadU(df, block.corners[i][ray.order[static_cast<std::size_t>(k)]] + lane);
        return hn::Sub(hn::PromoteTo(d, coordinate), hn::Set(d, ray.origin[static_cast<std::size_t>(k)]));
      };
      z[i] = from_origin(2);
      x[i] = hn::Sub(from_origin(0), hn::Mul(hn::Set(d, ray.shear[0]), z[i]));
      y[i] = hn::Sub(from_origin(1), hn::Mul(hn::Set(d, ray.shear[1]), z[i]));
    }
    const V u = hn::Sub(hn::Mul(x[2], y[1]), hn::Mul(y[2], x[1]));
    const V v = hn::Sub(hn::Mul(x[0], y[2]), hn::Mul(y[0], x[2]));
    const V w = hn::Sub(hn::Mul(x[1], y[0]), hn::Mul(y[1], x[0]));
    const V smallest = hn::Min(hn::Min(u, v), w);
    const V largest = hn::Max(hn::Max(u, v), w);
    const auto inside = hn::Or(hn::Ge(smallest, zero), hn::Le(largest, zero));
    if (hn::AllFalse(d, inside)) continue;
    const V sum = hn::Add(hn::Add(u, v), w);
    const V height = hn::Add(hn::Add(hn::Mul(u, z[0]), hn::Mul(v, z[1])), hn::Mul(w, z[2]));
    const V s = hn::Mul(hn::Set(d, ray.sign), hn::Div(height, sum));
    const V farthest = hn::Max(hn::Max(hn::Abs(z[0]), hn::Abs(z[1])), hn::Abs(z[2]));
    const V slack = hn::Mul(hn::Set(d, kRangeSlack), farthest);
    const auto in_range =
        hn::And(hn::Ge(s, hn::Sub(hn::Set(d, ray.s_min), slack)), hn::Le(s, hn::Add(hn::Set(d, ray.s_max), slack)));
    const auto hit = hn::And(hn::And(inside, hn::Ne(sum, zero)), in_range);
    if (hn::AllFalse(d, hit)) continue;
    hn::Store(s, d, hits->s + lane);
    hn::Store(u, d, hits->areas[0] + lane);
    hn::Store(v, d, hits->areas[1] + lane);
    hn::Store(w, d, hits->areas[2] + lane);
    hn::Store(sum, d, hits->sum + lane);
    bits |= bits_of_mask(d, hit) << lane;
  }
  return bits;
}

/// Makes `nearest` the nearest of itself and the hits in a block; whether it changed.
HWY_INLINE bool keep_nearest(const ShearedRay& ray, const TriangleBlock& block, const TriangleReferences& references,
                             NearestHit* nearest) {
  BlockHits hits;
  bool changed = false;
  for (std::uint32_t bits = meet_block(ray, block, &hits); bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(bits));
    const double s = hits.s[i];
    const bool first = nearest->triangle == kNoTriangle;
    if (references[i] == kNoTriangle) continue;
    if (!first && !(s < nearest->s || (s == nearest->s && references[i] < nearest->triangle))) continue;
    *nearest = {s, references[i], {hits.areas[0][i], hits.areas[1][i], hits.areas[2][i]}, hits.sum[i]};
    changed = true;
  }
  return changed;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
