// SPDX-License-Identifier: Apache-2.0
// Certificates know no size of things: what is certain of a state is certain of the similar state of the similar scene.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "certified_problem.h"
#include "prescene/simulation/similarity.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::simulation::certifier_size_laws_test {
namespace {

/// simulation::scaled() leaves outcomes as they are.
void scale_outcome(double length, belief::Outcome& outcome) {
  for (std::vector<belief::Condition>* conditions : {&outcome.all_of, &outcome.any_of}) {
    for (belief::Condition& condition : *conditions) {
      if (auto* volume = std::get_if<belief::InsideVolume>(&condition.predicate)) {
        volume->X_WV.translation *= length;
        volume->size *= length;
      } else if (auto* below = std::get_if<belief::BelowHeight>(&condition.predicate)) {
        below->height *= length;
      }
    }
  }
}

std::shared_ptr<const belief::Scene> similar_scene(const belief::Scene& scene, const Similarity& similarity) {
  auto similar = std::make_shared<belief::Scene>(scaled(scene, similarity));
  for (belief::Outcome& outcome : similar->outcomes) scale_outcome(similarity.length, outcome);
  for (belief::ExclusiveOutcomes& exclusive : similar->exclusive_outcomes)
    for (belief::Outcome& outcome : exclusive.outcomes) scale_outcome(similarity.length, outcome);
  return similar;
}

std::unique_ptr<const Certifier> certifier_of(const std::shared_ptr<const belief::Scene>& scene, double length_scale) {
  RunRequest request;
  request.stop.duration = scene->duration;
  request.stop.world_radius = 20.0 * length_scale;
  CertifierOptions options;
  options.length_scale = length_scale;
  return make_certifier(scene, variables_of(scene, scene->outcomes, scene->exclusive_outcomes), request, options);
}

// Powers of four, whose square roots are powers of two: similar numbers are the same but for their exponent.
TEST(CertificatesOfSimilarScenes, AreTheSame) {
  constexpr std::uint32_t kRuns = 12;
  for (const tests::NamedScene& named : tests::uncertain_scenes()) {
    Problem problem(named.scene);
    problem.request.sample_interval = 0.05;
    const StartSampler sampler(problem.starts.components.front(), 7);
    std::vector<belief::WorldState> starts;
    for (std::uint32_t i = 0; i < kRuns; ++i) starts.push_back(sampler.draw(i));
    std::vector<belief::Trajectory> runs(starts.size());
    core::ThreadPool pool(1);
    problem.simulator->run(starts, problem.request, test_stream(), 0, pool, runs);

    const auto certifier = certifier_of(named.scene, 1.0);
    ASSERT_TRUE(certifier) << named.name;
    int states = 0, decided = 0;
    for (const double length : {1.0 / 64.0, 64.0}) {
      const Similarity similarity{length};
      const auto similar = certifier_of(similar_scene(*named.scene, similarity), length);
      ASSERT_TRUE(similar) << named.name;
      for (const belief::Trajectory& run : runs) {
        for (const belief::WorldState& state : run.states) {
          const double left = named.scene->duration - (state.time - run.start().time);
          const auto classes = certifier->classes(state, left);
          EXPECT_EQ(similar->classes(scaled(state, similarity), left * similarity.time()), classes)
              << named.name << ", " << length << " times as large, at " << state.time << " s";
          ++states;
          decided += classes.has_value() ? 1 : 0;
        }
      }
    }
    // Or the law would be one of certifiers that are never certain.
    EXPECT_GT(decided, states / 10) << named.name;
    EXPECT_LT(decided, states) << named.name;
  }
}

}  // namespace
}  // namespace prescene::simulation::certifier_size_laws_test
