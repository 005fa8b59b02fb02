// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "critical_pairs.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "uncertain_descent-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Keeps the pairs with the least margins.
class CriticalSink {
 public:
  static constexpr bool kDeepestFirst = true;

  CriticalSink(const Swelling& s, CriticalPairs* critical) : s_(s), critical_(critical), limit_(s.region_radius) {}

  Growth growth(bool) const { return growth_by(s_, std::max(0.0F, limit_)); }
  bool ended() const { return ended_; }
  std::size_t enough() const { return 32; }

  void flush(PairBuffer* buffer) {
    const Lanes d;
    for (std::size_t i = 0; i < buffer->size && !ended_; i += hn::Lanes(d)) {
      const PairMargins margin = margins_of(geometry_of(*buffer, s_, i), s_);
      HWY_ALIGN float margins[kPairLanes];
      HWY_ALIGN float sures[kPairLanes];
      hn::Store(margin.deviations, d, margins);
      hn::Store(margin.sure, d, sures);
      const std::size_t count = std::min(hn::Lanes(d), buffer->size - i);
      for (std::size_t k = 0; k < count && !ended_; ++k) {
        if (margins[k] >= limit_ && sures[k] < 0.0F) continue;
        keep(*buffer, i + k, std::clamp(margins[k], -1e6F, 1e6F), sures[k] >= 0.0F);
      }
    }
    buffer->size = 0;
  }

  void finish() {
    critical_->complete = !ended_ && !full_;
    critical_->left_out = ended_ ? -std::numeric_limits<float>::infinity() : limit_;
  }

 private:
  void keep(const PairBuffer& buffer, std::size_t i, float margin, bool certain) {
    SpherePairs<CriticalPairs::kMost>& kept = critical_->pairs;
    std::size_t place = kept.size;
    if (kept.size == CriticalPairs::kMost) {
      place = worst_;
    } else {
      ++kept.size;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      kept.a[axis][place] = buffer.a[axis][i];
      kept.b[axis][place] = buffer.b[axis][i];
    }
    kept.radii[place] = buffer.radii[i];
    critical_->margin[place] = margin;
    if (certain) {
      critical_->certain = true;
      critical_->certain_pair = place;
      ended_ = true;
    }
    if (kept.size < CriticalPairs::kMost) return;
    const float* margins = critical_->margin.data();
    worst_ = static_cast<std::size_t>(std::max_element(margins, margins + CriticalPairs::kMost) - margins);
    full_ = true;
    limit_ = std::min(limit_, margins[worst_]);
    // All touch at the mean: finding more of them would take as long as finding all.
    if (limit_ <= 0.0F) ended_ = true;
  }

  const Swelling& s_;
  CriticalPairs* critical_;
  float limit_;
  std::size_t worst_ = 0;
  bool full_ = false;
  bool ended_ = false;
};

void find_critical_lanes(const SphereTree& a, const SphereTree& b, const Swelling& s, DescentStack* stack,
                         CriticalPairs* critical) {
  CriticalSink sink(s, critical);
  descend(a, b, s, stack, sink);
  sink.finish();
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(find_critical_lanes);

void find_critical_pairs(const SphereTree& a, const SphereTree& b, const Swelling& swelling, DescentStack* stack,
                         CriticalPairs* critical) {
  HWY_DYNAMIC_DISPATCH(find_critical_lanes)(a, b, swelling, stack, critical);
}

}  // namespace prescene::collision
#endif
