// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/sensor_model.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "prescene/rendering/portable_math.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

double normal_density(double x, double mean, double sigma) {
  const double t = (x - mean) / sigma;
  return kInverseSqrt2Pi / sigma * portable_exp(-0.5 * t * t);
}

/// The value of the first class whose bound is not exceeded, else `otherwise`.
template <std::size_t N>
double class_value(const std::array<double, N>& bounds, const std::array<double, N>& values, double x,
                   double otherwise) {
  for (std::size_t i = 0; i < N; ++i)
    if (x <= bounds[i]) return values[i];
  return otherwise;
}

/// What a class adds to the probability that a frontal pixel inside the outline returns nothing.
double excess(double missing, double base) { return std::max(0.0, (missing - base) / (1.0 - base)); }

}  // namespace

double tempering(const Tempering& tempering, double pixels, int step) {
  const double area = static_cast<double>(step) * step;
  const double shared = tempering.effective_pixels > 0.0 ? pixels / tempering.effective_pixels : 0.0;
  return 1.0 / (1.0 + tempering.correlated_px2 / area + shared);
}

core::Status validate(const SensorModelOptions& o) {
  const auto wrong = [](const char* field, double value, const char* remedy) {
    return core::invalid_input(std::string("sensor model: ") + field + " is " + std::to_string(value) + ": " + remedy);
  };
  constexpr const char* kPositive = "give a positive number";
  constexpr const char* kShare = "give a share from 0 to below 1";
  const auto positive = [](double x) { return std::isfinite(x) && x > 0.0; };
  const auto share = [](double x) { return x >= 0.0 && x < 1.0; };
  if (!positive(o.min_depth)) return wrong("min_depth", o.min_depth, kPositive);
  if (!(std::isfinite(o.max_depth) && o.max_depth > o.min_depth))
    return wrong("max_depth", o.max_depth, "give a depth beyond min_depth");
  if (!positive(o.sigma_per_depth_squared))
    return wrong("sigma_per_depth_squared", o.sigma_per_depth_squared, kPositive);
  if (!share(o.incidence_knee)) return wrong("incidence_knee", o.incidence_knee, kShare);
  if (!(std::isfinite(o.incidence_max_growth) && o.incidence_max_growth >= 1.0))
    return wrong("incidence_max_growth", o.incidence_max_growth, "give a factor of at least 1");
  if (!positive(o.support_sigma)) return wrong("support_sigma", o.support_sigma, kPositive);
  if (!share(o.support_weight)) return wrong("support_weight", o.support_weight, kShare);
  if (!share(o.background_weight)) return wrong("background_weight", o.background_weight, kShare);
  if (!(share(o.background_missing) && o.background_missing > 0.0))
    return wrong("background_missing", o.background_missing, "give a probability between 0 and 1");
  if (!(share(o.background_missing_again) && o.background_missing_again > 0.0))
    return wrong("background_missing_again", o.background_missing_again, "give a probability between 0 and 1");
  if (!(std::isfinite(o.color_exponent) && o.color_exponent >= 0.0))
    return wrong("color_exponent", o.color_exponent, "give 0 (no colour) or a positive number");
  if (!std::is_sorted(o.outline_px.begin(), o.outline_px.end()))
    return wrong("outline_px", o.outline_px[0], "give the classes in ascending order");
  if (!std::is_sorted(o.incidence_cosine.begin(), o.incidence_cosine.end()))
    return wrong("incidence_cosine", o.incidence_cosine[0], "give the classes in ascending order");
  for (const double p : o.outline_missing)
    if (!share(p)) return wrong("outline_missing", p, kShare);
  for (const double p : o.incidence_missing)
    if (!share(p)) return wrong("incidence_missing", p, kShare);
  return core::ok_status();
}

core::Status validate(const SurfaceMaterial& material) {
  for (const double share : {material.hit, material.occluder, material.behind, material.outlier})
    if (!(share >= 0.0 && share <= 1.0))
      return core::invalid_input("material: a share is " + std::to_string(share) + ": give shares from 0 to 1");
  const double sum = material.hit + material.occluder + material.behind + material.outlier;
  if (!(std::abs(sum - 1.0) < 1e-6))
    return core::invalid_input("material: hit, occluder, behind and outlier sum to " + std::to_string(sum) +
                               ": make them sum to 1");
  if (!(material.outlier < 1.0)) return core::invalid_input("material: outlier is 1: leave something to see");
  if (!(material.missing >= 0.0 && material.missing < 1.0))
    return core::invalid_input("material: missing is " + std::to_string(material.missing) +
                               ": give a probability from 0 to below 1");
  return core::ok_status();
}

double SensorModel::hit_sigma(double depth, double cosine) const {
  const double growth = options_.incidence_knee / std::max(cosine, 1e-6);
  return options_.sigma_per_depth_squared * depth * depth * std::clamp(growth, 1.0, options_.incidence_max_growth);
}

double SensorModel::missing_probability(const SurfaceMaterial& material, double cosine, double outline_px) const {
  const double base = SurfaceMaterial{}.missing;
  const double at_outline = class_value(options_.outline_px, options_.outline_missing, outline_px, base);
  const double at_incidence = class_value(options_.incidence_cosine, options_.incidence_missing, cosine, base);
  const double missing =
      1.0 - (1.0 - material.missing) * (1.0 - excess(at_outline, base)) * (1.0 - excess(at_incidence, base));
  return std::clamp(missing, 0.001, 0.999);
}

PixelMixture SensorModel::mixture(const SurfaceMaterial& material, const PixelGeometry& pixel) const {
  PixelMixture m;
  m.depth = pixel.depth;
  m.sigma = hit_sigma(pixel.depth, pixel.cosine);
  m.hit = material.hit;
  m.occluder = material.occluder;
  m.behind = material.behind;
  m.outlier = material.outlier;
  m.missing = missing_probability(material, pixel.cosine, pixel.outline_px);
  m.missing_unknown = m.missing;
  return m;
}

double SensorModel::density(const AbsentMixture& absent, double z) const {
  double density = z >= options_.min_depth && z <= options_.max_depth ? (1.0 - absent.peak_weight) / range() : 0.0;
  if (absent.peak_weight > 0.0) density += absent.peak_weight * normal_density(z, absent.peak_depth, absent.peak_sigma);
  return density;
}

double SensorModel::log_density(const AbsentMixture& absent, double z) const {
  return portable_log(density(absent, z));
}

double SensorModel::log_density(const PixelMixture& m, double z, const AbsentMixture& absent) const {
  const bool in_range = z >= options_.min_depth && z <= options_.max_depth;
  double density = m.hit * normal_density(z, m.depth, m.sigma);
  if (in_range && z < m.depth) density += m.occluder / (m.depth - options_.min_depth);
  if (in_range) density += m.outlier / range();
  if (m.behind > 0.0) density += m.behind * this->density(absent, z);
  return portable_log(density);
}

double SensorModel::log_ratio(const PixelMixture& m, double z, const AbsentMixture& absent, double color_ratio) const {
  const double absent_missing = absent.missing >= 0.0 ? absent.missing : m.missing_unknown;
  if (z <= 0.0) return portable_log(m.missing / absent_missing);
  // The colour of an occluder, of what is behind, or of an outlier is as likely as any other.
  PixelMixture colored = m;
  colored.hit *= color_ratio;
  return portable_log((1.0 - m.missing) / (1.0 - absent_missing)) + log_density(colored, z, absent) -
         log_density(absent, z);
}

double SensorModel::sample(const AbsentMixture& absent, core::RandomStream& stream) const {
  const double missing = stream.uniform();
  const double part = stream.uniform();
  const double value = stream.uniform();
  if (missing < absent.missing) return 0.0;
  if (part < absent.peak_weight) return absent.peak_depth + absent.peak_sigma * core::inverse_normal_cdf(value);
  return options_.min_depth + range() * value;
}

double SensorModel::sample(const PixelMixture& m, const AbsentMixture& absent, core::RandomStream& stream) const {
  const double missing = stream.uniform();
  double part = stream.uniform();
  const double absent_part = stream.uniform();
  const double value = stream.uniform();
  if (missing < m.missing) return 0.0;
  if (part < m.hit) return m.depth + m.sigma * core::inverse_normal_cdf(value);
  part -= m.hit;
  if (part < m.occluder) return options_.min_depth + (m.depth - options_.min_depth) * value;
  part -= m.occluder;
  if (part < m.behind && absent_part < absent.peak_weight)
    return absent.peak_depth + absent.peak_sigma * core::inverse_normal_cdf(value);
  return options_.min_depth + range() * value;
}

}  // namespace prescene::rendering
