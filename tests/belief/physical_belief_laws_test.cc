// SPDX-License-Identifier: Apache-2.0
// Beliefs of physical parameters: nothing learned is the priors, evidence is Bayes' rule on the draws, and few draws
// are replaced by more that say the same.
#include "prescene/belief/physical_belief.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"

namespace prescene::belief::physical_belief_test {
namespace {

using core::Purpose;
using core::RandomStream;

ObjectModel uncertain_model() {
  ObjectModel model;
  model.contact.friction = UniformScalar{0.1, 0.9};
  model.mass = NormalScalar{0.5, 0.1, 0.1, 1.0};
  model.contact.restitution = FixedScalar{0.2};
  model.center_of_mass.z = NormalScalar{0.01, 0.004};
  return model;
}

std::vector<PhysicalParameters> drawn(const ObjectModel& model, const PhysicalBelief& physics, int count) {
  const PhysicalSampler sampler(model, physics);
  const core::SobolNet net(sampler.dimensions(), 5);
  std::vector<double> u(static_cast<std::size_t>(sampler.dimensions()));
  std::vector<PhysicalParameters> values;
  for (int i = 0; i < count; ++i) {
    net.point(static_cast<std::uint64_t>(i), u);
    values.push_back(sampler.draw(u));
  }
  return values;
}

double share_below(const std::vector<PhysicalParameters>& values, double friction) {
  return static_cast<double>(
             std::ranges::count_if(values, [&](const PhysicalParameters& v) { return v.friction < friction; })) /
         static_cast<double>(values.size());
}

/// Slides on a slope where its friction is below 0.364: the likelihood of lying still.
std::vector<double> likelihood_of_rest(const std::vector<PhysicalDraw>& draws, const ObjectModel& model) {
  std::vector<double> logs;
  for (const PhysicalDraw& draw : draws)
    logs.push_back(physical_at(model, draw.uniforms).friction < 0.364 ? -std::numeric_limits<double>::infinity() : 0.0);
  return logs;
}

TEST(PhysicalBelief, OfNothingLearnedIsThePriors) {
  const ObjectModel model = uncertain_model();
  EXPECT_EQ(physical_dimensions(model), 3);
  const std::vector<PhysicalParameters> values = drawn(model, {}, 4096);
  for (const double f : {0.2, 0.364, 0.6, 0.85}) EXPECT_NEAR(share_below(values, f), (f - 0.1) / 0.8, 0.001) << f;
  for (const PhysicalParameters& value : values) {
    EXPECT_EQ(value.restitution, 0.2);
    EXPECT_EQ(value.impact_friction, value.friction);  // the model gives it none of its own
  }
  EXPECT_NEAR(PhysicalSampler(model, {}).mean().friction, 0.5, 1e-12);
}

TEST(PhysicalBelief, EvidenceThatSaysNothingLeavesEveryMarginalAsItWas) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    const ObjectModel model = uncertain_model();
    PhysicalBelief physics;
    for (int lesson = 0; lesson < 3; ++lesson) {
      const std::vector<double> nothing(draws_of(model, physics, seed).size(), -3.25);
      physics = after_evidence(model, physics, seed, nothing, 7);
    }
    RC_ASSERT(physics.lessons == 3);
    const std::vector<PhysicalParameters> values = drawn(model, physics, 4096);
    for (const double f : {0.15, 0.364, 0.6, 0.85})
      RC_ASSERT(std::abs(share_below(values, f) - (f - 0.1) / 0.8) < 0.004);
  }));
}

TEST(PhysicalBelief, EvidenceIsBayesRule) {
  const ObjectModel model = uncertain_model();
  const std::vector<PhysicalDraw> draws = draws_of(model, {}, 3);
  const PhysicalBelief physics = after_evidence(model, {}, 3, likelihood_of_rest(draws, model), 42);
  EXPECT_EQ(physics.lessons, 1);
  EXPECT_EQ(physics.learned_ns, 42);
  const std::vector<PhysicalParameters> values = drawn(model, physics, 4096);
  // Draws have a width: what is known to a 128th of the prior is known no better.
  EXPECT_EQ(share_below(values, 0.364 - 0.8 / 128.0), 0.0);
  for (const double f : {0.45, 0.6, 0.85}) EXPECT_NEAR(share_below(values, f), (f - 0.364) / (0.9 - 0.364), 0.02) << f;
  // What it says nothing about stays.
  double mass = 0.0;
  for (const PhysicalParameters& value : values) mass += value.mass / static_cast<double>(values.size());
  EXPECT_NEAR(mass, 0.5, 0.01);
}

TEST(PhysicalBelief, MuchEvidenceKeepsAsManyDraws) {
  const ObjectModel model = uncertain_model();
  PhysicalBelief physics;
  for (int lesson = 0; lesson < 6; ++lesson) {  // a friction of 0.3, to 0.05 each time
    std::vector<double> logs;
    for (const PhysicalDraw& draw : draws_of(model, physics, 3)) {
      const double error = (physical_at(model, draw.uniforms).friction - 0.3) / 0.05;
      logs.push_back(-0.5 * error * error);
    }
    physics = after_evidence(model, physics, 3, logs, lesson);
  }
  double squares = 0.0;
  for (const PhysicalDraw& draw : *physics.draws) squares += std::exp(2.0 * draw.log_weight);
  EXPECT_GE(1.0 / squares, 0.25 * kPhysicalDraws);
  const auto estimates = parameter_estimates(model, physics);
  ASSERT_EQ(estimates.size(), 3u);
  EXPECT_EQ(estimates[0].name, "friction");
  EXPECT_NEAR(estimates[0].mean, 0.3, 0.01);
  EXPECT_NEAR(estimates[0].standard_deviation, 0.05 / std::sqrt(6.0), 0.006);
  EXPECT_NEAR(estimates[0].low, 0.3 - 1.645 * 0.05 / std::sqrt(6.0), 0.012);
  EXPECT_NEAR(estimates[0].high, 0.3 + 1.645 * 0.05 / std::sqrt(6.0), 0.012);
  EXPECT_EQ(estimates[1].name, "mass");
  EXPECT_NEAR(estimates[1].mean, 0.5, 0.04);
  EXPECT_NEAR(estimates[1].standard_deviation, 0.1, 0.03);
}

TEST(PhysicalBelief, AModelWithoutDoubtHasNothingToLearn) {
  const ObjectModel model;
  EXPECT_EQ(physical_dimensions(model), 0);
  EXPECT_TRUE(draws_of(model, {}, 1).empty());
  EXPECT_TRUE(parameter_estimates(model, {}).empty());
  EXPECT_EQ(PhysicalSampler(model, {}).dimensions(), 0);
}

}  // namespace
}  // namespace prescene::belief::physical_belief_test
