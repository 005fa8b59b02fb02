// SPDX-License-Identifier: Apache-2.0
// The information in images of one pixel, against the mutual information by quadrature.
#include "prescene/queries/view_information.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace prescene::queries::view_information_reference_test {
namespace {

using rendering::AbsentMixture;
using rendering::SensorModel;
using Kind = ExpectedSurface::Kind;

// Intervals miss what they are about by chance once in 10 000 times; seeds are fixed.
constexpr double kError = 1e-4;
constexpr float kDepth = 0.9F, kBackground = 1.4F;
constexpr int kMany = 1000;

const std::vector<rendering::SurfaceMaterial> kMaterials(1);

ExpectedSurface object_at(float depth) { return {.kind = Kind::kObject, .thing = 0, .depth = depth}; }

ExpectedImage image_of(const ExpectedSurface& surface) { return ExpectedImage(1, 1, surface); }

/// The pixel's distribution: probability of no return, and density of what is returned.
struct Distribution {
  double missing = 0.0;
  std::function<double(double)> density;  // 1/m
};

Distribution of_object(const SensorModel& model, double depth, bool has_background) {
  AbsentMixture behind;
  behind.missing = model.options().background_missing;
  if (has_background) {
    behind.peak_depth = kBackground;
    behind.peak_sigma = std::hypot(model.hit_sigma(kBackground, 1.0), model.options().support_sigma);
    behind.peak_weight = model.options().background_weight;
  }
  const rendering::PixelMixture mixture = model.mixture(kMaterials[0], {depth, 1.0});
  return {mixture.missing,
          [&model, mixture, behind](double z) { return std::exp(model.log_density(mixture, z, behind)); }};
}

/// Midpoint rule, with steps of a hundredth of a hit's deviation.
double integral(const std::function<double(double)>& f) {
  constexpr double kStep = 3e-5, kFrom = 0.28, kTo = 2.52;
  double sum = 0.0;
  for (double z = kFrom + 0.5 * kStep; z < kTo; z += kStep) sum += f(z) * kStep;
  return sum;
}

double plogq(double p, double q) { return p > 0.0 ? p * std::log(q) : 0.0; }

/// The expected logarithm of posterior over prior of the truth, with likelihoods to the power of `tempering`; with 1,
/// the mutual information.
double expected_score(const std::vector<double>& priors, const std::vector<Distribution>& of, double tempering = 1.0) {
  const auto score = [&](const std::vector<double>& likelihoods) {
    double evidence = 0.0, result = 0.0;
    for (std::size_t h = 0; h < of.size(); ++h) evidence += priors[h] * std::pow(likelihoods[h], tempering);
    for (std::size_t h = 0; h < of.size(); ++h)
      result += plogq(priors[h] * likelihoods[h], std::pow(likelihoods[h], tempering) / evidence);
    return result;
  };
  std::vector<double> likelihoods(of.size());
  for (std::size_t h = 0; h < of.size(); ++h) likelihoods[h] = of[h].missing;
  double result = score(likelihoods);
  result += integral([&](double z) {
    for (std::size_t h = 0; h < of.size(); ++h) likelihoods[h] = (1.0 - of[h].missing) * of[h].density(z);
    return score(likelihoods);
  });
  return result;
}

Distribution mixture_of(std::vector<Distribution> parts) {
  const double missing = parts.front().missing;
  return {missing, [parts = std::move(parts)](double z) {
            double sum = 0.0;
            for (const Distribution& part : parts) sum += part.density(z);
            return sum / static_cast<double>(parts.size());
          }};
}

/// `surface(h, j)`: of hypothesis h under circumstances j.
ViewInformation estimate(const std::vector<double>& priors, int circumstances, bool has_background,
                         const std::function<ExpectedSurface(int h, int j)>& surface, double tempering = 1.0,
                         std::uint64_t seed = 5) {
  core::ThreadPool pool(2);
  std::vector<ExpectedImage> images;
  for (int h = 0; h < static_cast<int>(priors.size()); ++h)
    for (int j = 0; j < circumstances; ++j) images.push_back(image_of(surface(h, j)));
  ExpectedSurface behind;
  if (has_background) behind = {.kind = Kind::kSurroundings, .depth = kBackground};
  const ExpectedImage surroundings = image_of(behind);
  const auto information =
      information_of({priors, circumstances, images, kMaterials, &surroundings, tempering, 1}, SensorModel(),
                     core::RandomStream(seed, core::Purpose::kSensorNoise), kError, pool);
  EXPECT_TRUE(information.has_value());
  return information.value_or(ViewInformation{});
}

void expect_within(const ViewInformation& information, double truth, double widest) {
  EXPECT_LE(information.low, truth);
  EXPECT_GE(information.high, truth);
  EXPECT_LT(information.high - information.low, widest);
}

TEST(ViewInformation, OfOnePixelIsTheMutualInformation) {
  const SensorModel model;
  const std::vector<double> priors{0.4, 0.6};
  const float other = kDepth + 0.006F;
  const double truth = expected_score(priors, {of_object(model, kDepth, true), of_object(model, other, true)});
  ASSERT_GT(truth, 0.1);
  ASSERT_LT(truth, 0.5);
  // All circumstances are alike, so that those that are left are the whole truth.
  expect_within(estimate(priors, kMany, true, [&](int h, int) { return object_at(h == 0 ? kDepth : other); }), truth,
                0.15);
}

TEST(ViewInformation, CircumstancesThatAreNotKnownAreAveragedOver) {
  const SensorModel model;
  const std::vector<double> priors{0.5, 0.5};
  // Two hypotheses 6 mm apart, and circumstances that add nothing or 9 mm.
  const auto depth = [](int h, int j) {
    return kDepth + 0.006F * static_cast<float>(h) + 0.009F * static_cast<float>(j % 2);
  };
  std::vector<Distribution> of;
  for (int h = 0; h < 2; ++h)
    of.push_back(mixture_of({of_object(model, depth(h, 0), true), of_object(model, depth(h, 1), true)}));
  const double truth = expected_score(priors, of);
  const double known =
      expected_score(priors, {of_object(model, depth(0, 0), true), of_object(model, depth(1, 0), true)});
  ASSERT_LT(truth, 0.9 * known);
  expect_within(estimate(priors, kMany, true, [&](int h, int j) { return object_at(depth(h, j)); }), truth, 0.15);
}

// Were an image weighed with the circumstances that it was drawn under, the fewer there are, the more it would tell.
TEST(ViewInformation, FewCircumstancesDoNotExaggerate) {
  constexpr int kSets = 40, kCircumstances = 32, kQuantiles = 100;
  constexpr double kSpread = 0.01;
  const SensorModel model;
  const std::vector<double> priors{0.5, 0.5};
  std::vector<Distribution> of;
  for (int h = 0; h < 2; ++h) {
    std::vector<Distribution> parts;
    for (int i = 0; i < kQuantiles; ++i)
      parts.push_back(
          of_object(model, kDepth + 0.008 * h + kSpread * core::inverse_normal_cdf((i + 0.5) / kQuantiles), true));
    of.push_back(mixture_of(std::move(parts)));
  }
  const double truth = expected_score(priors, of);
  ASSERT_GT(truth, 0.01);
  ASSERT_LT(truth, 0.3);
  double sum = 0.0, squares = 0.0;
  for (int set = 0; set < kSets; ++set) {
    core::RandomStream offsets(static_cast<std::uint64_t>(set), core::Purpose::kScenario);
    std::vector<double> off;
    for (int j = 0; j < kCircumstances; ++j) off.push_back(offsets.normal(0.0, kSpread));
    const ViewInformation information = estimate(
        priors, kCircumstances, true,
        [&](int h, int j) {
          return object_at(kDepth + static_cast<float>(0.008 * h + off[static_cast<std::size_t>(j)]));
        },
        1.0, static_cast<std::uint64_t>(set));
    EXPECT_LE(information.low, truth) << set;
    double score = 0.0;
    for (const double value : information.values) score += value / kCircumstances;
    sum += score;
    squares += score * score;
  }
  const double mean = sum / kSets;
  const double deviation = std::sqrt((squares / kSets - mean * mean) / (kSets - 1));
  EXPECT_LT(mean, truth + 4.0 * deviation);
}

// A return tells that it is there. No return is no evidence, as empty space returns nothing either.
TEST(ViewInformation, BeforeEmptySpaceOnlyReturnsTell) {
  const SensorModel model;
  const double there = 0.3;
  const Distribution object = of_object(model, kDepth, false);
  const double told = integral([&](double z) {
    const double density = object.density(z);
    return plogq(density, density / (there * density + (1.0 - there) / model.range()));
  });
  const double truth = there * (1.0 - object.missing) * told;
  ASSERT_GT(truth, 0.1);
  expect_within(estimate({there, 1.0 - there}, kMany, false,
                         [](int h, int) { return h == 0 ? object_at(kDepth) : ExpectedSurface{}; }),
                truth, 0.15);
}

TEST(ViewInformation, TemperedLikelihoodsTellLess) {
  const SensorModel model;
  const std::vector<double> priors{0.5, 0.5};
  const float other = kDepth + 0.008F;
  const std::vector<Distribution> of{of_object(model, kDepth, true), of_object(model, other, true)};
  const double tempered = expected_score(priors, of, 0.25);
  ASSERT_LT(tempered, expected_score(priors, of) - 0.05);
  expect_within(estimate(
                    priors, kMany, true, [&](int h, int) { return object_at(h == 0 ? kDepth : other); }, 0.25),
                tempered, 0.15);
}

TEST(ViewInformation, EqualValuesStillLeaveAnInterval) {
  const std::vector<double> values(16, 0.5), weights(16, 1.0 / 16.0);
  const MeanInterval mean = mean_interval(values, weights, 0.05, 0.5);
  EXPECT_NEAR(mean.mean, 0.5, 1e-12);
  // A value of 0 that 17 % have is missed by 16 draws in 5 % of cases: the true mean is then 0.085 lower.
  EXPECT_GT(mean.half_width, 0.5 * (1.0 - std::pow(0.05, 1.0 / 16.0)));
}

TEST(ViewInformation, EndsOnRequest) {
  core::ThreadPool pool(1);
  core::Cancellation cancellation;
  cancellation.request();
  const std::vector<double> priors{0.5, 0.5};
  const std::vector<ExpectedImage> images{image_of(object_at(kDepth)), image_of(object_at(1.0F))};
  const ExpectedImage surroundings = image_of({});
  EXPECT_FALSE(information_of({priors, 1, images, kMaterials, &surroundings, 1.0, 1}, SensorModel(),
                              core::RandomStream(1, core::Purpose::kSensorNoise), 0.05, pool, &cancellation)
                   .has_value());
}

}  // namespace
}  // namespace prescene::queries::view_information_reference_test
