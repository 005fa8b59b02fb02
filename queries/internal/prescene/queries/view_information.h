// SPDX-License-Identifier: Apache-2.0
// What one depth image would say of which hypothesis is true: the expected reduction of entropy, from simulated images.
//
// An image of hypothesis h under circumstances j is weighed by a model that does not know j: the mixture over all other
// circumstances. Its score is log q(h | image) - log p(h). The logarithm is a proper score, so its expectation is at
// most the mutual information of hypothesis and image, whatever the model: a lower bound, which is near if there are
// many circumstances.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
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
/// equally likely, drawn independently of each other, and the same for all hypotheses. A single one is known for
/// certain, so that no image is weighed without it.
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
  /// nats; all 0 if the hypotheses look alike. The interval is that of the expected score, and so of a lower bound.
  double reduction = 0.0, low = 0.0, high = 0.0;
  int different_pixels = 0;  ///< At which hypotheses differ under the same circumstances.
  /// Scores: of each of the circumstances, averaged over hypotheses; of each image if there are no others. None is
  /// below log kDistrust.
  std::vector<double> values;
  std::vector<double> weights;  ///< Of `values`; sum 1.
};

/// That a model of so few circumstances is wrong altogether: so much of the prior is mixed into its posterior. It
/// bounds what one misleading image counts, and costs less than this in nats.
inline constexpr double kDistrust = 1e-3;

/// An image is simulated of each hypothesis under each of the circumstances. `error`: probability that the interval
/// misses what it is about. nullopt if it was cancelled; `cancellation` may be null. Takes memory for the logarithms of
/// images.size() squared likelihoods, whatever the size of images.
std::optional<ViewInformation> information_of(const LookedAt& seen, const rendering::SensorModel& model,
                                              const core::RandomStream& stream, double error, core::ThreadPool& pool,
                                              const core::Cancellation* cancellation = nullptr);

/// Of some numbers that sum to 1, nats.
double entropy_of(std::span<const double> probabilities);

/// Mean of weighted values, and half width of its interval: standard errors, and, for what so few values did not show,
/// range * log(2 / error) / n, as in empirical Bernstein bounds. `weights` sum to 1; `range` is that of the values.
struct MeanInterval {
  double mean = 0.0, half_width = 0.0;
};
MeanInterval mean_interval(std::span<const double> values, std::span<const double> weights, double error, double range);

}  // namespace prescene::queries
