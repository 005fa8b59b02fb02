// SPDX-License-Identifier: Apache-2.0
// Triangles of two leaves for a distance query: pairs that may be near enough are collected until there are sixteen,
// and measured together. Included once for each instruction set.
#include "distance_descent-inl.h"
#include "leaf_pairs-inl.h"
#include "prescene/collision/triangle_distance-inl.h"

#if defined(PRESCENE_COLLISION_DISTANCE_LEAVES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_DISTANCE_LEAVES_INL_H_
#undef PRESCENE_COLLISION_DISTANCE_LEAVES_INL_H_
#else
#define PRESCENE_COLLISION_DISTANCE_LEAVES_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Where the four triangles of a block are along an axis.
struct BlockSpans {
  HWY_ALIGN float low[4];
  HWY_ALIGN float high[4];
};

HWY_INLINE void span_block(const TriangleBlock& block, const float (&axis)[3], float from, BlockSpans* spans) {
  const OneBlock d;
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    const auto x = hn::Set(d, axis[0]);
    const auto y = hn::Set(d, axis[1]);
    const auto z = hn::Set(d, axis[2]);
    const auto corner = [&](std::size_t c) HWY_ATTR {
      const auto in_x = hn::MulAdd(hn::Load(d, block.corners[c][0] + lane), x, hn::Set(d, from));
      const auto in_xy = hn::MulAdd(hn::Load(d, block.corners[c][1] + lane), y, in_x);
      return hn::MulAdd(hn::Load(d, block.corners[c][2] + lane), z, in_xy);
    };
    const auto h0 = corner(0);
    const auto h1 = corner(1);
    const auto h2 = corner(2);
    hn::Store(hn::Min(hn::Min(h0, h1), h2), d, spans->low + lane);
    hn::Store(hn::Max(hn::Max(h0, h1), h2), d, spans->high + lane);
  }
}

HWY_INLINE float least_of_four(const float* four) {
  const OneBlock d;
  auto least = hn::Load(d, four);
  for (std::size_t lane = hn::Lanes(d); lane < 4; lane += hn::Lanes(d))
    least = hn::Min(least, hn::Load(d, four + lane));
  return hn::GetLane(hn::MinOfLanes(d, least));
}

HWY_INLINE float largest_of_four(const float* four) {
  const OneBlock d;
  auto largest = hn::Load(d, four);
  for (std::size_t lane = hn::Lanes(d); lane < 4; lane += hn::Lanes(d))
    largest = hn::Max(largest, hn::Load(d, four + lane));
  return hn::GetLane(hn::MaxOfLanes(d, largest));
}

/// Those of four that `lanes`, from 0 to 3, say.
HWY_INLINE hn::Vec<PairTag> pick_of_four(PairTag d, const float* four, hn::Vec<hn::RebindToSigned<PairTag>> lanes) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, four[hn::GetLane(lanes)]);
#else
  return hn::TableLookupLanes(hn::LoadDup128(d, four), hn::IndicesFromVec(d, lanes));
#endif
}

/// Which of the pairs 4 i + k of triangle i of a and triangle k of b, which is in B's frame, may be within `limit`
/// (squared, in units): by the boxes about them in frame C.
HWY_INLINE std::uint32_t near_triangles(const DistanceFrame& frame, const TriangleBlock& a, const TriangleBlock& b,
                                        float limit) {
  // What rounding may have done to a coordinate of B, and to its projection.
  const float slack = 2.0F * frame.query.slack;
  BlockSpans spans_a[3];
  BlockSpans spans_b[3];
  const PairTag d;
  std::uint32_t bits = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    span_block(a, frame.axes_of_a[axis], 0.0F, &spans_a[axis]);
    span_block(b, frame.axes_of_b[axis], frame.origin_of_b[axis], &spans_b[axis]);
    if (axis != 0) continue;
    // Most leaves are told apart by the first.
    const float apart = least_of_four(spans_b[0].low) - largest_of_four(spans_a[0].high) - slack;
    const float in_units = apart * frame.scale;
    if (apart > 0.0F && in_units * in_units > limit) return 0;
  }
  const hn::RebindToSigned<PairTag> di;
  for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
    const auto pair = hn::Iota(di, static_cast<std::int32_t>(first));
    const auto lanes_a = hn::ShiftRight<2>(pair);
    const auto lanes_b = hn::And(pair, hn::Set(di, 3));
    auto square = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto low_a = pick_of_four(d, spans_a[axis].low, lanes_a);
      const auto high_a = pick_of_four(d, spans_a[axis].high, lanes_a);
      const auto low_b = pick_of_four(d, spans_b[axis].low, lanes_b);
      const auto high_b = pick_of_four(d, spans_b[axis].high, lanes_b);
      const auto apart = hn::Sub(hn::Max(hn::Sub(low_b, high_a), hn::Sub(low_a, high_b)), hn::Set(d, slack));
      const auto in_units = hn::Mul(hn::Max(apart, hn::Zero(d)), hn::Set(d, frame.scale));
      square = hn::MulAdd(in_units, in_units, square);
    }
    bits |= bits_of_mask(d, hn::Le(square, hn::Set(d, limit))) << first;
  }
  return bits;
}

/// A pair of triangles: 4 i + k of two blocks.
struct BlockPair {
  std::uint32_t block_a = 0;
  std::uint32_t block_b = 0;
  std::uint32_t pair = 0;
};

/// Pairs of triangles that wait for being measured.
class MeasureBatch {
 public:
  static constexpr std::uint32_t kFull = 16;

  std::uint32_t count() const { return count_; }
  /// Of the first kFull.
  BlockPair pair(std::uint32_t i) const {
    return {static_cast<std::uint32_t>(blocks_a_[i]), static_cast<std::uint32_t>(blocks_b_[i]),
            static_cast<std::uint32_t>(pairs_[i])};
  }

  /// `pairs`: bits of pairs 4 i + k of the two blocks. Only while count() is less than kFull.
  HWY_INLINE void add(std::uint32_t block_a, std::uint32_t block_b, std::uint32_t pairs, const TriangleBlock& a,
                      const TriangleBlock& b) {
    const PairTag d;
    const hn::RebindToSigned<PairTag> di;
    for (std::size_t first = 0; first < 16; first += hn::Lanes(d)) {
      const auto wanted = mask_of_bits(d, pairs >> first);
      if (hn::AllFalse(d, wanted)) continue;
      // Those that are wanted come first; what comes after them is overwritten by the next.
      const auto pair = hn::Compress(hn::Iota(di, static_cast<std::int32_t>(first)), hn::RebindMask(di, wanted));
      const auto lanes_a = hn::ShiftRight<2>(pair);
      const auto lanes_b = hn::And(pair, hn::Set(di, 3));
      for (std::size_t row = 0; row < 9; ++row) {
        hn::StoreU(pick_of_four(d, a.corners[row / 3][row % 3], lanes_a), d, a_[row] + count_);
        hn::StoreU(pick_of_four(d, b.corners[row / 3][row % 3], lanes_b), d, b_[row] + count_);
      }
      hn::StoreU(hn::Set(di, static_cast<std::int32_t>(block_a)), di, blocks_a_ + count_);
      hn::StoreU(hn::Set(di, static_cast<std::int32_t>(block_b)), di, blocks_b_ + count_);
      hn::StoreU(pair, di, pairs_ + count_);
      count_ += static_cast<std::uint32_t>(hn::CountTrue(d, wanted));
    }
  }

  /// Measures the first kFull, or all if there are fewer; as distance_of_16.
  HWY_INLINE PairVerdict measure(float limit, float* distances, float (*between)[16]) const {
    const std::uint32_t active = count_ < kFull ? (1U << count_) - 1U : 0xFFFFU;
    const auto load_a = [this](PairTag d, std::size_t first) HWY_ATTR { return load_corners(d, a_[0], kRoom, first); };
    const auto load_b = [this](PairTag d, std::size_t first) HWY_ATTR { return load_corners(d, b_[0], kRoom, first); };
    return distance_of_16<true>(load_a, load_b, limit, distances, active, between);
  }

  /// Forgets those.
  void drop() {
    if (count_ <= kFull) {
      count_ = 0;
      return;
    }
    for (std::size_t row = 0; row < 9; ++row) {
      std::memcpy(a_[row], a_[row] + kFull, kFull * sizeof(float));
      std::memcpy(b_[row], b_[row] + kFull, kFull * sizeof(float));
    }
    for (std::int32_t* ids : {blocks_a_, blocks_b_, pairs_})
      std::memcpy(ids, ids + kFull, kFull * sizeof(std::int32_t));
    count_ -= kFull;
  }

 private:
  static constexpr std::size_t kRoom = 32;

  std::uint32_t count_ = 0;
  HWY_ALIGN float a_[9][kRoom];
  HWY_ALIGN float b_[9][kRoom];
  std::int32_t blocks_a_[kRoom];
  std::int32_t blocks_b_[kRoom];
  std::int32_t pairs_[kRoom];
};

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
