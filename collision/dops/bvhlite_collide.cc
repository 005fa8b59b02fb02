// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/core/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bvhlite_collide.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include <cstring>

#include "pair_batch-inl.h"
#include "simdop_steps.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Takes eight planes of `bits` bits, which fill `bits` bytes, out of a record: each with the byte that it begins in and
// the next one, shifted to the left end of 16 bits by a product and from there to the right end.
struct Unpacking {
  explicit Unpacking(int width) : bits(static_cast<std::size_t>(width)) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t place = i * bits;
      bytes[2 * i] = static_cast<std::uint8_t>(place / 8);
      bytes[2 * i + 1] = static_cast<std::uint8_t>(place / 8 + 1);
      factors[i] = static_cast<std::uint16_t>(1U << (16 - bits - place % 8));
    }
    inverse = 1.0F / static_cast<float>((1 << width) - 1);
  }

  std::size_t bits;
  alignas(16) std::array<std::uint8_t, 16> bytes = {};
  alignas(16) std::array<std::uint16_t, 8> factors = {};
  float inverse = 0.0F;
};

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void unpack_eight(const Unpacking& unpacking, const std::uint8_t* packed, std::uint16_t* unpacked) {
  for (std::size_t i = 0; i < 8; ++i) {
    const auto window =
        static_cast<std::uint32_t>(packed[unpacking.bytes[2 * i]] | packed[unpacking.bytes[2 * i + 1]] << 8U);
    unpacked[i] = static_cast<std::uint16_t>((window * unpacking.factors[i] & 0xFFFFU) >> (16 - unpacking.bits));
  }
}
#else
HWY_INLINE void unpack_eight(const Unpacking& unpacking, const std::uint8_t* packed, std::uint16_t* unpacked) {
  const hn::Full128<std::uint8_t> bytes;
  const hn::Full128<std::uint16_t> words;
  const auto windows = hn::TableLookupBytes(hn::LoadU(bytes, packed), hn::Load(bytes, unpacking.bytes.data()));
  const auto left = hn::Mul(hn::BitCast(words, windows), hn::Load(words, unpacking.factors.data()));
  hn::Store(hn::ShiftRightSame(left, static_cast<int>(16 - unpacking.bits)), words, unpacked);
}
#endif

/// As BvhLiteTree::planes_below.
HWY_INLINE void unpack_planes(const Unpacking& unpacking, const std::uint8_t* node, std::size_t k,
                              const BvhLiteTree::Planes& parent, BvhLiteTree::Planes& planes) {
  const HWY_CAPPED(float, 8) d;
  const hn::RebindToSigned<decltype(d)> integers;
  const hn::Rebind<std::uint16_t, decltype(d)> words;
  std::array<std::uint16_t, 2> range;
  std::memcpy(range.data(), node + 4, sizeof(range));
  const float low = from_half(range[0]);
  const auto least = hn::Set(d, low);
  const auto step = hn::Set(d, (from_half(range[1]) - low) * unpacking.inverse);
  alignas(16) std::array<std::uint16_t, 8> steps;
  for (std::size_t p = 0; p < k; p += 8) {
    unpack_eight(unpacking, node + 8 + p / 8 * unpacking.bits, steps.data());
    for (std::size_t lane = 0; lane < 8; lane += hn::Lanes(d)) {
      const auto q = hn::ConvertTo(d, hn::PromoteTo(integers, hn::Load(words, &steps[lane])));
      const auto inward = hn::Add(least, hn::Mul(q, step));  // Not fused: as when the tree was made.
      hn::Store(hn::Sub(hn::LoadU(d, &parent[p + lane]), inward), d, &planes[p + lane]);
    }
  }
}

class BvhLiteQuery {
 public:
  BvhLiteQuery(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB, BvhLiteScratch* scratch,
               QueryCounts* counts)
      : a_(a),
        b_(b),
        scratch_(*scratch),
        counts_(counts),
        k_(static_cast<std::size_t>(a.options().k)),
        unpacking_a_(a.options().bits),
        unpacking_b_(b.options().bits),
        steps_(DopDirections::of(a.options().k),
               Realignment(DopDirections::of(a.options().k), a.space(), b.space(), X_AB)),
        batch_(a.mesh(), b.mesh(), X_AB, counts) {}

  bool run() {
    const Side a = {0, a_.reference(0), &a_.root_planes()};
    const Side b = {0, b_.reference(0), &b_.root_planes()};
    return visit(0, a, b) || batch_.flush();
  }

 private:
  // A node of one of the trees.
  struct Side {
    std::uint32_t node;
    std::uint32_t reference;
    const BvhLiteTree::Planes* planes;
    bool is_leaf() const { return (reference & BvhLiteTree::kLeaf) != 0; }
  };
  struct Sides {
    std::array<Side, 16> nodes;
    std::size_t count = 0;
  };

  // The children, or a leaf itself.
  static Sides below(const BvhLiteTree& tree, const Unpacking& unpacking, const Side& side,
                     std::array<BvhLiteTree::Planes, 16>& planes) {
    Sides sides;
    if (side.is_leaf()) {
      sides.nodes[0] = side;
      sides.count = 1;
      return sides;
    }
    const auto k = static_cast<std::size_t>(tree.options().k);
    for (std::uint32_t node = side.reference & BvhLiteTree::kNumber;; ++node) {
      const std::uint32_t reference = tree.reference(node);
      unpack_planes(unpacking, tree.node(node), k, *side.planes, planes[sides.count]);
      sides.nodes[sides.count] = {node, reference, &planes[sides.count]};
      ++sides.count;
      if ((reference & BvhLiteTree::kLastSibling) != 0) return sides;
    }
  }

  bool visit(std::size_t depth, const Side& a, const Side& b) {
    if (a.is_leaf() && b.is_leaf()) return add_leaves(a.reference, b.reference);
    BvhLiteScratch::Level& level = scratch_.level(depth);
    const Sides sides_a = below(a_, unpacking_a_, a, level.a);
    const Sides sides_b = below(b_, unpacking_b_, b, level.b);
    if (counts_ != nullptr) {
      ++counts_->node_pairs;
      counts_->volume_tests += sides_a.count * sides_b.count;
    }
    std::array<std::size_t, 16> done = {};
    for (std::size_t i = 0; i < sides_a.count; ++i) {
      for (std::size_t n = 0; n < sides_b.count; ++n) {
        if (disjoint(*sides_a.nodes[i].planes, *sides_b.nodes[n].planes, level.bounds[n], done[n])) continue;
        if (visit(depth + 1, sides_a.nodes[i], sides_b.nodes[n])) return true;
      }
    }
    return false;
  }

  // b's planes are realigned axis after axis, as far as they are needed.
  HWY_INLINE bool disjoint(const BvhLiteTree::Planes& a, const BvhLiteTree::Planes& b, BvhLiteTree::Planes& bounds,
                           std::size_t& done) const {
    for (std::size_t s = 0; s < k_; s += 2) {
      for (; done < s + 2; ++done) {
        float bound = steps_.constant[done];
        for (std::size_t n = 0; n < 3; ++n)
          bound -= steps_.weights[n][done] * b[static_cast<std::size_t>(steps_.planes[n][done])];
        bounds[done] = bound;
      }
      if (a[s] < bounds[s] || a[s + 1] < bounds[s + 1]) return true;
    }
    return false;
  }

  bool add_leaves(std::uint32_t reference_a, std::uint32_t reference_b) {
    for (std::uint32_t i = reference_a & BvhLiteTree::kNumber;; ++i) {
      const std::uint32_t triangle_a = a_.order()[i];
      for (std::uint32_t n = reference_b & BvhLiteTree::kNumber;; ++n) {
        const std::uint32_t triangle_b = b_.order()[n];
        if (batch_.add(triangle_a & ~BvhLiteTree::kLastTriangle, triangle_b & ~BvhLiteTree::kLastTriangle)) return true;
        if ((triangle_b & BvhLiteTree::kLastTriangle) != 0) break;
      }
      if ((triangle_a & BvhLiteTree::kLastTriangle) != 0) return false;
    }
  }

  const BvhLiteTree& a_;
  const BvhLiteTree& b_;
  BvhLiteScratch& scratch_;
  QueryCounts* counts_;
  std::size_t k_;
  Unpacking unpacking_a_;
  Unpacking unpacking_b_;
  SimdopSteps steps_;
  PairBatch batch_;
};

bool collide_bvhlite(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB, BvhLiteScratch* scratch,
                     QueryCounts* counts) {
  return BvhLiteQuery(a, b, X_AB, scratch, counts).run();
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(collide_bvhlite);

bool collide(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB, BvhLiteScratch& scratch,
             QueryCounts* counts) {
  PRESCENE_CHECK(a.options().k == b.options().k);
  return HWY_DYNAMIC_DISPATCH(collide_bvhlite)(a, b, X_AB, &scratch, counts);
}

}  // namespace prescene::collision
#endif
