// SPDX-License-Identifier: Apache-2.0
// What one depth image would say of which hypothesis is true: the expected reduction of entropy, from simulated images.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::queries {

/// What a pixel shows if a hypothesis is true.
struct ExpectedSurface {
  enum class Kind : std::uint8_t { kNothing, kSurroundings, kObject };
  Kind kind = Kind::kNothing;
  bool outline = false;     ///< Beside something else.
  std::uint16_t thing = 0;  ///< Of an object: index of its material.
  float depth = 0.0F;       ///< z in C, m.
  float cosine = 1.0F;      ///< |n . ray|
};
using ExpectedImage = geometry::Image<ExpectedSurface>;

/// What is looked at: `images[h * circumstances + j]` is that of hypothesis h under circumstances j, which are all
/// equally likely and are the same for all hypotheses.
struct LookedAt {
  std::span<const double> probabilities;  ///< Of the hypotheses; sum 1.
  int circumstances = 1;
  std::span<const ExpectedImage> images;
  std::span<const rendering::SurfaceMaterial> materials;
  const ExpectedImage* surroundings = nullptr;  ///< Without any object: what is seen through glass.
  double tempering = 1.0;  ///< Log likelihoods of whole images are multiplied by it, as the filter's are.
  int step = 1;            ///< Full-image pixels between two of the images.
};

struct ViewInformation {
  double reduction = 0.0, low = 0.0, high = 0.0;  ///< nats; all 0 if the hypotheses look alike.
  int different_pixels = 0;
  std::vector<double> by_image;  ///< The reduction by each simulated image, in the order of LookedAt::images, ...
  std::vector<double> weights;   ///< ... and its weight.
};

/// An image is simulated of each hypothesis under each of the circumstances. `deviations`: half width of the interval,
/// in standard errors.
ViewInformation information_of(const LookedAt& seen, const rendering::SensorModel& model,
                               const core::RandomStream& stream, double deviations, core::ThreadPool& pool);

/// Of some numbers that sum to 1, nats.
double entropy_of(std::span<const double> probabilities);

/// Mean and half width (`deviations` standard errors) of weighted values; weights sum to 1.
struct MeanInterval {
  double mean = 0.0, half_width = 0.0;
};
MeanInterval mean_interval(std::span<const double> values, std::span<const double> weights, double deviations);

}  // namespace prescene::queries
