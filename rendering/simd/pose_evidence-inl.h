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
};

/// Calls visit(x, y, place in the block, pixels) for each vector of pixels that are not all empty; those not covered
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
  std::size_t in_view = 0;
  for (int y = rect.y_first; y <= rect.y_last; ++y) {
    const float* depths = tile.inverse_depth(y);
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
        p.depth = hn::Div(set(1.0f), hn::IfThenElse(p.in_view, inverse_depth, set(1.0f)));
        p.in_view = hn::And(p.in_view, hn::Lt(p.depth, max_depth));
        in_view += hn::CountTrue(d, p.in_view);
        const F known = hn::LoadU(d, &frame.known(x, y));
        p.covered = hn::AndNot(hn::And(hn::Gt(known, zero), hn::Lt(known, p.depth)), p.in_view);
        if (hn::AllFalse(d, p.covered)) continue;
        p.ray_x = hn::Mul(hn::Sub(column, set(seen.cx)), set(seen.inverse_fx));
        p.ray_y = ray_y;
        p.face = hn::IfThenElseZero(hn::RebindMask(di, p.covered), hn::LoadU(di, tile.face(y) + x));
        p.slope = hn::Mul(hn::GatherIndex(d, tile.distance.data(), p.face), inverse_depth);
        p.inverse_depth = inverse_depth;
        p.cosine = hn::Max(hn::Mul(hn::Neg(p.slope), hn::LoadU(d, &frame.inverse_ray(x, y))), set(1e-6f));
        p.measured = hn::LoadU(d, &frame.depth(x, y));
        visit(x, y, static_cast<std::size_t>(x - start), p);
      }
    }
  }
  return static_cast<int>(in_view);
}

/// As portable_exp(float).
HWY_INLINE F exp_lanes(F x) {
  const DF d;
  const DI di;
  const auto vanishes = hn::Lt(x, set(-87.0f));
  x = hn::Min(x, set(88.0f));
  const F scaled = hn::Mul(x, set(1.44269504f));
  const F half = hn::IfThenElse(hn::Lt(scaled, hn::Zero(d)), set(-0.5f), set(0.5f));
  const I k = hn::ConvertTo(di, hn::Add(scaled, half));
  const F kf = hn::ConvertTo(d, k);
  const F r = hn::Add(hn::Sub(x, hn::Mul(kf, set(0.693359375f))), hn::Mul(kf, set(2.12194440e-4f)));
  const F r2 = hn::Mul(r, r);
  const auto pair = [&](float low, float high) HWY_ATTR { return hn::Add(set(low), hn::Mul(r, set(high))); };
  const F tail = hn::Add(pair(0.041666667f, 0.0083333333f), hn::Mul(r2, set(0.0013888889f)));
  const F upper = hn::Add(pair(0.5f, 0.16666667f), hn::Mul(r2, tail));
  const F p = hn::Add(hn::Add(set(1.0f), r), hn::Mul(r2, upper));
  const F power = hn::BitCast(d, hn::ShiftLeft<23>(hn::Add(k, set(127))));
  return hn::IfThenZeroElse(vanishes, hn::Mul(p, power));
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

/// A field of the classes, by class, and for each lane the value of its own.
class ClassValues {
 public:
  template <class Value>
  ClassValues(const PixelClasses& classes, Value value) {
    for (std::size_t i = 0; i < PixelClasses::kIncidences; ++i) {
      inside_[i] = value(classes.of_incidence(i, false));
      outline_[i] = value(classes.of_incidence(i, true));
    }
  }
  HWY_INLINE F at(const M (&beyond)[PixelClasses::kIncidences - 1], M outline) const {
    F value = hn::IfThenElse(outline, set(outline_[0]), set(inside_[0]));
    for (std::size_t i = 1; i < PixelClasses::kIncidences; ++i)
      value = hn::IfThenElse(beyond[i - 1], hn::IfThenElse(outline, set(outline_[i]), set(inside_[i])), value);
    return value;
  }

 private:
  float inside_[PixelClasses::kIncidences], outline_[PixelClasses::kIncidences];
};

class EvidenceLanes {
 public:
  EvidenceLanes(const EvidenceTerms& terms, const PoseTile& tile)
      : frame_(*terms.frame),
        tile_(tile),
        colors_(terms.color_ratio),
        bounds_(terms.classes->bounds()),
        constant_(terms.classes->of_incidence(0, false)),
        missing_(*terms.classes, [](const PixelClass& c) { return c.missing; }),
        returned_(*terms.classes, [](const PixelClass& c) { return c.returned; }),
        returned_ratio_(*terms.classes, [](const PixelClass& c) { return c.returned_ratio; }),
        missing_ratio_(*terms.classes, [](const PixelClass& c) { return c.missing_ratio; }),
        precision_(frame_.model.options()),
        min_depth_(static_cast<float>(frame_.model.options().min_depth)) {}

  /// `place` is where the vector begins in its block.
  HWY_INLINE void add(int x, int y, std::size_t place, const Pixels& p) {
    const DF d;
    const F zero = hn::Zero(d);
    const F absent_missing = hn::LoadU(d, &frame_.absent_missing(x, y));
    const M not_known = hn::Lt(absent_missing, zero);
    M beyond[PixelClasses::kIncidences - 1];
    for (std::size_t i = 0; i + 1 < PixelClasses::kIncidences; ++i) beyond[i] = hn::Gt(p.cosine, set(bounds_[i]));
    const M outline = at_outline(x, y);
    covered_ += hn::CountTrue(d, p.covered);

    const M returns = hn::AndNot(hn::Eq(p.measured, zero), p.covered);
    const M missing = hn::AndNot(returns, p.covered);
    if (!hn::AllFalse(d, missing)) {
      const F known = hn::IfThenElse(not_known, set(1.0f), absent_missing);
      const F ratio = hn::Div(missing_.at(beyond, outline), known);
      missing_log_.multiply(place, missing, hn::IfThenElse(not_known, missing_ratio_.at(beyond, outline), ratio));
    }
    if (!hn::AllFalse(d, returns)) add_returns(x, y, place, p, returns, not_known, beyond, outline);
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
  HWY_INLINE M at_outline(int x, int y) const {
    const DF d;
    const float* pixel = tile_.inverse_depth(y) + x;
    const F beside = hn::Min(hn::LoadU(d, pixel - 1), hn::LoadU(d, pixel + 1));
    const F across =
        hn::Min(hn::LoadU(d, tile_.inverse_depth(y - 1) + x), hn::LoadU(d, tile_.inverse_depth(y + 1) + x));
    return hn::Eq(hn::Min(beside, across), hn::Zero(d));
  }

  HWY_INLINE void add_returns(int x, int y, std::size_t place, const Pixels& p, M returns, M not_known,
                              const M (&beyond)[PixelClasses::kIncidences - 1], M outline) {
    const DF d;
    const F zero = hn::Zero(d);
    const F tilt = hn::Min(hn::Max(hn::Mul(p.cosine, set(precision_.per_cosine)), set(precision_.least)), set(1.0f));
    const F precision = hn::Mul(hn::Mul(hn::Mul(set(precision_.scale), p.inverse_depth), p.inverse_depth), tilt);
    const F deviation = hn::Mul(hn::Sub(p.measured, p.depth), precision);
    F density = set(constant_.outlier_density);
    const M hits = hn::And(returns, hn::Lt(hn::Abs(deviation), set(kHitSigmas)));
    if (!hn::AllFalse(d, hits)) {
      F hit = hn::Mul(hn::Mul(set(constant_.hit), precision),
                      exp_lanes(hn::Mul(hn::Mul(set(-0.5f), deviation), deviation)));
      if (colors_ != nullptr) hit = hn::Mul(hit, hn::LoadU(d, &(*colors_)(x, y)));
      density = hn::Add(density, hn::IfThenElseZero(hits, hit));
    }
    const F occluder = hn::Div(set(constant_.occluder), hn::Sub(p.depth, set(min_depth_)));
    density = hn::Add(density, hn::IfThenElseZero(hn::Lt(deviation, zero), occluder));
    const F share = hn::Mul(returned_.at(beyond, outline), hn::LoadU(d, &frame_.inverse_returns(x, y)));
    const F returned = hn::IfThenElse(not_known, returned_ratio_.at(beyond, outline), share);
    const F against_absent = hn::Mul(density, hn::LoadU(d, &frame_.inverse_absent(x, y)));
    const F ratio = hn::Max(hn::Mul(returned, hn::Add(against_absent, set(constant_.behind))), set(kMinRatio));
    const M occluded = hn::And(returns, hn::Lt(deviation, set(-kMatchSigmas)));
    const M visible = hn::AndNot(occluded, returns);
    measured_ += hn::CountTrue(d, returns);
    visible_ += hn::CountTrue(d, visible);
    hits_ += hn::CountTrue(d, hn::And(visible, hn::Le(deviation, set(kMatchSigmas))));
    visible_log_.multiply(place, visible, ratio);
    if (!hn::AllFalse(d, occluded)) occluded_log_.multiply(place, occluded, ratio);
  }

  const FrameTerms& frame_;
  const PoseTile& tile_;
  const geometry::Image<float>* colors_;
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
  const int in_view =
      for_each_block(*terms.frame, seen, tile,
                     [&](int x, int y, std::size_t place, const Pixels& p) HWY_ATTR { lanes.add(x, y, place, p); });
  lanes.finish(in_view, evidence);
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
