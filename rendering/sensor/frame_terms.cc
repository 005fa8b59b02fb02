// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "prescene/core/check.h"
#include "prescene/rendering/portable_math.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::rendering {
namespace {

using geometry::Vector3d;

template <class Pixel>
bool fits(const geometry::ImageView<Pixel>& image, const geometry::PinholeCamera& camera) {
  return image.width() == camera.width && image.height() == camera.height;
}

template <class Pixel>
std::string size_text(const geometry::ImageView<Pixel>& image) {
  return std::to_string(image.width()) + " x " + std::to_string(image.height());
}

/// Depth along `ray` (z = 1) at which it meets the region, if it does within the range.
std::optional<double> support_depth(const SupportRegion& region, const Vector3d& ray,
                                    const SensorModelOptions& options) {
  const double slope = region.plane_C.normal.dot(ray);
  if (std::abs(slope) < 1e-9) return std::nullopt;
  const double depth = -region.plane_C.offset / slope;
  if (!(depth > options.min_depth && depth < options.max_depth)) return std::nullopt;
  bool left = false;
  bool right = false;
  const std::size_t corners = region.outline_C.size();
  for (std::size_t i = 0; i < corners; ++i) {
    const Vector3d& a = region.outline_C[i];
    const Vector3d& b = region.outline_C[(i + 1) % corners];
    const double side = region.plane_C.normal.dot((b - a).cross(ray * depth - a));
    left = left || side > 0.0;
    right = right || side < 0.0;
  }
  if (left && right) return std::nullopt;
  return depth;
}

/// Spread of what is measured about a known surface: the camera's and the knowledge's own error.
double background_sigma(const SensorModel& model, double depth) {
  const double sigma = model.hit_sigma(depth, 1.0);
  const double own = model.options().support_sigma;
  return std::sqrt(sigma * sigma + own * own);
}

/// Puts in a known surface; one beyond the range is not seen.
void expect_surface(const SensorModel& model, double depth, AbsentMixture* absent) {
  if (depth >= model.options().max_depth) return;
  absent->peak_depth = depth;
  absent->peak_sigma = background_sigma(model, depth);
  absent->peak_weight = model.options().background_weight;
}

/// What the pixel returns without the object, from the nearest source of knowledge. `ray` (z = 1) goes through it.
AbsentMixture absent_mixture(const FrameTermsInput& input, const SensorModel& model, int x, int y,
                             const Vector3d& ray) {
  const SensorModelOptions& options = model.options();
  AbsentMixture absent;
  if (!input.background.empty()) {
    const float depth = input.background(x, y);
    const bool returned = std::isfinite(depth) && depth > 0.0f;
    absent.missing = returned ? options.background_missing : options.background_missing_again;
    if (returned) expect_surface(model, depth, &absent);
    return absent;
  }
  for (const SupportRegion& region : input.supports) {
    const std::optional<double> depth = support_depth(region, ray, options);
    if (!depth || (absent.peak_weight > 0.0 && *depth >= absent.peak_depth)) continue;
    absent.peak_depth = *depth;
    absent.peak_sigma = options.support_sigma;
    absent.peak_weight = options.support_weight;
  }
  return absent;
}

/// The measurement cut to the range: what lies beyond it is as far as the model can tell.
float measured_depth(float depth, const SensorModelOptions& options) {
  if (!std::isfinite(depth) || depth <= 0.0f) return 0.0f;
  return std::clamp(depth, static_cast<float>(options.min_depth), static_cast<float>(options.max_depth));
}

float inverse_absent(const SensorModel& model, const AbsentMixture& absent, float depth) {
  if (depth <= 0.0f) return 0.0f;
  // The range's ends as rounded to single precision may lie outside of it.
  const double z = std::clamp(static_cast<double>(depth), model.options().min_depth, model.options().max_depth);
  return 1.0f / static_cast<float>(model.density(absent, z));
}

void sample_colors(const FrameTermsInput& input, int step, int offset, double exponent, FrameTerms* terms) {
  const std::size_t models = input.color.empty() ? 0 : input.color_models.size();
  terms->color_ratio.resize(models);
  std::array<float, kColorBins * kColorBins * kColorBins> ratio_of_bin;
  for (std::size_t i = 0; i < models; ++i) {
    for (std::size_t bin = 0; bin < ratio_of_bin.size(); ++bin)
      ratio_of_bin[bin] = static_cast<float>(portable_exp(exponent * input.color_models[i].log_ratio[bin]));
    geometry::Image<float>& image = terms->color_ratio[i];
    resize(&image, terms->camera.width, terms->camera.height);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        image(x, y) = ratio_of_bin[ColorHistogram::bin(input.color(offset + step * x, offset + step * y))];
  }
}

void measure_rays(const geometry::PinholeCamera& camera, geometry::Image<float>* inverse_ray) {
  resize(inverse_ray, camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      (*inverse_ray)(x, y) = static_cast<float>(1.0 / camera.unproject(x, y, 1.0).norm());
}

}  // namespace

core::Status make_frame_terms(const FrameTermsInput& input, const FrameTermsOptions& options, const SensorModel& model,
                              FrameTerms* terms) {
  PRESCENE_RETURN_IF_ERROR(geometry::validate(input.camera));
  const std::string camera_size = std::to_string(input.camera.width) + " x " + std::to_string(input.camera.height);
  if (!fits(input.depth, input.camera))
    return core::invalid_input("the depth image is " + size_text(input.depth) + ", its camera " + camera_size +
                               ": give the camera info of that image");
  if (!input.color.empty() && !fits(input.color, input.camera))
    return core::invalid_input("the colour image is " + size_text(input.color) + ", the depth camera " + camera_size +
                               ": register colour to depth first, or leave it out");
  if (!input.background.empty() && !fits(input.background, input.camera))
    return core::invalid_input("the background depth is " + size_text(input.background) + ", the camera " +
                               camera_size + ": it must be of the same view");

  const int step = pixel_step(input.camera.width, options.target_width);
  const int offset = pixel_offset(step, input.camera.width, input.camera.height);
  terms->model = model;
  terms->tempering = options.tempering;
  terms->step = step;
  const geometry::PinholeCamera camera = input.camera.subsampled(step, offset);
  if (!(terms->camera == camera) || terms->inverse_ray.empty()) measure_rays(camera, &terms->inverse_ray);
  terms->camera = camera;
  const int width = terms->camera.width;
  const int height = terms->camera.height;
  for (geometry::Image<float>* image : {&terms->depth, &terms->inverse_absent, &terms->absent_peak,
                                        &terms->absent_missing, &terms->inverse_returns, &terms->known})
    resize(image, width, height);
  std::vector<double> across;  // x of the ray through each column
  for (int x = 0; x < width; ++x) across.push_back(input.camera.unproject(offset + step * x, 0.0, 1.0).x());
  for (int y = 0; y < height; ++y) {
    const int full_y = offset + step * y;
    Vector3d ray = input.camera.unproject(0.0, full_y, 1.0);
    for (int x = 0; x < width; ++x) {
      const int full_x = offset + step * x;
      ray.x() = across[static_cast<std::size_t>(x)];
      const AbsentMixture absent = absent_mixture(input, model, full_x, full_y, ray);
      const float depth = measured_depth(input.depth(full_x, full_y), model.options());
      terms->depth(x, y) = depth;
      terms->inverse_absent(x, y) = inverse_absent(model, absent, depth);
      terms->absent_peak(x, y) = static_cast<float>(absent.peak_depth);
      terms->absent_missing(x, y) = static_cast<float>(absent.missing);
      terms->inverse_returns(x, y) = absent.missing < 0.0 ? 1.0f : 1.0f / (1.0f - static_cast<float>(absent.missing));
      terms->known(x, y) = 0.0f;
    }
  }
  sample_colors(input, step, offset, model.options().color_exponent, terms);
  return core::ok_status();
}

void with_known_surfaces(const FrameTerms& frame, const geometry::DepthImage& known_depth, FrameTerms* terms) {
  PRESCENE_CHECK(known_depth.width() == frame.camera.width && known_depth.height() == frame.camera.height);
  if (terms != &frame) *terms = frame;
  for (int y = 0; y < known_depth.height(); ++y) {
    for (int x = 0; x < known_depth.width(); ++x) {
      const float known = known_depth(x, y);
      if (!(known > 0.0f)) continue;
      float& nearest = terms->known(x, y);
      nearest = nearest > 0.0f ? std::min(nearest, known) : known;
      AbsentMixture absent;
      expect_surface(frame.model, nearest, &absent);
      terms->inverse_absent(x, y) = inverse_absent(frame.model, absent, terms->depth(x, y));
      terms->absent_peak(x, y) = static_cast<float>(absent.peak_depth);
      terms->absent_missing(x, y) = -1.0f;
    }
  }
}

void merge_nearest(const geometry::DepthImage& other, geometry::DepthImage* depth) {
  PRESCENE_CHECK(other.width() == depth->width() && other.height() == depth->height());
  for (std::size_t i = 0; i < depth->size(); ++i) {
    const float a = depth->data()[i], b = other.data()[i];
    if (b > 0.0f && (a == 0.0f || b < a)) depth->data()[i] = b;
  }
}

}  // namespace prescene::rendering
