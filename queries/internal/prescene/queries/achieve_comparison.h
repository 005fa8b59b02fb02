// SPDX-License-Identifier: Apache-2.0
// What searches for action parameters are compared with and checked by: choices that are sampled and evaluated one
// after the other, and what fresh instances say of a given choice.
//
//   SamplingOptions options;
//   options.most_choices = 400;
//   PRESCENE_TRY(const SampledSearch plain, sample_and_evaluate(scene, 1, question, context, options));
//   ... plain.simulated_seconds      // until the first choice that is certified
#pragma once

#include <memory>
#include <span>

#include "prescene/belief/achieve.h"
#include "prescene/queries/query_engine.h"

namespace prescene::queries {

struct SamplingOptions {
  int most_choices = 1000;
  double tolerance = 0.02;  ///< Of the estimator's intervals.
  /// Leave a choice as soon as its interval is below the wanted probability, instead of at the tolerance.
  bool reject_early = false;
};
struct SampledSearch {
  bool found = false;
  int choices = 0;  ///< Evaluated, the certified one among them.
  int instances = 0;
  double simulated_seconds = 0.0;
};
/// Choices drawn evenly from the ranges, where something is in the way drawn anew; each is evaluated by the estimator
/// of predictions without certificates (simulation::class_estimate at the sizes of simulation::next_net_size), until
/// the lower end of an interval reaches the wanted probability. Every choice has the whole tolerated error, as if it
/// were the only one.
core::Result<SampledSearch> sample_and_evaluate(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                                const belief::AchieveQuery& query, const QueryContext& context,
                                                const SamplingOptions& options);

struct CheckedChoice {
  int instances = 0, successes = 0;
};
/// Fresh instances of a choice (`values` in the order of the answer's parameters), or of choices drawn evenly between
/// `low` and `high` where these are given. `seed` has to be another one than that of the question, whose fresh
/// instances they would be otherwise.
core::Result<CheckedChoice> check_choice(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                         const belief::AchieveQuery& query, const QueryContext& context,
                                         const belief::ActionChoice& choice, int instances);

/// Shares of choices, drawn evenly, by their probability: of those that have the outcome in at least `wanted` of
/// `instances` instances. Where something is in the way they have it in none.
core::Result<double> share_of_choices(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                      const belief::AchieveQuery& query, const QueryContext& context, int choices,
                                      int instances);

}  // namespace prescene::queries
