// SPDX-License-Identifier: Apache-2.0
#include "claim_tests.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "prescene/queries/confidence_sequence.h"
#include "prescene/simulation/outcomes/quantiles.h"

namespace prescene::queries {
namespace {

constexpr int kMostTestTrials = 1024;  // of one test
constexpr int kNearestTrials = 128;    // of what is reported where no claim holds
constexpr int kFirstTestTrials = 64, kMoreTestTrials = 32;
constexpr double kGivenUp = 0.85;  // probability that the point is worse than wanted, at which its test ends
// Where confidence sequences are narrow: a few per cent below 1, where claims are made.
constexpr PriorOfShare kNearOne{20.0, 0.5};

}  // namespace

double ClaimTests::error_of(int number) const { return (1.0 - options_.confidence) * std::pow(0.5, number); }

std::optional<SearchClaim> ClaimTests::test(SearchClaim claim, double error) {
  ++result_.attempts;
  while (!tried_.over() && claim.trials < kMostTestTrials) {
    const int count = claim.trials == 0 ? kFirstTestTrials : kMoreTestTrials;
    if (!run_fresh(claim, count)) break;
    const ShareInterval interval = confidence_sequence(claim.successes, claim.trials, error, kNearOne);
    claim.lower = interval.low;
    claim.upper = interval.high;
    claim.holds = claim.lower >= options_.wanted;
    if (claim.holds) return claim;
    const double worse =
        simulation::beta_cdf(options_.wanted, claim.successes + 1.0, claim.trials - claim.successes + 1.0);
    if (worse > kGivenUp) break;
  }
  if (claim.trials == 0) return std::nullopt;
  return claim;
}

bool ClaimTests::run_fresh(SearchClaim& claim, int count) {
  std::vector<UnitPoint> places;
  std::vector<std::uint32_t> scenarios;
  for (int i = 0; i < count; ++i) {
    UnitPoint at = claim.at;
    const std::uint32_t scenario = next_fresh_++;
    if (!claim.low.empty()) {
      core::RandomStream place = stream_.at(1, scenario);
      for (std::size_t k = 0; k < options_.periodic.size(); ++k)
        at[k] = in_cube(options_, k, claim.low[k] + (claim.high[k] - claim.low[k]) * place.uniform());
      if (!runner_.possible(at)) continue;  // fails
    }
    places.push_back(std::move(at));
    scenarios.push_back(scenario);
  }
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < places.size(); ++i) trials.push_back({places[i], scenarios[i], true});
  std::vector<TrialEnd> ends(trials.size());
  if (!tried_.run_trials(trials, ends)) return false;
  claim.trials += count;
  claim.successes += static_cast<int>(std::count(ends.begin(), ends.end(), TrialEnd::kSucceeds));
  return true;
}

void ClaimTests::look_at(SearchClaim& nearest) {
  std::vector<Trial> trials;
  for (int i = 0; i < kNearestTrials; ++i) trials.push_back({nearest.at, next_fresh_++, true});
  std::vector<TrialEnd> ends(trials.size());
  if (runner_.run(trials, ends)) {
    result_.all_trials += kNearestTrials;
    nearest.trials = kNearestTrials;
    nearest.successes = static_cast<int>(std::count(ends.begin(), ends.end(), TrialEnd::kSucceeds));
    const ShareInterval interval = clopper_pearson(nearest.successes, nearest.trials, 1.0 - options_.confidence);
    nearest.lower = interval.low;
    nearest.upper = interval.high;
  }
}

}  // namespace prescene::queries
