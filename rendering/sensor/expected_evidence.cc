// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

struct Expectation {
  double log_ratio = 0.0;
  double visible = 0.0;  ///< Number of visible pixels.
  double visible_log_ratio = 0.0;
  double visible_square = 0.0;  ///< Of the squared log ratio of visible pixels.
};

/// One pixel of an object that is there.
class PixelExpectation {
 public:
  PixelExpectation(const SensorModel& model, const PixelMixture& mixture, const AbsentMixture& absent)
      : model_(model), mixture_(mixture), absent_(absent) {}

  Expectation value() {
    const double min_depth = model_.options().min_depth;
    sum_.log_ratio += mixture_.missing * model_.log_ratio(mixture_, 0.0, absent_);
    add_normal(mixture_.hit, mixture_.depth, mixture_.sigma);
    add_uniform(mixture_.occluder, min_depth, mixture_.depth);
    add_uniform(mixture_.outlier, min_depth, model_.options().max_depth);
    add_normal(mixture_.behind * absent_.peak_weight, absent_.peak_depth, absent_.peak_sigma);
    add_uniform(mixture_.behind * (1.0 - absent_.peak_weight), min_depth, model_.options().max_depth);
    return sum_;
  }

 private:
  /// Gauss-Hermite.
  void add_normal(double weight, double mean, double sigma) {
    if (!(weight > 0.0)) return;
    add(weight * 2.0 / 3.0, mean);
    for (const double side : {-1.0, 1.0}) add(weight / 6.0, mean + side * std::sqrt(3.0) * sigma);
  }

  void add_uniform(double weight, double low, double high) {
    if (!(weight > 0.0 && high > low)) return;
    for (const double share : {1.0 / 6.0, 0.5, 5.0 / 6.0}) add(weight / 3.0, low + share * (high - low));
  }

  void add(double weight, double depth) {
    const double p = weight * (1.0 - mixture_.missing);
    const double z = std::clamp(depth, model_.options().min_depth, model_.options().max_depth);
    const double log_ratio = model_.log_ratio(mixture_, z, absent_);
    sum_.log_ratio += p * log_ratio;
    if (z < mixture_.depth - static_cast<double>(kMatchSigmas) * mixture_.sigma) return;
    sum_.visible += p;
    sum_.visible_log_ratio += p * log_ratio;
    sum_.visible_square += p * log_ratio * log_ratio;
  }

  const SensorModel& model_;
  const PixelMixture& mixture_;
  const AbsentMixture& absent_;
  Expectation sum_;
};

}  // namespace

ExpectedEvidence expected_evidence(const FrameTerms& frame, const SurfaceMaterial& material,
                                   const geometry::DepthImage& depth, const geometry::Image<Vector3f>& normals) {
  const int width = frame.camera.width, height = frame.camera.height;
  PRESCENE_CHECK(depth.width() == width && depth.height() == height);
  PRESCENE_CHECK(normals.width() == width && normals.height() == height);
  const SensorModelOptions& options = frame.model.options();
  const auto covered = [&](int x, int y) { return x >= 0 && y >= 0 && x < width && y < height && depth(x, y) > 0.0F; };
  Expectation sum;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double d = depth(x, y);
      if (!(d > options.min_depth && d < options.max_depth)) continue;
      const float known = frame.known.empty() ? 0.0F : frame.known(x, y);
      if (known > 0.0F && known < depth(x, y)) continue;
      const bool outline = !covered(x - 1, y) || !covered(x + 1, y) || !covered(x, y - 1) || !covered(x, y + 1);
      PixelGeometry pixel;
      pixel.depth = d;
      pixel.cosine = std::abs(normals(x, y).cast<double>().dot(frame.camera.unproject(x, y, 1.0).normalized()));
      if (outline) pixel.outline_px = 0.5 * frame.step;  // on average, as PixelClasses has it
      AbsentMixture absent;
      absent.missing = frame.absent_missing(x, y);
      if (frame.absent_peak(x, y) > 0.0F) {
        absent.peak_depth = frame.absent_peak(x, y);
        absent.peak_sigma = std::hypot(frame.model.hit_sigma(absent.peak_depth, 1.0), options.support_sigma);
        absent.peak_weight = options.background_weight;
      }
      const PixelMixture mixture = frame.model.mixture(material, pixel);
      const Expectation mine = PixelExpectation(frame.model, mixture, absent).value();
      sum.log_ratio += mine.log_ratio;
      sum.visible += mine.visible;
      sum.visible_log_ratio += mine.visible_log_ratio;
      sum.visible_square += mine.visible_square;
    }
  ExpectedEvidence expected;
  if (!(sum.visible > 0.0)) return expected;
  expected.of_all = sum.log_ratio / sum.visible;
  expected.of_visible = sum.visible_log_ratio / sum.visible;
  // Of a ratio of two sums, to first order; that the pixels' means differ is counted as noise, too.
  const double variance = sum.visible_square / sum.visible - expected.of_visible * expected.of_visible;
  const double sharing = 1.0 + frame.tempering.weight.correlated_px2 / (static_cast<double>(frame.step) * frame.step);
  expected.deviation = std::sqrt(std::max(0.0, variance) * sharing / sum.visible);
  return expected;
}

}  // namespace prescene::rendering
