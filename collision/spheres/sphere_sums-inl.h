// SPDX-License-Identifier: Apache-2.0
// Sums over pairs of spheres that overlap. The few lanes that overlap are packed together first, so that square roots
// and divisions are done for full vectors; all instruction sets pack in the same order into the same 16 partial sums,
// and nothing is fused, so that they give the same bits. Included once for each instruction set.
#include "sphere_descent-inl.h"

#if defined(PRESCENE_COLLISION_SPHERE_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_SPHERE_SUMS_INL_H_
#undef PRESCENE_COLLISION_SPHERE_SUMS_INL_H_
#else
#define PRESCENE_COLLISION_SPHERE_SUMS_INL_H_
#endif

#include <numbers>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

inline constexpr std::size_t kChunk = 16;      // Pairs that are summed together.
inline constexpr std::size_t kGathered = 256;  // Pairs after which they are summed...
/// ...before those of two bottom nodes, and a vector that is stored beyond the last, are added.
inline constexpr std::size_t kGatherRoom = kGathered + SphereTree::kMostBranching * SphereTree::kMostBranching + 16;

/// Sixteen partial sums in double precision.
struct PartialSums {
  HWY_ALIGN double sums[kChunk] = {};

  HWY_INLINE void add(const float* values) {
    for (std::size_t i = 0; i < kChunk; ++i) sums[i] += static_cast<double>(values[i]);
  }
  double total() const {
    double total = 0.0;
    for (const double sum : sums) total += sum;
    return total;
  }
};

/// Rows of values of pairs, gathered until there are enough to be summed.
template <std::size_t kRows>
class Gathered {
 public:
  explicit Gathered(std::vector<float>* memory) {
    if (memory->size() < kRows * kGatherRoom) memory->resize(kRows * kGatherRoom);
    rows_ = memory->data();
  }
  std::size_t size() const { return size_; }
  const float* row(std::size_t k) const { return rows_ + k * kGatherRoom; }
  HWY_INLINE void put(std::size_t k, V values, M mask) {
    hn::StoreU(hn::Compress(values, mask), Tag(), rows_ + k * kGatherRoom + size_);
  }
  HWY_INLINE void step(M mask) { size_ += hn::CountTrue(Tag(), mask); }
  /// Keeps those from `first` on.
  void keep_from(std::size_t first) {
    for (std::size_t k = 0; k < kRows; ++k) {
      float* row = rows_ + k * kGatherRoom;
      std::copy(row + first, row + size_, row);
    }
    size_ -= first;
  }

 private:
  float* rows_;
  std::size_t size_ = 0;
};

/// The lanes from `lane` on of a chunk that has `left` pairs; zero in the others.
HWY_INLINE V used_lanes(V values, std::size_t left, std::size_t lane) {
  if (left >= kChunk) return values;
  const Tag d;
  return hn::IfThenElse(hn::FirstN(d, left > lane ? left - lane : 0), values, hn::Zero(d));
}

/// Volumes of the intersections.
class VolumeSum {
 public:
  explicit VolumeSum(std::vector<float>* memory) : gathered_(memory) {}

  HWY_INLINE void add(const PairVector& pairs) {
    gathered_.put(0, pairs.squared, pairs.meet);
    gathered_.put(1, pairs.radius_a, pairs.meet);
    gathered_.put(2, pairs.radius_b, pairs.meet);
    gathered_.step(pairs.meet);
  }
  HWY_INLINE void make_room() {
    if (gathered_.size() > kGathered) sum_up(false);
  }
  SphereOverlap finish() {
    sum_up(true);
    return {std::numbers::pi / 12.0 * volume_.total(), pairs_};
  }

 private:
  HWY_NOINLINE void sum_up(bool all) {
    const Tag d;
    const std::size_t size = gathered_.size();
    std::size_t from = 0;
    for (; from < size && (all || from + kChunk <= size); from += kChunk) {
      HWY_ALIGN float lens[kChunk];
      for (std::size_t i = 0; i < kChunk; i += kLanes) {
        const V ra = hn::LoadU(d, gathered_.row(1) + from + i);
        const V rb = hn::LoadU(d, gathered_.row(2) + from + i);
        const V distance = hn::Sqrt(hn::LoadU(d, gathered_.row(0) + from + i));
        const V total = hn::Add(ra, rb);
        const V difference = hn::Sub(ra, rb);
        const V depth = hn::Sub(total, distance);
        const V smaller = hn::Min(ra, rb);
        const V inside = hn::Mul(hn::Set(d, 16.0F), hn::Mul(hn::Mul(smaller, smaller), smaller));
        const V sum = hn::Add(hn::Mul(distance, distance), hn::Mul(hn::Set(d, 2.0F), hn::Mul(distance, total)));
        const V factor = hn::Sub(sum, hn::Mul(hn::Set(d, 3.0F), hn::Mul(difference, difference)));
        const V cut = hn::Div(hn::Mul(hn::Mul(depth, depth), factor), distance);
        const V volume = hn::IfThenElse(hn::Le(distance, hn::Abs(difference)), inside, cut);
        hn::Store(used_lanes(volume, size - from, i), d, lens + i);
      }
      volume_.add(lens);
    }
    const std::size_t done = std::min(from, size);
    pairs_ += done;
    gathered_.keep_from(done);
  }

  Gathered<3> gathered_;
  PartialSums volume_;
  std::uint64_t pairs_ = 0;
};

/// What pushes A.
class ForceSum {
 public:
  ForceSum(const Eigen::Vector3d& p_AP, std::vector<float>* memory) : point_(p_AP.cast<float>()), gathered_(memory) {}

  HWY_INLINE void add(const PairVector& pairs) {
    gathered_.put(0, pairs.dx, pairs.meet);
    gathered_.put(1, pairs.dy, pairs.meet);
    gathered_.put(2, pairs.dz, pairs.meet);
    gathered_.put(3, hn::Add(pairs.radius_a, pairs.radius_b), pairs.meet);
    gathered_.put(4, pairs.x_a, pairs.meet);
    gathered_.put(5, pairs.y_a, pairs.meet);
    gathered_.put(6, pairs.z_a, pairs.meet);
    gathered_.step(pairs.meet);
  }
  HWY_INLINE void make_room() {
    if (gathered_.size() > kGathered) sum_up(false);
  }
  PenaltyWrench finish(double stiffness) {
    sum_up(true);
    PenaltyWrench result;
    for (int i = 0; i < 3; ++i) {
      result.force[i] = stiffness * sums_[i].total();
      result.torque[i] = stiffness * sums_[3 + i].total();
    }
    result.energy = stiffness * sums_[6].total();
    result.pairs = pairs_;
    return result;
  }

 private:
  HWY_NOINLINE void sum_up(bool all) {
    const Tag d;
    const V zero = hn::Zero(d);
    const std::size_t size = gathered_.size();
    std::size_t from = 0;
    for (; from < size && (all || from + kChunk <= size); from += kChunk) {
      HWY_ALIGN float values[7][kChunk];
      for (std::size_t i = 0; i < kChunk; i += kLanes) {
        const auto load = [&](std::size_t k) HWY_ATTR { return hn::LoadU(d, gathered_.row(k) + from + i); };
        const auto cross = [&](V a, V b, V p, V q) HWY_ATTR { return hn::Sub(hn::Mul(a, b), hn::Mul(p, q)); };
        const V dx = load(0);
        const V dy = load(1);
        const V dz = load(2);
        const V distance = hn::Sqrt(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)));
        const V depth = hn::Max(zero, hn::Sub(load(3), distance));
        const V half = used_lanes(hn::Mul(hn::Set(d, 0.5F), depth), size - from, i);
        const V scale = hn::IfThenElseZero(hn::Gt(distance, zero), hn::Neg(hn::Div(half, distance)));
        const V fx = used_lanes(hn::Mul(scale, dx), size - from, i);
        const V fy = used_lanes(hn::Mul(scale, dy), size - from, i);
        const V fz = used_lanes(hn::Mul(scale, dz), size - from, i);
        const V rx = used_lanes(hn::Sub(load(4), hn::Set(d, point_.x())), size - from, i);
        const V ry = used_lanes(hn::Sub(load(5), hn::Set(d, point_.y())), size - from, i);
        const V rz = used_lanes(hn::Sub(load(6), hn::Set(d, point_.z())), size - from, i);
        hn::Store(fx, d, values[0] + i);
        hn::Store(fy, d, values[1] + i);
        hn::Store(fz, d, values[2] + i);
        hn::Store(cross(ry, fz, rz, fy), d, values[3] + i);
        hn::Store(cross(rz, fx, rx, fz), d, values[4] + i);
        hn::Store(cross(rx, fy, ry, fx), d, values[5] + i);
        hn::Store(hn::Mul(half, half), d, values[6] + i);
      }
      for (std::size_t k = 0; k < 7; ++k) sums_[k].add(values[k]);
    }
    const std::size_t done = std::min(from, size);
    pairs_ += done;
    gathered_.keep_from(done);
  }

  Vector3f point_;
  Gathered<7> gathered_;
  PartialSums sums_[7];
  std::uint64_t pairs_ = 0;
};

/// Hands the pairs of spheres of two bottom nodes that overlap to a sum.
template <std::size_t kBranching, class Sum>
HWY_INLINE void gather_pairs(const Children& a, std::size_t count_a, const PlacedChildren<kBranching>& b, Sum* sum) {
  constexpr std::size_t kRows = Rows<kBranching>::kRows;
  constexpr std::size_t kVectors = Rows<kBranching>::kVectors;
  const Tag d;
  sum->make_room();
  constexpr std::size_t kAll = kBranching / kRows * kVectors;
  if constexpr (kAll <= 4 || kAll > 64) {
    for_rows<kBranching>(a, count_a, b, 0.0F, [&](std::size_t, std::size_t, const PairVector& pairs) HWY_ATTR {
      if (!hn::AllFalse(d, pairs.meet)) sum->add(pairs);
    });
    return;
  }
  // Most vectors hold no pair that overlaps, and no processor foresees which: first find out without a jump.
  std::uint64_t vectors = 0;
  std::size_t bit = 0;
  for_rows<kBranching>(a, count_a, b, 0.0F, [&](std::size_t, std::size_t, const PairVector& pairs) HWY_ATTR {
    vectors |= (hn::AllFalse(d, pairs.meet) ? std::uint64_t{0} : std::uint64_t{1}) << bit++;
  });
  for (; vectors != 0; vectors &= vectors - 1) {
    const auto at = static_cast<std::size_t>(std::countr_zero(vectors));
    sum->add(pairs_of_row<kBranching>(a, count_a, at / kVectors * kRows, b, at % kVectors, 0.0F));
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // PRESCENE_COLLISION_SPHERE_SUMS_INL_H_
