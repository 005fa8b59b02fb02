// SPDX-License-Identifier: Apache-2.0
// The sensor model as batches use it: what of a pixel's mixture does not depend on its depths, in single precision
// (docs/reference/sensor_model.md). Batches that follow the same operations give the same bits.
#pragma once

#include <array>
#include <cstddef>

#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::rendering {

/// A visible or matching pixel is within this many standard deviations of the predicted surface.
inline constexpr float kMatchSigmas = 3.0f;
/// So many standard deviations off, the hit is nothing beside the outliers.
inline constexpr float kHitSigmas = 10.0f;
/// The standard normal density at 0.
inline constexpr double kInverseSqrt2Pi = 0.3989422804014327;
/// exp(-t^2/2) = 2^(this t^2).
inline constexpr float kNormalExponent = -0.72134752f;
/// No pixel counts more against a pose than this, even when a material is said to have no outliers.
inline constexpr float kMinRatio = 1e-12f;

/// 1 / sigma of a hit, 1/m: scale w^2 min(1, max(least, cosine * per_cosine)) at 1/z = w.
struct HitPrecision {
  explicit HitPrecision(const SensorModelOptions& options)
      : scale(static_cast<float>(1.0 / options.sigma_per_depth_squared)),
        per_cosine(static_cast<float>(1.0 / options.incidence_knee)),
        least(static_cast<float>(1.0 / options.incidence_max_growth)) {}

  float scale, per_cosine, least;
};

/// The parts of a pixel's mixture that depend only on the material and the class of the pixel.
struct PixelClass {
  float hit = 0.0f;  ///< Weight over sqrt(2 pi).
  float occluder = 0.0f;
  float behind = 0.0f;
  float outlier_density = 0.0f;  ///< 1/m
  float missing = 0.0f;
  float returned = 0.0f;           ///< 1 - missing.
  float returned_ratio = 0.0f;     ///< Return with the object against without it, where the background is not known.
  double log_missing_ratio = 0.0;  ///< The same of no return.
  float missing_ratio = 1.0f;      ///< exp of that.
};

/// The classes of one material in images of which every `step`th pixel is taken: four of incidence, inside and at the
/// outline. Only what is missing differs between them.
class PixelClasses {
 public:
  static constexpr std::size_t kIncidences = 4;

  PixelClasses(const SensorModel& model, const SurfaceMaterial& material, int step);

  /// Cosines above which a pixel is of the next class of incidence.
  const std::array<float, kIncidences - 1>& bounds() const { return bounds_; }
  const PixelClass& of_incidence(std::size_t incidence, bool outline) const {
    return classes_[2 * incidence + (outline ? 1 : 0)];
  }
  const PixelClass& at(float cosine, bool outline) const {
    std::size_t i = 0;
    for (const float bound : bounds_) i += cosine > bound ? 1 : 0;
    return of_incidence(i, outline);
  }

 private:
  std::array<float, kIncidences - 1> bounds_;
  std::array<PixelClass, 2 * kIncidences> classes_;
};

}  // namespace prescene::rendering
