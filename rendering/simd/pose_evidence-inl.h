// SPDX-License-Identifier: Apache-2.0
// What the pixels of a drawn hypothesis say, in lanes. The operations on a pixel are those of the reference backend's
// EvidenceSum, one by one; products of ratios are kept as mantissas and exponents.
#if defined(PRESCENE_RENDERING_POSE_EVIDENCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_RENDERING_POSE_EVIDENCE_INL_H_
#undef PRESCENE_RENDERING_POSE_EVIDENCE_INL_H_
#else
#define PRESCENE_RENDERING_POSE_EVIDENCE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "pose_kernels.h"
#include "pose_raster-inl.h"
#include "prescene/rendering/portable_math.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::rendering::HWY_NAMESPACE {

using M = hn::Mask<DF>;

/// Pixels side by side that the object covers before the end of the range and that no known surface hides.
struct Pixels {
  M in_view, covered;
  F ray_x, ray_y;  ///< The ray has z = 1.
  F depth, inverse_depth, measured, slope, cosine;
  I face;
  std::size_t at;      ///< Of the first, in the frame's images.
  const float* drawn;  ///< Its 1/z in the tile.
};

/// Calls visit(row, place in the block, pixels) for each vector of pixels that are not all empty; those not covered
/// are lanes without meaning. Blocks begin where they do on every instruction set. Returns the number of pixels in
/// view.
template <class Visit>
HWY_INLINE int for_each_block(const FrameTerms& frame, const PoseProjection& seen, const PoseTile& tile,
                              const Visit& visit) {
  const DF d;
  const DI di;
  const F zero = hn::Zero(d);
  const F max_depth = set(static_cast<float>(frame.model.options().max_depth));
  const F ramp = hn::Iota(d, 0.0f);
  const PixelRect& rect = tile.rect;
  const float *known_depths = frame.known.data(), *measured = frame.depth.data(),
              *inverse_rays = frame.inverse_ray.data();
  const float* distances = tile.distance.data();
  std::size_t in_view = 0;
  for (int y = rect.y_first; y <= rect.y_last; ++y) {
    const float* depths = tile.inverse_depth(y);
    const std::int32_t* faces = tile.face(y);
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(seen.width);
    const F ray_y = set((static_cast<float>(y) - seen.cy) * seen.inverse_fy);
    for (int block = rect.x_first; block <= rect.x_last; block += kBlock) {
      // The last block of a row ends within the image; what the one before had is left out.
      const int start = std::min(block, seen.width - kBlock);
      for (int x = start; x < start + kBlock; x += static_cast<int>(hn::Lanes(d))) {
        const F inverse_depth = hn::LoadU(d, depths + x);
        const F column = hn::Add(set(static_cast<float>(x)), ramp);
        const M here = hn::And(hn::Ge(column, set(static_cast<float>(block))),
                               hn::Le(column, set(static_cast<float>(rect.x_last))));
        Pixels p;
        p.in_view = hn::And(here, hn::Gt(inverse_depth, zero));
        if (hn::AllFalse(d, p.in_view)) continue;
        p.depth = hn::Div(set(1.0f), inverse_depth);  // No number where empty.
        p.in_view = hn::And(p.in_view, hn::Lt(p.depth, max_depth));
        in_view += hn::CountTrue(d, p.in_view);
        p.at = row + static_cast<std::size_t>(x);
        p.drawn = depths + x;
        const F known = hn::LoadU(d, known_depths + p.at);
        p.covered = hn::AndNot(hn::And(hn::Gt(known, zero), hn::Lt(known, p.depth)), p.in_view);
        if (hn::AllFalse(d, p.covered)) continue;
        p.ray_x = hn::Mul(hn::Sub(column, set(seen.cx)), set(seen.inverse_fx));
        p.ray_y = ray_y;
        p.face = hn::IfThenElseZero(hn::RebindMask(di, p.covered), hn::LoadU(di, faces + x));
        p.slope = hn::Mul(hn::GatherIndex(d, distances, p.face), inverse_depth);
        p.inverse_depth = inverse_depth;
        p.cosine = hn::Max(hn::Mul(hn::Neg(p.slope), hn::LoadU(d, inverse_rays + p.at)), set(1e-6f));
        p.measured = hn::LoadU(d, measured + p.at);
        visit(y, static_cast<std::size_t>(x - start), p);
      }
    }
  }
  return static_cast<int>(in_view);
}

/// As portable_exp2().
HWY_INLINE F exp2_lanes(F x) {
  const DF d;
  const DI di;
  const F whole = set(12582912.0f);
  const F shifted = hn::Add(x, whole);
  const F r = hn::Sub(x, hn::Sub(shifted, whole));
  const F r2 = hn::Mul(r, r);
  const auto pair = [&](float low, float high) HWY_ATTR { return hn::Add(set(low), hn::Mul(r, set(high))); };
  const F upper = hn::Add(pair(0.24022242f, 0.055507337f), hn::Mul(r2, pair(0.0096715127f, 0.0013264727f)));
  const F p = hn::Add(pair(1.0f, 0.69314698f), hn::Mul(r2, upper));
  return hn::Mul(p, hn::BitCast(d, hn::Add(hn::ShiftLeft<23>(hn::BitCast(di, shifted)), set(0x3f800000))));
}

/// Products of positive, normal numbers, one a lane of a block.
class Products {
 public:
  Products() {
    for (float& mantissa : mantissa_) mantissa = 1.0f;
  }

  /// `x` is where the vector begins in its block.
  HWY_INLINE void multiply(std::size_t x, M mask, F factor) {
    const DF d;
    const DI di;
    const I bits = hn::BitCast(di, hn::IfThenElse(mask, factor, set(1.0f)));
    const I exponent = hn::Sub(hn::ShiftRight<23>(bits), set(127));
    const F mantissa = hn::BitCast(d, hn::Or(hn::And(bits, set(0x007fffff)), set(0x3f800000)));
    hn::Store(hn::Mul(hn::Load(d, mantissa_ + x), mantissa), d, mantissa_ + x);
    hn::Store(hn::Add(hn::Load(di, exponent_ + x), exponent), di, exponent_ + x);
  }
  /// After at most 100 factors a lane.
  void normalise() {
    const DF d;
    for (std::size_t x = 0; x < kBlock; x += hn::Lanes(d)) {
      const F product = hn::Load(d, mantissa_ + x);
      hn::Store(set(1.0f), d, mantissa_ + x);
      multiply(x, hn::Gt(product, hn::Zero(d)), product);
    }
  }
  double log() {
    normalise();
    double product = 1.0;
    std::int64_t exponent = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
      product *= static_cast<double>(mantissa_[i]);
      exponent += exponent_[i];
    }
    return portable_log(product) + static_cast<double>(exponent) * 0.6931471805599453;
  }

 private:
  HWY_ALIGN float mantissa_[kBlock];
  HWY_ALIGN std::int32_t exponent_[kBlock] = {};
};

/// A field of the classes, looked up in lanes.
class ClassValues {
 public:
  template <class Value>
  ClassValues(const PixelClasses& classes, Value value) {
    for (std::size_t i = 0; i < kRoom; ++i)
      values_[i] = value(classes.of_incidence(i % PixelClasses::kIncidences, i / PixelClasses::kIncidences % 2 != 0));
  }
  /// `numbers`: of incidence, and kIncidences more at the outline.
  HWY_INLINE F at(I numbers) const {
    const DF d;
    if constexpr (hn::MaxLanes(d) >= kClasses) {
      return hn::TableLookupLanes(hn::Load(d, values_), hn::IndicesFromVec(d, numbers));
    } else {
      return hn::GatherIndex(d, values_, numbers);
    }
  }

 private:
  static constexpr std::size_t kClasses = 2 * PixelClasses::kIncidences;
  static constexpr std::size_t kRoom = kBlock > kClasses ? kBlock : kClasses;

  HWY_ALIGN float values_[kRoom];
};

class EvidenceLanes {
 public:
  EvidenceLanes(const EvidenceTerms& terms, const PoseTile& tile)
      : absent_missing_(terms.frame->absent_missing.data()),
        inverse_absent_(terms.frame->inverse_absent.data()),
        inverse_returns_(terms.frame->inverse_returns.data()),
        colors_(terms.color_ratio == nullptr ? nullptr : terms.color_ratio->data()),
        stride_(static_cast<std::ptrdiff_t>(tile.stride())),
        bounds_(terms.classes->bounds()),
        constant_(terms.classes->of_incidence(0, false)),
        missing_(*terms.classes, [](const PixelClass& c) { return c.missing; }),
        returned_(*terms.classes, [](const PixelClass& c) { return c.returned; }),
        returned_ratio_(*terms.classes, [](const PixelClass& c) { return c.returned_ratio; }),
        missing_ratio_(*terms.classes, [](const PixelClass& c) { return c.missing_ratio; }),
        precision_(terms.frame->model.options()),
        min_depth_(static_cast<float>(terms.frame->model.options().min_depth)) {}

  /// `place` is where the vector begins in its block.
  HWY_INLINE void add(std::size_t place, const Pixels& p) {
    const DF d;
    const F zero = hn::Zero(d);
    const F absent_missing = hn::LoadU(d, absent_missing_ + p.at);
    const M not_known = hn::Lt(absent_missing, zero);
    const I number = class_of(p);
    covered_ += hn::CountTrue(d, p.covered);

    const M returns = hn::AndNot(hn::Eq(p.measured, zero), p.covered);
    const M missing = hn::AndNot(returns, p.covered);
    if (!hn::AllFalse(d, missing)) {
      const F known = hn::IfThenElse(not_known, set(1.0f), absent_missing);
      const F ratio = hn::Div(missing_.at(number), known);
      missing_log_.multiply(place, missing, hn::IfThenElse(not_known, missing_ratio_.at(number), ratio));
    }
    if (!hn::AllFalse(d, returns)) add_returns(place, p, returns, not_known, number);
    if (++factors_ == 64) {
      factors_ = 0;
      for (Products* products : {&visible_log_, &occluded_log_, &missing_log_}) products->normalise();
    }
  }

  void finish(int in_view, PoseEvidence* evidence) {
    evidence->in_view = in_view;
    evidence->covered = static_cast<int>(covered_);
    evidence->measured = static_cast<int>(measured_);
    evidence->visible = static_cast<int>(visible_);
    evidence->hits = static_cast<int>(hits_);
    evidence->visible_log_ratio = visible_log_.log();
    evidence->log_ratio = evidence->visible_log_ratio + occluded_log_.log() + missing_log_.log();
  }

 private:
  /// The numbers of ClassValues.
  HWY_INLINE I class_of(const Pixels& p) const {
    const DF d;
    const DI di;
    const auto beyond = [&](std::size_t i) HWY_ATTR {
      return hn::VecFromMask(di, hn::RebindMask(di, hn::Gt(p.cosine, set(bounds_[i]))));
    };
    static_assert(PixelClasses::kIncidences == 4);
    const I minus_incidence = hn::Add(hn::Add(beyond(0), beyond(1)), beyond(2));
    const F beside = hn::Min(hn::LoadU(d, p.drawn - 1), hn::LoadU(d, p.drawn + 1));
    const F across = hn::Min(hn::LoadU(d, p.drawn - stride_), hn::LoadU(d, p.drawn + stride_));
    const M outline = hn::Eq(hn::Min(beside, across), hn::Zero(d));
    return hn::Sub(hn::IfThenElseZero(hn::RebindMask(di, outline), set(4)), minus_incidence);
  }

  HWY_INLINE void add_returns(std::size_t place, const Pixels& p, M returns, M not_known, I number) {
    const DF d;
    const F zero = hn::Zero(d);
    const F tilt = hn::Min(hn::Max(hn::Mul(p.cosine, set(precision_.per_cosine)), set(precision_.least)), set(1.0f));
    const F precision = hn::Mul(hn::Mul(hn::Mul(set(precision_.scale), p.inverse_depth), p.inverse_depth), tilt);
    const F deviation = hn::Mul(hn::Sub(p.measured, p.depth), precision);
    F density = set(constant_.outlier_density);
    const M hits = hn::And(returns, hn::Lt(hn::Abs(deviation), set(kHitSigmas)));
    if (!hn::AllFalse(d, hits)) {
      // Of other lanes the power has no meaning.
      F hit = hn::Mul(hn::Mul(set(constant_.hit), precision),
                      exp2_lanes(hn::Mul(hn::Mul(set(kNormalExponent), deviation), deviation)));
      if (colors_ != nullptr) hit = hn::Mul(hit, hn::LoadU(d, colors_ + p.at));
      density = hn::Add(density, hn::IfThenElseZero(hits, hit));
    }
    const F occluder = hn::Div(set(constant_.occluder), hn::Sub(p.depth, set(min_depth_)));
    density = hn::Add(density, hn::IfThenElseZero(hn::Lt(deviation, zero), occluder));
    const F share = hn::Mul(returned_.at(number), hn::LoadU(d, inverse_returns_ + p.at));
    const F returned = hn::IfThenElse(not_known, returned_ratio_.at(number), share);
    const F against_absent = hn::Mul(density, hn::LoadU(d, inverse_absent_ + p.at));
    const F ratio = hn::Max(hn::Mul(returned, hn::Add(against_absent, set(constant_.behind))), set(kMinRatio));
    const M occluded = hn::And(returns, hn::Lt(deviation, set(-kMatchSigmas)));
    const M visible = hn::AndNot(occluded, returns);
    measured_ += hn::CountTrue(d, returns);
    visible_ += hn::CountTrue(d, visible);
    hits_ += hn::CountTrue(d, hn::And(visible, hn::Le(deviation, set(kMatchSigmas))));
    visible_log_.multiply(place, visible, ratio);
    if (!hn::AllFalse(d, occluded)) occluded_log_.multiply(place, occluded, ratio);
  }

  const float *absent_missing_, *inverse_absent_, *inverse_returns_;
  const float* colors_;  // Null: no colour.
  std::ptrdiff_t stride_;
  std::array<float, PixelClasses::kIncidences - 1> bounds_;
  PixelClass constant_;
  ClassValues missing_, returned_, returned_ratio_, missing_ratio_;
  HitPrecision precision_;
  float min_depth_;
  Products visible_log_, occluded_log_, missing_log_;
  int factors_ = 0;
  std::size_t covered_ = 0, measured_ = 0, visible_ = 0, hits_ = 0;
};

void evidence_kernel(const EvidenceTerms& terms, const PoseProjection& seen, const PoseTile& tile,
                     PoseEvidence* evidence) {
  EvidenceLanes lanes(terms, tile);
  const int in_view = for_each_block(*terms.frame, seen, tile,
                                     [&](int, std::size_t place, const Pixels& p) HWY_ATTR { lanes.add(place, p); });
  lanes.finish(in_view, evidence);
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
