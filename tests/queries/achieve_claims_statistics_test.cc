// SPDX-License-Identifier: Apache-2.0
// Whether what is claimed of choices is true in the stepper that they were searched with.
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/queries/achieve_comparison.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "tests/support/achieve_scenes.h"

namespace prescene::queries::achieve_claims_test {

TEST(AchieveClaims, AreTrueOfInstancesThatTheSearchHasNotSeen) {
  core::ThreadPool pool(2);
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  QueryContext context;
  context.pool = &pool;
  context.make_simulator = [&](const belief::Scene& scene, double) {
    return simulation::make_bullet_simulator(scene, shapes);
  };
  const auto problems = tests::achieve_problems();
  ASSERT_TRUE(problems.ok()) << problems.status().message();
  int claims = 0, wrong = 0;
  for (const std::size_t number : {0u, 1u, 2u}) {
    const tests::AchieveProblem& problem = (*problems)[number];
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      belief::AchieveQuery query = problem.query;
      query.survey = false;
      const belief::Answer answer = queries::answer(problem.scene, seed, {"", query}, context);
      ASSERT_TRUE(answer.error.ok()) << problem.name << ": " << answer.error.message();
      for (const belief::ActionChoice& choice : std::get<belief::AchieveAnswer>(answer.what).choices) {
        const auto checked = check_choice(problem.scene, 100 + seed, query, context, choice, 1500);
        ASSERT_TRUE(checked.ok()) << checked.status().message();
        ++claims;
        // Four standard deviations of the check below what is claimed.
        wrong += checked->successes < 1500 * (0.95 - 4.0 * std::sqrt(0.95 * 0.05 / 1500));
      }
    }
  }
  EXPECT_GE(claims, 5);
  // Of six claims, each false with 5 %, three or more are once in five hundred times.
  EXPECT_LE(wrong, 2);
}

TEST(AchieveClaims, TakeFarFewerSimulatedSecondsThanSamplingAndEvaluating) {
  core::ThreadPool pool(2);
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  QueryContext context;
  context.pool = &pool;
  context.make_simulator = [&](const belief::Scene& scene, double) {
    return simulation::make_bullet_simulator(scene, shapes);
  };
  const auto problems = tests::achieve_problems();
  ASSERT_TRUE(problems.ok()) << problems.status().message();
  const tests::AchieveProblem& problem = problems->front();
  belief::AchieveQuery query = problem.query;
  query.survey = false;
  double searched = 0.0, sampled = 0.0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const belief::Answer answer = queries::answer(problem.scene, seed, {"", query}, context);
    ASSERT_TRUE(answer.error.ok()) << answer.error.message();
    searched += std::get<belief::AchieveAnswer>(answer.what).simulated_seconds;
    const auto plain = sample_and_evaluate(problem.scene, seed, query, context, {});
    ASSERT_TRUE(plain.ok()) << plain.status().message();
    EXPECT_TRUE(plain->found);
    sampled += plain->simulated_seconds;
  }
  EXPECT_GT(sampled, 2.0 * searched);
}

}  // namespace prescene::queries::achieve_claims_test
