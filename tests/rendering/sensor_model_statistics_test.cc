// SPDX-License-Identifier: Apache-2.0
// The sensor model's two faces, density and samples, against each other. Thresholds state their false-alarm rate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::rendering::sensor_model_statistics_test {
namespace {

using core::Purpose;
using core::RandomStream;

/// Integral of exp(log f) over [low, high] by the midpoint rule, split at `cuts`, where f jumps.
double integral(const std::function<double(double)>& log_f, double low, double high, std::vector<double> cuts) {
  cuts.push_back(low);
  cuts.push_back(high);
  std::sort(cuts.begin(), cuts.end());
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    if (cuts[i] < low || cuts[i + 1] > high) continue;
    constexpr int kSteps = 40000;
    const double step = (cuts[i + 1] - cuts[i]) / kSteps;
    for (int k = 0; k < kSteps; ++k) sum += step * std::exp(log_f(cuts[i] + (k + 0.5) * step));
  }
  return sum;
}

const SurfaceMaterial kMaterials[] = {SurfaceMaterial::opaque(), SurfaceMaterial::transparent(),
                                      SurfaceMaterial::mirror()};
const PixelGeometry kPixels[] = {{0.8, 1.0}, {1.3, 0.45}, {0.6, 0.15, 2.0}, {2.0, 0.9, 5.0}};
const AbsentMixture kBackgrounds[] = {{}, {1.6, 0.004, 0.6, 0.03}};

TEST(SensorModel, DensitiesIntegrateToOne) {
  const SensorModel model;
  for (const AbsentMixture& absent : kBackgrounds) {
    EXPECT_NEAR(integral([&](double z) { return model.log_density(absent, z); }, 0.1, 3.0, {0.3, 2.5, 1.5, 1.7}), 1.0,
                1e-5);
    for (const SurfaceMaterial& material : kMaterials) {
      for (const PixelGeometry& pixel : kPixels) {
        const PixelMixture m = model.mixture(material, pixel);
        EXPECT_NEAR(m.hit + m.occluder + m.behind + m.outlier, 1.0, 1e-12);
        const double reach = 8 * m.sigma;
        EXPECT_NEAR(integral([&](double z) { return model.log_density(m, z, absent); }, 0.1, 3.0,
                             {0.3, 2.5, pixel.depth, pixel.depth - reach, pixel.depth + reach, 1.5, 1.7}),
                    1.0, 1e-4);
      }
    }
  }
}

TEST(SensorModel, SamplesFollowTheDensity) {
  const SensorModel model;
  constexpr int kSamples = 20000;
  std::uint32_t number = 0;
  for (const AbsentMixture& absent : kBackgrounds) {
    for (const SurfaceMaterial& material : kMaterials) {
      for (const PixelGeometry& pixel : kPixels) {
        const PixelMixture m = model.mixture(material, pixel);
        RandomStream stream(21, Purpose::kTest, 0, number++);
        std::vector<double> depths;
        for (int i = 0; i < kSamples; ++i) {
          const double z = model.sample(m, absent, stream);
          if (z > 0.0) depths.push_back(z);
        }
        const double missing = 1.0 - static_cast<double>(depths.size()) / kSamples;
        // Five standard deviations of a share: one false alarm in 1.7 million.
        EXPECT_NEAR(missing, m.missing, 5.0 * std::sqrt(m.missing * (1.0 - m.missing) / kSamples));
        // Kolmogorov-Smirnov: sqrt(n) D > 2.7 happens once in 1.1 million times. The distribution function by adding
        // up the density on a grid that is fine where it is steep.
        std::sort(depths.begin(), depths.end());
        const auto n = static_cast<double>(depths.size());
        double distance = 0.0;
        double cumulated = 0.0;
        std::size_t below = 0;
        for (double z = 0.2; z < 2.7;) {
          const bool steep = std::abs(z - pixel.depth) < 8 * m.sigma || std::abs(z - absent.peak_depth) < 0.04;
          const double step = steep ? 1e-5 : 1e-4;
          cumulated += step * std::exp(model.log_density(m, z + 0.5 * step, absent));
          z += step;
          while (below < depths.size() && depths[below] <= z) ++below;
          distance = std::max(distance, std::abs(static_cast<double>(below) / n - cumulated));
        }
        EXPECT_LT(std::sqrt(n) * distance, 2.7) << pixel.depth << " " << material.hit << " " << absent.peak_weight;
      }
    }
  }
}

TEST(SensorModel, RatioAveragesToOneWhenTheObjectIsAbsent) {
  // E[p(z | object) / p(z | absent)] under p(z | absent) = 1 for any two densities, missing returns included: exactly
  // by integration, since single samples of the ratio are too uneven for an average.
  const SensorModel model;
  for (const SurfaceMaterial& material : kMaterials) {
    for (const PixelGeometry& pixel : kPixels) {
      const AbsentMixture absent = kBackgrounds[1];
      const PixelMixture m = model.mixture(material, pixel);
      const double reach = 8 * m.sigma;
      const double returned = integral(
          [&](double z) {
            return std::log(1.0 - absent.missing) + model.log_density(absent, z) + model.log_ratio(m, z, absent);
          },
          0.3, 2.5, {pixel.depth, pixel.depth - reach, std::min(2.49, pixel.depth + reach), 1.5, 1.7});
      const double missing = absent.missing * std::exp(model.log_ratio(m, 0.0, absent));
      EXPECT_NEAR(returned + missing, 1.0, 1e-4);
    }
  }
}

TEST(SensorModel, ExpectationMaximisationFindsTheWeightsInSamples) {
  const SensorModel model;
  const PixelMixture truth = model.mixture(SurfaceMaterial::opaque(), {1.0, 0.9});
  RandomStream stream(22, Purpose::kTest);
  std::vector<double> depths;
  while (depths.size() < 100000) {
    const double z = model.sample(truth, {}, stream);
    if (z > 0.0) depths.push_back(z);
  }
  double hit = 0.5, occluder = 0.25, outlier = 0.25, sigma = 0.01;
  for (int i = 0; i < 200; ++i) {
    double sum_hit = 0.0, sum_occluder = 0.0, squares = 0.0;
    for (const double z : depths) {
      const double t = (z - truth.depth) / sigma;
      const double p_hit = hit / (sigma * std::sqrt(2.0 * M_PI)) * std::exp(-0.5 * t * t);
      const double p_occluder = z < truth.depth ? occluder / (truth.depth - 0.3) : 0.0;
      const double p = p_hit + p_occluder + outlier / 2.2;
      sum_hit += p_hit / p;
      sum_occluder += p_occluder / p;
      squares += p_hit / p * (z - truth.depth) * (z - truth.depth);
    }
    const auto n = static_cast<double>(depths.size());
    hit = sum_hit / n;
    occluder = sum_occluder / n;
    outlier = 1.0 - hit - occluder;
    sigma = std::sqrt(squares / sum_hit);
  }
  // Several standard errors each: the hit's share is known to 0.001, those of occluder and outlier to 0.0015.
  EXPECT_NEAR(hit, truth.hit, 0.005);
  EXPECT_NEAR(occluder, truth.occluder, 0.008);
  EXPECT_NEAR(outlier, truth.outlier, 0.008);
  EXPECT_NEAR(sigma, truth.sigma, 0.01 * truth.sigma);
}

TEST(SensorModel, PosteriorsMadeFromTheRatioAreCalibrated) {
  // Depths drawn from a uniform prior, four returns each, the posterior over a grid by the ratio: the truth's place in
  // its posterior is uniform [Talts et al. 2018].
  const SensorModel model;
  const SurfaceMaterial material = SurfaceMaterial::opaque();
  const AbsentMixture absent = {1.0, 0.004, 0.6, -1.0};
  constexpr int kRuns = 2000;
  constexpr int kGrid = 400;
  constexpr int kBins = 10;
  std::vector<int> ranks(kBins, 0);
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    RandomStream stream(23, Purpose::kTest, 0, run);
    const double truth = stream.uniform(0.95, 1.03);
    std::vector<double> returns;
    for (int i = 0; i < 4; ++i) returns.push_back(model.sample(model.mixture(material, {truth, 0.8}), absent, stream));
    double below = 0.0;
    double total = 0.0;
    for (int k = 0; k < kGrid; ++k) {
      const double depth = 0.95 + 0.08 * (k + 0.5) / kGrid;
      const PixelMixture m = model.mixture(material, {depth, 0.8});
      double log_posterior = 0.0;
      for (const double z : returns) log_posterior += model.log_ratio(m, z, absent);
      const double mass = std::exp(log_posterior);
      total += mass;
      if (depth < truth) below += mass;
    }
    ++ranks[static_cast<std::size_t>(std::min<double>(kBins - 1, std::floor(kBins * below / total)))];
  }
  double chi_squared = 0.0;
  const double expected = static_cast<double>(kRuns) / kBins;
  for (const int count : ranks) chi_squared += (count - expected) * (count - expected) / expected;
  // Nine degrees of freedom: above 44 once in 700 000 times.
  EXPECT_LT(chi_squared, 44.0);
}

TEST(SensorModel, ReproducesTheMeasuredShares) {
  // Missing returns by the distance to the outline (seen frontally) and by incidence (inside), as measured on real
  // frames.
  const SensorModel model;
  const SurfaceMaterial opaque;
  for (const auto& [px, missing] : {std::pair{1.0, 0.38}, {2.5, 0.35}, {5.0, 0.27}, {10.0, 0.12}, {50.0, 0.03}})
    EXPECT_NEAR(model.mixture(opaque, {0.9, 0.9, px}).missing, missing, 1e-9);
  for (const auto& [cosine, missing] : {std::pair{0.1, 0.47}, {0.3, 0.28}, {0.5, 0.10}, {0.9, 0.03}})
    EXPECT_NEAR(model.mixture(opaque, {0.9, cosine}).missing, missing, 1e-9);
  // Standard deviations at 0.9 m: 31, 5.7, 4.0, 2.2 mm measured; the steepest class is held lower, so that it still
  // says something, and the frontal one higher, for calibration and pose errors.
  EXPECT_NEAR(model.hit_sigma(0.9, 0.1), 0.0123, 0.001);
  EXPECT_NEAR(model.hit_sigma(0.9, 0.3), 0.0057, 0.0010);
  EXPECT_NEAR(model.hit_sigma(0.9, 0.5), 0.0040, 0.0005);
  EXPECT_NEAR(model.hit_sigma(0.9, 0.8), 0.0031, 0.0001);
}

TEST(SensorModel, ColourSpeaksOnlyForHits) {
  const SensorModel model;
  const PixelMixture m = model.mixture(SurfaceMaterial::opaque(), {1.0, 0.9});
  const AbsentMixture absent;
  EXPECT_NEAR(model.log_ratio(m, 1.0, absent, 20.0) - model.log_ratio(m, 1.0, absent, 1.0), std::log(20.0), 0.01);
  EXPECT_EQ(model.log_ratio(m, 0.7, absent, 20.0), model.log_ratio(m, 0.7, absent, 0.05));
  EXPECT_EQ(model.log_ratio(m, 0.0, absent, 20.0), model.log_ratio(m, 0.0, absent, 0.05));
}

TEST(SensorModel, MissingReturnsSpeakForTransparentThingsWhereTheBackgroundIsKnown) {
  const SensorModel model;
  const PixelGeometry pixel = {0.8, 0.9};
  const PixelMixture glass = model.mixture(SurfaceMaterial::transparent(), pixel);
  const PixelMixture wood = model.mixture(SurfaceMaterial::opaque(), pixel);
  const AbsentMixture unknown;
  EXPECT_EQ(model.log_ratio(wood, 0.0, unknown), 0.0);
  EXPECT_EQ(model.log_ratio(glass, 0.0, unknown), 0.0) << "the view may be open there";
  // The background seen through it is no evidence against glass, but it is against wood.
  const AbsentMixture table = {1.2, 0.004, 0.6, 0.03};
  EXPECT_NEAR(model.log_ratio(glass, 0.0, table), std::log(10.0), 1e-9);
  EXPECT_GT(model.log_ratio(glass, 1.2, table), -1.0);
  EXPECT_LT(model.log_ratio(wood, 1.2, table), -5.0);
}

TEST(SensorModel, SigmaGrowsWithDepthSquaredAndIncidence) {
  const SensorModel model;
  EXPECT_NEAR(model.hit_sigma(1.0, 1.0), 0.0038, 1e-12);
  EXPECT_NEAR(model.hit_sigma(2.0, 1.0) / model.hit_sigma(1.0, 1.0), 4.0, 1e-12);
  double last = 0.0;
  for (double cosine = 1.0; cosine > 0.0; cosine -= 0.01) {
    EXPECT_GE(model.hit_sigma(1.0, cosine), last);
    last = model.hit_sigma(1.0, cosine);
  }
  EXPECT_NEAR(model.hit_sigma(1.0, 0.0), 4 * 0.0038, 1e-12);
}

TEST(SensorModel, TemperingWeighsNoMoreThanItsEffectivePixels) {
  EXPECT_EQ(tempering({0.0, 0.0}, 500.0, 8), 1.0);
  EXPECT_EQ(tempering({0.0, 20.0}, 0.0, 8), 1.0);
  EXPECT_NEAR(tempering({0.0, 20.0}, 180.0, 8), 0.1, 1e-15);
  // One pixel in 64 of an area of 192 that shares its error: a quarter of each counts.
  EXPECT_NEAR(tempering({192.0, 0.0}, 10.0, 8), 0.25, 1e-15);
  // However finely a surface is sampled, it is worth no more than its area, and no more than the errors of all.
  const Tempering both = {75.0, 500.0};
  double last = 0.0;
  for (const int step : {16, 8, 4, 2, 1}) {
    const double pixels = 40000.0 / (step * step);
    const double worth = pixels * tempering(both, pixels, step);
    EXPECT_GT(worth, last);
    EXPECT_LT(worth, 40000.0 / 75.0);
    EXPECT_LT(worth, 500.0);
    last = worth;
  }
}

TEST(SensorModelOptions, AreRefusedByTheNameOfTheField) {
  EXPECT_TRUE(validate(SensorModelOptions{}).ok());
  SensorModelOptions options;
  options.sigma_per_depth_squared = -1.0;
  EXPECT_NE(validate(options).message().find("sigma_per_depth_squared"), std::string::npos);
  options = {};
  options.max_depth = 0.2;
  EXPECT_NE(validate(options).message().find("max_depth"), std::string::npos);
  options = {};
  options.support_weight = 1.0;
  EXPECT_NE(validate(options).message().find("support_weight"), std::string::npos);
  options = {};
  options.outline_px = {3.0, 1.5, 6.0, 12.0};
  EXPECT_NE(validate(options).message().find("outline_px"), std::string::npos);
  options = {};
  options.incidence_missing[1] = std::nan("");
  EXPECT_NE(validate(options).message().find("incidence_missing"), std::string::npos);
}

}  // namespace
}  // namespace prescene::rendering::sensor_model_statistics_test
