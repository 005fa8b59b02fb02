// SPDX-License-Identifier: Apache-2.0
// What a depth camera returns at one pixel, given what is there: one model with two faces. The likelihood asks for its
// density as a ratio against "the object is not there"; the simulated camera samples from it.
// docs/reference/sensor_model.md has the equations and where the figures come from.
//
//   SensorModel model;                                    // options with defaults
//   PixelMixture m = model.mixture(material, {d, cosine, px});
//   double log_r = model.log_ratio(m, z, absent, color_ratio);
//   double drawn = model.sample(m, absent, stream);       // 0 = no return
//
// The formula of one pixel is written in several places. A new term goes into each, in this order:
// - rendering/sensor/sensor_model.cc: the definition, in double precision, with its sampler; tests/rendering compares
//   the two.
// - rendering/sensor/pixel_classes.cc: what of the term does not depend on the pixel's depths, in single precision.
// - rendering/reference/reference_likelihood.cc: the order of single-precision operations that every batch follows.
// - rendering/simd/pose_evidence-inl.h: the same operations in lanes; tests/rendering/simd_likelihood_test.cc wants the
//   same bits.
// - rendering/gpu/shader_pixels.cc: the same operations as a shader; tests/rendering/gpu wants the same bits
//   where the device computes exactly.
// - rendering/sensor/expected_evidence.cc: the parts of the mixture, for the expectation of the ratio.
// - docs/reference/sensor_model.md: the equation, and where the term's figures come from.
#pragma once

#include <array>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/core/status.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

/// Figures of the model; defaults from opaque household objects at 0.7 to 1.1 m, structured-light camera. The comments
/// have the form that tools/filter_settings reads.
struct SensorModelOptions {
  /// m. Nothing is returned from nearer. Range 0.01 to 10. Chosen.
  double min_depth = 0.3;
  /// m. Nothing is returned from further. Range 0.1 to 100. Chosen.
  double max_depth = 2.5;
  /// 1/m. The standard deviation of a hit on a surface seen frontally at depth d is this times d^2. Range 1e-6 to 1.
  /// Measured: docs/studies/likelihood.md.
  double sigma_per_depth_squared = 0.0038;
  /// cosine. If ray and normal have a smaller one, the deviation grows with 1 / cosine. Range 0 to 0.999. Tuned:
  /// docs/studies/likelihood.md.
  double incidence_knee = 0.6;
  /// factor. It grows by no more than this. Range 1 to 100. Tuned: docs/studies/likelihood.md.
  double incidence_max_growth = 4.0;
  /// m. Standard deviation about a known support plane, the plane's own error included. Range 0.0001 to 0.1. Chosen.
  double support_sigma = 0.004;
  /// share. Of the pixels on a known support plane, this share returns the plane if the object is absent. Range 0 to
  /// 0.999. Measured: docs/studies/likelihood.md.
  double support_weight = 0.6;
  /// share. Of the pixels with a known background (an earlier or the empty scene, or a known neighbour behind the
  /// object), this share returns it if the object is absent. Range 0 to 0.999. Chosen.
  double background_weight = 0.8;
  /// probability. A pixel returns nothing where the known background returned something. Range 0.001 to 0.999. Tuned:
  /// docs/studies/likelihood.md.
  double background_missing = 0.03;
  /// probability. A pixel returns nothing where the known background did not either. Range 0.001 to 0.999. Chosen.
  double background_missing_again = 0.7;
  /// exponent. The colour ratio is raised to this power; 0 switches colour off. Range 0 to 10. Chosen.
  double color_exponent = 1.0;
  /// pixels. Missing returns grow towards the object's outline: upper ends of the classes of the distance to it in the
  /// full image. Range 0 to 1000. Chosen.
  std::array<double, 4> outline_px = {1.5, 3.0, 6.0, 12.0};
  /// probability. A pixel of each of these classes returns nothing. Range 0 to 0.999. Tuned:
  /// docs/studies/likelihood.md.
  std::array<double, 4> outline_missing = {0.38, 0.35, 0.27, 0.12};
  /// cosine. Missing returns grow with the angle of incidence: upper ends of the classes of its cosine. Range 0 to 1.
  /// Chosen.
  std::array<double, 3> incidence_cosine = {0.2, 0.4, 0.6};
  /// probability. A pixel of each of these classes returns nothing. Range 0 to 0.999. Tuned:
  /// docs/studies/likelihood.md.
  std::array<double, 3> incidence_missing = {0.47, 0.28, 0.10};

  friend bool operator==(const SensorModelOptions&, const SensorModelOptions&) = default;
};

/// Pixels are correlated, so a sum of log ratios over n of them, `step` full-image pixels apart, is worth less than n
/// independent ones: it is multiplied by alpha = 1 / (1 + correlated_px2 / step^2 + n / effective_pixels).
struct Tempering {
  /// pixels. As many of the full image (an area) share one error: what noise is correlated over. Range 0 to 1e6.
  /// Chosen.
  double correlated_px2 = 0.0;
  /// pixels. No sum is worth more than as many: errors that all pixels share. 0: there are none. Range 0 to 1e6.
  /// Chosen.
  double effective_pixels = 0.0;

  friend bool operator==(const Tempering&, const Tempering&) = default;
};
/// alpha, in (0, 1].
double tempering(const Tempering& tempering, double pixels, int step);

/// The two sums that are tempered: log ratios, which weigh poses against each other, and the information of
/// Gauss-Newton equations, which knows no silhouettes.
struct TemperingOptions {
  /// Of log ratios. Tuned: docs/studies/accuracy.md.
  Tempering weight = {75.0, 500.0};
  /// Of Gauss-Newton equations. Tuned: docs/studies/accuracy.md.
  Tempering information = {90.0, 0.0};

  friend bool operator==(const TemperingOptions&, const TemperingOptions&) = default;
};

/// Where on a surface a pixel looks.
struct PixelGeometry {
  double depth = 0.0;   ///< Of the predicted surface, z in C, metres, > min_depth to be seen.
  double cosine = 1.0;  ///< |n . ray| of unit vectors.
  /// Distance to the object's outline, full-image pixels.
  double outline_px = std::numeric_limits<double>::infinity();
};

/// The distribution of one pixel's return on a predicted surface: missing with probability `missing`, else a mixture
/// with weights that sum to 1.
struct PixelMixture {
  double depth = 0.0;  ///< m
  double sigma = 0.0;  ///< Of a hit, m.
  double hit = 0.0;
  double occluder = 0.0;  ///< Uniform on [min_depth, depth].
  double behind = 0.0;    ///< Distributed as if the object were absent.
  double outlier = 0.0;   ///< Uniform on [min_depth, max_depth].
  double missing = 0.0;
  /// The same of a background of which nothing is known, were the object absent: as often as the object, so that
  /// missing returns say nothing. It may be out of range.
  double missing_unknown = 0.0;
};

/// What a pixel returns when the object is absent: around a known depth (`peak_weight` > 0), else anywhere in range.
struct AbsentMixture {
  double peak_depth = 0.0;  ///< m
  double peak_sigma = 0.0;  ///< m
  double peak_weight = 0.0;
  /// Probability of no return; negative = not known, then a missing return says nothing.
  double missing = -1.0;
};

/// Weights and probabilities within [0, 1), positive lengths, ordered classes; the message names the field.
core::Status validate(const SensorModelOptions& options);
/// Shares within [0, 1] that sum to 1, missing in [0, 1).
core::Status validate(const SurfaceMaterial& material);

/// Not copied per pixel; immutable, any number of threads.
class SensorModel {
 public:
  explicit SensorModel(const SensorModelOptions& options = {}) : options_(options) {}
  const SensorModelOptions& options() const { return options_; }
  /// Width of the range, m.
  double range() const { return options_.max_depth - options_.min_depth; }

  /// Standard deviation of a hit, m.
  double hit_sigma(double depth, double cosine) const;
  /// Probability of no return of a material; within [0.001, 0.999] whatever the settings, so that ratios stay finite.
  double missing_probability(const SurfaceMaterial& material, double cosine, double outline_px) const;
  PixelMixture mixture(const SurfaceMaterial& material, const PixelGeometry& pixel) const;

  /// log density (1/m) of a returned depth z, given that there is a return. A hit's Gaussian is not cut at the range's
  /// ends.
  double log_density(const PixelMixture& mixture, double z, const AbsentMixture& absent) const;
  double log_density(const AbsentMixture& absent, double z) const;
  /// The density itself, 1/m.
  double density(const AbsentMixture& absent, double z) const;

  /// log of p(z, c | object there) / p(z, c | absent), missing returns (z = 0) included. `color_ratio` is
  /// p(c | object) / p(c | not object), 1 = no colour; it multiplies the hit alone: an occluded pixel says nothing
  /// about the object's colour.
  double log_ratio(const PixelMixture& mixture, double z, const AbsentMixture& absent, double color_ratio = 1.0) const;

  /// One return of the pixel: metres, or 0 for none. Draws from exactly the density above (4 draws always).
  double sample(const PixelMixture& mixture, const AbsentMixture& absent, core::RandomStream& stream) const;
  double sample(const AbsentMixture& absent, core::RandomStream& stream) const;

 private:
  SensorModelOptions options_;
};

}  // namespace prescene::rendering
