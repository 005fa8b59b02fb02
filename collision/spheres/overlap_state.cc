// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "overlap_state.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "uncertain_descent-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Looks for a pair that may touch, then for one that is sure to.
class StateSink {
 public:
  static constexpr bool kDeepestFirst = true;

  explicit StateSink(const Swelling& s) : s_(s) {}

  /// Spheres that are sure to touch do so with all that the error takes from them; those about others have lost at
  /// least what is lost at the pivot.
  Growth growth(bool of_spheres) const {
    if (!possible_) return growth_by(s_, s_.region_radius);
    const Growth most = growth_by(s_, s_.ball_radius);
    return {-most.constant, of_spheres ? -most.slope : 0.0F};
  }
  bool ended() const { return certain_; }
  std::size_t enough() const { return 1; }

  void flush(PairBuffer* buffer) {
    const Lanes d;
    for (std::size_t i = 0; i < buffer->size && !certain_; i += hn::Lanes(d)) {
      const PairGeometry g = geometry_of(*buffer, s_, i);
      const PairMargins margins = margins_of(g, s_);
      const auto there = hn::FirstN(d, buffer->size - i);
      certain_ = !hn::AllFalse(d, hn::And(there, hn::Ge(margins.sure, hn::Zero(d))));
      const auto meets = hn::Lt(margins.deviations, hn::Set(d, s_.region_radius));
      possible_ = possible_ || certain_ || !hn::AllFalse(d, hn::And(there, meets));
    }
    buffer->size = 0;
  }

  OverlapState state() const {
    if (certain_) return OverlapState::kCertain;
    return possible_ ? OverlapState::kPossible : OverlapState::kNone;
  }

 private:
  const Swelling& s_;
  bool possible_ = false;
  bool certain_ = false;
};

OverlapState find_state_lanes(const SphereTree& a, const SphereTree& b, const Swelling& s, DescentStack* stack) {
  StateSink sink(s);
  descend(a, b, s, stack, sink);
  return sink.state();
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(find_state_lanes);

OverlapState find_state(const SphereTree& a, const SphereTree& b, const Swelling& swelling, DescentStack* stack) {
  return HWY_DYNAMIC_DISPATCH(find_state_lanes)(a, b, swelling, stack);
}

}  // namespace prescene::collision
#endif
