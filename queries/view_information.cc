// SPDX-License-Identifier: Apache-2.0
// Hypotheses are weighed by the sensor model's likelihood of the image, tempered, as the filter weighs particles.
// Images are drawn from that sensor model pixel by pixel.
#include "prescene/queries/view_information.h"

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

/// Pixels of blocks, whose models are kept at a time: 3 MB with 256 images.
constexpr std::size_t kBlock = 64;

struct CountedPixels {
  std::vector<std::size_t> compared;
  int different = 0;  ///< Of them: hypotheses differ under the same circumstances.
};

/// Pixels at which only circumstances differ say which of these hold, and so which pixels to expect of each hypothesis.
CountedPixels pixels_of(const LookedAt& seen) {
  CountedPixels pixels;
  const auto circumstances = static_cast<std::size_t>(seen.circumstances);
  for (std::size_t p = 0; p < seen.images.front().size(); ++p) {
    bool any = false, different = false;
    for (std::size_t i = 0; i < seen.images.size() && !different; ++i) {
      any = any || !look_alike(seen.images[i].data()[p], seen.images.front().data()[p]);
      different = !look_alike(seen.images[i].data()[p], seen.images[i % circumstances].data()[p]);
    }
    if (any || different) pixels.compared.push_back(p);
    if (different) ++pixels.different;
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
    return std::log(std::max(1e-300, gaussian(peak, depth, inverse_sigma) +
                                         gaussian(far_peak, far_depth, far_inverse_sigma) + (z < depth ? nearer : 0.0) +
                                         anywhere));
  }
};

/// A pixel, as the sensor model draws it and as its density.
struct ModelledPixel {
  bool is_nothing = false, is_object = false;
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

/// `says_nothing`: a missing return is no evidence there, nor is a return in itself; they are as frequent as ever.
ModelledPixel modelled(const ExpectedSurface& surface, const LookedAt& seen, std::size_t pixel,
                       const SensorModel& model, bool says_nothing) {
  constexpr double kRoot = std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  ModelledPixel result;
  PixelDensity& density = result.density;
  const double range = model.range();
  result.is_nothing = surface.kind == ExpectedSurface::Kind::kNothing;
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
  if (says_nothing) return result;
  density.log_missing = std::log(std::max(density.missing, 1e-12));
  density.log_returned = std::log1p(-density.missing);
  return result;
}

/// m; 0 = missing.
double drawn_depth(const ModelledPixel& pixel, const SensorModel& model, core::RandomStream& stream) {
  if (pixel.is_nothing) return 0.0;
  return pixel.is_object ? model.sample(pixel.mixture, pixel.absent, stream) : model.sample(pixel.absent, stream);
}

double log_sum(const std::vector<double>& logs) {
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

MeanInterval mean_interval(std::span<const double> values, std::span<const double> weights, double error,
                           double range) {
  MeanInterval result;
  double squared_weights = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    result.mean += weights[i] * values[i];
    squared_weights += weights[i] * weights[i];
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double off = weights[i] * (values[i] - result.mean);
    squares += off * off;
  }
  const auto n = static_cast<double>(values.size());
  if (n > 1.0) result.half_width = core::inverse_normal_cdf(1.0 - 0.5 * error) * std::sqrt(squares * n / (n - 1.0));
  result.half_width += range * std::log(2.0 / error) * squared_weights;  // 1 / n of equal weights
  return result;
}

std::optional<ViewInformation> information_of(const LookedAt& seen, const SensorModel& model,
                                              const core::RandomStream& stream, double error, core::ThreadPool& pool,
                                              const core::Cancellation* cancellation) {
  const std::size_t hypotheses = seen.probabilities.size(), images = seen.images.size();
  const auto circumstances = static_cast<std::size_t>(seen.circumstances);
  PRESCENE_CHECK(hypotheses > 0 && circumstances > 0 && images == hypotheses * circumstances);
  ViewInformation result;
  if (circumstances > 1)
    result.weights.assign(circumstances, 1.0 / static_cast<double>(circumstances));
  else
    result.weights.assign(seen.probabilities.begin(), seen.probabilities.end());
  result.values.assign(result.weights.size(), 0.0);
  const CountedPixels pixels = pixels_of(seen);
  result.different_pixels = pixels.different;
  if (pixels.different == 0) return result;

  std::vector<core::RandomStream> streams;  // by image
  for (std::size_t i = 0; i < images; ++i) streams.push_back(stream.at(i));
  std::vector<double> logs(images * images, 0.0);  // by the image that is drawn, by the image that it is weighed with
  std::vector<ModelledPixel> models(std::min(kBlock, pixels.compared.size()) * images);
  for (std::size_t begin = 0; begin < pixels.compared.size(); begin += kBlock) {
    if (cancellation != nullptr && cancellation->requested()) return std::nullopt;
    const std::size_t count = std::min(kBlock, pixels.compared.size() - begin);
    pool.for_each_index(count, [&](std::size_t k) {
      const std::size_t pixel = pixels.compared[begin + k];
      // Whether empty space returns nothing is not known.
      const bool says_nothing = std::ranges::any_of(seen.images, [&](const ExpectedImage& image) {
        return image.data()[pixel].kind == ExpectedSurface::Kind::kNothing;
      });
      for (std::size_t i = 0; i < images; ++i)
        models[k * images + i] = modelled(seen.images[i].data()[pixel], seen, pixel, model, says_nothing);
    });
    pool.for_each_index(images, [&](std::size_t truth) {
      double* const sums = &logs[truth * images];
      for (std::size_t k = 0; k < count; ++k) {
        const ModelledPixel* const row = &models[k * images];
        const double z = drawn_depth(row[truth], model, streams[truth]);
        for (std::size_t i = 0; i < images; ++i) {
          const PixelDensity& density = row[i].density;
          sums[i] += z > 0.0 ? density.log_returned + density.log_density(z) : density.log_missing;
        }
      }
    });
  }

  std::vector<double> of_circumstances, posterior(hypotheses);
  for (std::size_t truth = 0; truth < images; ++truth) {
    const std::size_t h_true = truth / circumstances, j_true = truth % circumstances;
    const double p_true = seen.probabilities[h_true];
    if (!(p_true > 0.0)) continue;
    for (std::size_t h = 0; h < hypotheses; ++h) {
      of_circumstances.clear();
      for (std::size_t j = 0; j < circumstances; ++j)
        if (j != j_true || circumstances == 1)
          of_circumstances.push_back(seen.tempering * logs[truth * images + h * circumstances + j]);
      posterior[h] = std::log(std::max(seen.probabilities[h], 1e-300)) + log_sum(of_circumstances);
    }
    const double q_true = std::exp(posterior[h_true] - log_sum(posterior));
    const double score = std::log((1.0 - kDistrust) * q_true + kDistrust * p_true) - std::log(p_true);
    if (circumstances > 1)
      result.values[j_true] += p_true * score;
    else
      result.values[h_true] = score;
  }
  const double entropy = entropy_of(seen.probabilities);
  const MeanInterval mean = mean_interval(result.values, result.weights, error, entropy);
  result.reduction = std::clamp(mean.mean, 0.0, entropy);
  result.low = std::clamp(result.reduction - mean.half_width, 0.0, entropy);
  result.high = std::clamp(result.reduction + mean.half_width, 0.0, entropy);
  return result;
}

}  // namespace prescene::queries
