// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "error_lines.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "uncertain_descent-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Joins the intervals [low, high] of `count` pairs (a whole number of vectors; empty ones are at infinity).
HWY_INLINE std::size_t join(const float* low, const float* high, std::size_t count, float* joined_low,
                            float* joined_high) {
  const Lanes d;
  const V far = hn::Set(d, 1e30F);
  float from = -2e30F;
  for (std::size_t found = 0;; ++found) {
    // The next interval that begins beyond what is joined so far.
    V next = far;
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      const V l = hn::Load(d, low + i);
      next = hn::Min(next, hn::IfThenElse(hn::Gt(l, hn::Set(d, from)), l, far));
    }
    const float begin = hn::GetLane(hn::MinOfLanes(d, next));
    if (begin >= 1e30F) return found;
    float end = begin;
    for (bool grown = true; grown;) {
      V most = hn::Set(d, end);
      for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        const V l = hn::Load(d, low + i);
        most = hn::Max(most, hn::IfThenElse(hn::Le(l, hn::Set(d, end)), hn::Load(d, high + i), most));
      }
      const float longest = hn::GetLane(hn::MaxOfLanes(d, most));
      grown = longest > end;
      end = longest;
    }
    if (found + 1 == TouchingIntervals::kMost) {  // Rare: the rest as one.
      V most = hn::Set(d, end);
      for (std::size_t i = 0; i < count; i += hn::Lanes(d)) most = hn::Max(most, hn::Load(d, high + i));
      joined_low[found] = begin;
      joined_high[found] = hn::GetLane(hn::MaxOfLanes(d, most));
      return found + 1;
    }
    joined_low[found] = begin;
    joined_high[found] = end;
    from = end;
  }
}

void intersect_lanes(const CriticalPairs& critical, const Swelling& s, const ErrorLines& lines,
                     TouchingIntervals* intervals) {
  const Lanes d;
  const std::size_t size = critical.pairs.size;
  const std::size_t whole = (size + hn::Lanes(d) - 1) / hn::Lanes(d) * hn::Lanes(d);
  HWY_ALIGN float low[ErrorLines::kCount][CriticalPairs::kMost + kPairLanes];
  HWY_ALIGN float high[ErrorLines::kCount][CriticalPairs::kMost + kPairLanes];
  HWY_ALIGN float position[kPairLanes];
  for (std::size_t i = 0; i < kPairLanes; ++i) position[i] = static_cast<float>(i);
  const V far = hn::Set(d, 1e30F);
  for (std::size_t i = 0; i < whole; i += hn::Lanes(d)) {
    const PairGeometry g = geometry_of(critical.pairs, s, i);
    const auto used = hn::Lt(hn::Load(d, position), hn::Set(d, static_cast<float>(size - i)));
    // Columns of the displacement at p: phi x p + tau with (phi, tau) = factor * z.
    V move[3][6];
    for (std::size_t j = 0; j < 6; ++j) {
      V error[6];
      for (std::size_t k = 0; k < 6; ++k) error[k] = k >= j ? hn::Set(d, s.factor[k * (k + 1) / 2 + j]) : hn::Zero(d);
      move[0][j] = hn::Add(error[3], hn::Sub(hn::Mul(error[1], g.pz), hn::Mul(error[2], g.py)));
      move[1][j] = hn::Add(error[4], hn::Sub(hn::Mul(error[2], g.px), hn::Mul(error[0], g.pz)));
      move[2][j] = hn::Add(error[5], hn::Sub(hn::Mul(error[0], g.py), hn::Mul(error[1], g.px)));
    }
    const auto moved = [&](std::size_t axis, const std::array<float, 6>& z) HWY_ATTR {
      V sum = hn::Zero(d);
      for (std::size_t j = 0; j < 6; ++j) sum = madd(move[axis][j], hn::Set(d, z[j]), sum);
      return sum;
    };
    const V vx = moved(0, lines.direction);
    const V vy = moved(1, lines.direction);
    const V vz = moved(2, lines.direction);
    const V speed = hn::Max(dot3(vx, vy, vz, vx, vy, vz), hn::Set(d, 1e-30F));
    const V inverse = hn::Div(hn::Set(d, 1.0F), speed);
    for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
      const V x = hn::Add(hn::Sub(g.px, g.ax), moved(0, lines.start[line]));
      const V y = hn::Add(hn::Sub(g.py, g.ay), moved(1, lines.start[line]));
      const V z = hn::Add(hn::Sub(g.pz, g.az), moved(2, lines.start[line]));
      const V along = dot3(x, y, z, vx, vy, vz);
      const V length = hn::Sqrt(dot3(x, y, z, x, y, z));
      const V outside = hn::Mul(hn::Sub(length, g.radii), hn::Add(length, g.radii));
      const V discriminant = hn::Sub(hn::Mul(along, along), hn::Mul(speed, outside));
      const auto meets = hn::And(used, hn::Ge(discriminant, hn::Zero(d)));
      const V root = hn::Sqrt(hn::Max(discriminant, hn::Zero(d)));
      const V begin = hn::Mul(hn::Sub(hn::Neg(along), root), inverse);
      const V end = hn::Mul(hn::Sub(root, along), inverse);
      hn::Store(hn::IfThenElse(meets, hn::Max(begin, hn::Set(d, -1e30F)), far), d, low[line] + i);
      hn::Store(hn::IfThenElse(meets, hn::Min(end, far), hn::Neg(far)), d, high[line] + i);
    }
  }
  for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
    intervals->count[line] =
        join(low[line], high[line], whole, intervals->low[line].data(), intervals->high[line].data());
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(intersect_lanes);

void intersect_lines(const CriticalPairs& critical, const Swelling& swelling, const ErrorLines& lines,
                     TouchingIntervals* intervals) {
  HWY_DYNAMIC_DISPATCH(intersect_lanes)(critical, swelling, lines, intervals);
}

}  // namespace prescene::collision
#endif
