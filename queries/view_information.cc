// SPDX-License-Identifier: Apache-2.0
// The entropy that is left is that of the filter's own posterior: weights from the sensor model's likelihood of the
// image, tempered. Images are drawn from that sensor model pixel by pixel.
#include "view_information.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/core/check.h"

namespace prescene::queries {
namespace {

using rendering::AbsentMixture;
using rendering::PixelMixture;
using rendering::SensorModel;

/// Depths that are closer are the same: they come from one surface that was drawn by other triangles, m.
constexpr float kSameDepth = 1e-5F;
constexpr float kSameCosine = 1e-3F;

bool look_alike(const ExpectedSurface& a, const ExpectedSurface& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == ExpectedSurface::Kind::kNothing) return true;
  return a.thing == b.thing && a.outline == b.outline && std::abs(a.depth - b.depth) <= kSameDepth &&
         std::abs(a.cosine - b.cosine) <= kSameCosine;
}

/// Where hypotheses differ under the same circumstances; elsewhere they cannot be told apart.
std::vector<std::size_t> different_pixels(const LookedAt& seen) {
  std::vector<std::size_t> pixels;
  const auto circumstances = static_cast<std::size_t>(seen.circumstances);
  for (std::size_t p = 0; p < seen.images.front().size(); ++p) {
    bool differs = false;
    for (std::size_t i = circumstances; i < seen.images.size() && !differs; ++i)
      differs = !look_alike(seen.images[i].data()[p], seen.images[i % circumstances].data()[p]);
    if (differs) pixels.push_back(p);
  }
  return pixels;
}

/// What a pixel returns: missing, or a density of two Gaussians and two constants.
struct PixelDensity {
  double missing = 0.0, log_missing = 0.0, log_returned = 0.0;
  double peak = 0.0, depth = 0.0, inverse_sigma = 0.0;              // of the surface
  double far_peak = 0.0, far_depth = 0.0, far_inverse_sigma = 0.0;  // of what is seen through it
  double nearer = 0.0, anywhere = 0.0;                              // 1/m

  double log_density(double z) const {
    const auto gaussian = [z](double top, double mean, double inverse) {
      if (!(top > 0.0)) return 0.0;
      const double t = (z - mean) * inverse;
      return top * std::exp(-0.5 * t * t);
    };
    return std::log(gaussian(peak, depth, inverse_sigma) + gaussian(far_peak, far_depth, far_inverse_sigma) +
                    (z < depth ? nearer : 0.0) + anywhere);
  }
};

/// A pixel, as the sensor model draws it and as its density.
struct ModelledPixel {
  bool is_object = false;
  PixelMixture mixture;
  AbsentMixture absent;
  PixelDensity density;
};

AbsentMixture surroundings_of(const ExpectedSurface& surface, const SensorModel& model) {
  AbsentMixture absent;
  absent.missing = model.options().background_missing;
  if (surface.kind != ExpectedSurface::Kind::kSurroundings) return absent;
  const double sigma = model.hit_sigma(surface.depth, 1.0);
  absent.peak_depth = surface.depth;
  absent.peak_sigma = std::hypot(sigma, model.options().support_sigma);
  absent.peak_weight = model.options().background_weight;
  return absent;
}

/// `says_nothing`: a missing return says nothing there.
ModelledPixel modelled(const ExpectedSurface& surface, const LookedAt& seen, std::size_t pixel,
                       const SensorModel& model, bool says_nothing) {
  constexpr double kRoot = std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  ModelledPixel result;
  PixelDensity& density = result.density;
  const double range = model.range();
  result.is_object = surface.kind == ExpectedSurface::Kind::kObject;
  result.absent = surroundings_of(result.is_object ? seen.surroundings->data()[pixel] : surface, model);
  const AbsentMixture& absent = result.absent;
  if (result.is_object) {
    const double outline = surface.outline ? 0.5 * seen.step : std::numeric_limits<double>::infinity();
    result.mixture = model.mixture(seen.materials[surface.thing], {surface.depth, surface.cosine, outline});
    const PixelMixture& m = result.mixture;
    density.missing = m.missing;
    density.depth = m.depth;
    density.inverse_sigma = 1.0 / m.sigma;
    density.peak = m.hit * kRoot / m.sigma;
    density.nearer = m.occluder / std::max(1e-6, m.depth - model.options().min_depth);
    density.anywhere = (m.outlier + m.behind * (1.0 - absent.peak_weight)) / range;
    if (absent.peak_weight > 0.0) {
      density.far_depth = absent.peak_depth;
      density.far_inverse_sigma = 1.0 / absent.peak_sigma;
      density.far_peak = m.behind * absent.peak_weight * kRoot / absent.peak_sigma;
    }
  } else {
    density.missing = absent.missing;
    density.anywhere = (1.0 - absent.peak_weight) / range;
    if (absent.peak_weight > 0.0) {
      density.depth = absent.peak_depth;
      density.inverse_sigma = 1.0 / absent.peak_sigma;
      density.peak = absent.peak_weight * kRoot / absent.peak_sigma;
    }
  }
  if (says_nothing) density.missing = result.mixture.missing = result.absent.missing = 0.0;
  density.log_missing = std::log(std::max(density.missing, 1e-12));
  density.log_returned = std::log1p(-density.missing);
  return result;
}

double log_sum(std::span<const double> logs) {
  const double most = *std::ranges::max_element(logs);
  double sum = 0.0;
  for (const double value : logs) sum += std::exp(value - most);
  return most + std::log(sum);
}

}  // namespace

double entropy_of(std::span<const double> probabilities) {
  double sum = 0.0;
  for (const double p : probabilities)
    if (p > 0.0) sum -= p * std::log(p);
  return sum;
}

MeanInterval mean_interval(std::span<const double> values, std::span<const double> weights, double deviations) {
  MeanInterval result;
  for (std::size_t i = 0; i < values.size(); ++i) result.mean += weights[i] * values[i];
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double off = weights[i] * (values[i] - result.mean);
    squares += off * off;
  }
  const auto n = static_cast<double>(values.size());
  if (n > 1.0) result.half_width = deviations * std::sqrt(squares * n / (n - 1.0));
  return result;
}

ViewInformation information_of(const LookedAt& seen, const SensorModel& model, const core::RandomStream& stream,
                               double deviations, core::ThreadPool& pool) {
  const std::size_t hypotheses = seen.probabilities.size();
  const auto circumstances = static_cast<std::size_t>(seen.circumstances);
  PRESCENE_CHECK(hypotheses > 0 && seen.images.size() == hypotheses * circumstances);
  ViewInformation result;
  result.by_image.assign(seen.images.size(), 0.0);
  for (std::size_t i = 0; i < seen.images.size(); ++i)
    result.weights.push_back(seen.probabilities[i / circumstances] / static_cast<double>(circumstances));
  const std::vector<std::size_t> pixels = different_pixels(seen);
  result.different_pixels = static_cast<int>(pixels.size());
  if (pixels.empty()) return result;

  // By pixel, by image.
  std::vector<ModelledPixel> models(pixels.size() * seen.images.size());
  pool.for_each_index(pixels.size(), [&](std::size_t k) {
    // Whether empty space returns nothing is not known: then neither outcome is evidence.
    const bool says_nothing = std::ranges::any_of(seen.images, [&](const ExpectedImage& image) {
      return image.data()[pixels[k]].kind == ExpectedSurface::Kind::kNothing;
    });
    for (std::size_t i = 0; i < seen.images.size(); ++i)
      models[k * seen.images.size() + i] =
          modelled(seen.images[i].data()[pixels[k]], seen, pixels[k], model, says_nothing);
  });

  const double before = entropy_of(seen.probabilities);
  pool.for_each_index(seen.images.size(), [&](std::size_t truth) {
    core::RandomStream draws = stream.at(truth);
    std::vector<double> logs(seen.images.size(), 0.0);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const ModelledPixel* const row = &models[k * seen.images.size()];
      const ModelledPixel& true_pixel = row[truth];
      const double z = true_pixel.is_object ? model.sample(true_pixel.mixture, true_pixel.absent, draws)
                                            : model.sample(true_pixel.absent, draws);
      for (std::size_t i = 0; i < logs.size(); ++i) {
        const PixelDensity& density = row[i].density;
        logs[i] += z > 0.0 ? density.log_returned + density.log_density(z) : density.log_missing;
      }
    }
    for (double& value : logs) value *= seen.tempering;
    std::vector<double> posterior(hypotheses);
    for (std::size_t h = 0; h < hypotheses; ++h)
      posterior[h] = std::log(std::max(seen.probabilities[h], 1e-300)) +
                     log_sum(std::span(logs).subspan(h * circumstances, circumstances));
    const double all = log_sum(posterior);
    for (double& value : posterior) value = std::exp(value - all);
    result.by_image[truth] = before - entropy_of(posterior);
  });
  const MeanInterval mean = mean_interval(result.by_image, result.weights, deviations);
  result.reduction = std::clamp(mean.mean, 0.0, before);
  result.low = std::clamp(mean.mean - mean.half_width, 0.0, before);
  result.high = std::clamp(mean.mean + mean.half_width, 0.0, before);
  return result;
}

}  // namespace prescene::queries
