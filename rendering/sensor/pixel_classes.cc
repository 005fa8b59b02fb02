// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/pixel_classes.h"

#include "prescene/rendering/portable_math.h"

namespace prescene::rendering {
namespace {

PixelClass class_of(const SensorModel& model, const SurfaceMaterial& material, const PixelGeometry& pixel) {
  const PixelMixture m = model.mixture(material, pixel);
  PixelClass c;
  c.hit = static_cast<float>(m.hit * kInverseSqrt2Pi);
  c.occluder = static_cast<float>(m.occluder);
  c.behind = static_cast<float>(m.behind);
  c.outlier_density = static_cast<float>(m.outlier / model.range());
  c.missing = static_cast<float>(m.missing);
  c.returned = static_cast<float>(1.0 - m.missing);
  c.returned_ratio = static_cast<float>((1.0 - m.missing) / (1.0 - m.missing_unknown));
  c.log_missing_ratio = portable_log(m.missing / m.missing_unknown);
  c.missing_ratio = static_cast<float>(portable_exp(c.log_missing_ratio));
  return c;
}

}  // namespace

PixelClasses::PixelClasses(const SensorModel& model, const SurfaceMaterial& material, int step) {
  const auto& bounds = model.options().incidence_cosine;
  for (std::size_t i = 0; i < bounds.size(); ++i) bounds_[i] = static_cast<float>(bounds[i]);
  for (std::size_t i = 0; i < kIncidences; ++i) {
    const double cosine = i < bounds.size() ? bounds[i] : 1.0;
    // A reduced pixel with an empty neighbour is half a reduced pixel from the outline, on average.
    classes_[2 * i] = class_of(model, material, {1.0, cosine});
    classes_[2 * i + 1] = class_of(model, material, {1.0, cosine, 0.5 * step});
  }
}

}  // namespace prescene::rendering
