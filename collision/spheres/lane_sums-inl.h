// SPDX-License-Identifier: Apache-2.0
// Sums of products in lanes whose bits are the same for every instruction set. Included once for each of them.
#if defined(PRESCENE_COLLISION_LANE_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_LANE_SUMS_INL_H_
#undef PRESCENE_COLLISION_LANE_SUMS_INL_H_
#else
#define PRESCENE_COLLISION_LANE_SUMS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are rounded one by one, so that every instruction set keeps the same pairs.
template <class V>
HWY_INLINE V madd(V a, V b, V c) {
  return hn::Add(hn::Mul(a, b), c);
}
template <class V>
HWY_INLINE V dot3(V ax, V ay, V az, V bx, V by, V bz) {
  return madd(az, bz, madd(ay, by, hn::Mul(ax, bx)));
}

template <class D>
HWY_INLINE std::uint32_t mask_bits(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<std::uint32_t>(bytes[0]) | (static_cast<std::uint32_t>(bytes[1]) << 8U);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
