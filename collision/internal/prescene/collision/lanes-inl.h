// SPDX-License-Identifier: Apache-2.0
// Masks of vectors as bits of integers. Included once for each instruction set.
#if defined(PRESCENE_COLLISION_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_LANES_INL_H_
#undef PRESCENE_COLLISION_LANES_INL_H_
#else
#define PRESCENE_COLLISION_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Bit i: lane i, of at most 16.
template <class D>
HWY_INLINE std::uint32_t bits_of_mask(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8];
  hn::StoreMaskBits(d, mask, bytes);
  if constexpr (hn::MaxLanes(d) <= 8) {
    return bytes[0];
  } else {
    std::uint16_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
  }
}

/// The mask of as many bits as there are lanes; those above do not matter.
template <class D>
HWY_INLINE hn::Mask<D> mask_of_bits(D d, std::uint64_t bits) {
  std::uint8_t bytes[8];
  std::memcpy(bytes, &bits, sizeof bits);
  return hn::LoadMaskBits(d, bytes);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
