// SPDX-License-Identifier: Apache-2.0
// What the search for parameters claims, against probabilities that are known.
#include "prescene/queries/parameter_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "prescene/queries/confidence_sequence.h"
#include "prescene/simulation/outcomes/quantiles.h"

namespace prescene::queries::parameter_search_test {

using Probability = std::function<double(std::span<const double>)>;

/// Trials that succeed with a known probability.
class KnownTrials final : public TrialRunner {
 public:
  KnownTrials(Probability probability, std::uint64_t seed)
      : probability_(std::move(probability)), chance_(seed, core::Purpose::kTest) {}

  bool possible(std::span<const double> point) override { return probability_(point) >= 0.0; }
  bool run(std::span<const Trial> trials, std::span<TrialEnd> ends) override {
    if (left_ < static_cast<int>(trials.size())) return false;
    left_ -= static_cast<int>(trials.size());
    for (std::size_t i = 0; i < trials.size(); ++i) {
      core::RandomStream chance = chance_.at(trials[i].fresh ? 1 : 0, trials[i].scenario);
      ends[i] = chance.uniform() < probability_(trials[i].point) ? TrialEnd::kSucceeds : TrialEnd::kFails;
    }
    return true;
  }
  void stop_after(int trials) { left_ = trials; }

 private:
  Probability probability_;
  core::RandomStream chance_;
  int left_ = 1 << 30;
};

SearchOptions options_of(std::size_t dimensions, std::uint64_t seed) {
  SearchOptions options;
  options.periodic.assign(dimensions, false);
  options.net_seed = seed;
  return options;
}

double largest_distance(std::span<const double> a, const UnitPoint& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < b.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

/// 0.985 in a box of a share of the cube, falling off beside it.
Probability box_of(UnitPoint centre, double share) {
  const double half = 0.5 * std::pow(share, 1.0 / static_cast<double>(centre.size()));
  return [centre = std::move(centre), half](std::span<const double> point) {
    const double beyond = largest_distance(point, centre) - half;
    return beyond <= 0.0 ? 0.985 : 0.985 * std::exp(-beyond / 0.03);
  };
}

UnitPoint random_centre(std::size_t dimensions, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest, 7);
  UnitPoint centre(dimensions);
  for (double& coordinate : centre) coordinate = stream.uniform(0.2, 0.8);
  return centre;
}

SearchResult searched(const Probability& probability, const SearchOptions& options, std::uint64_t seed) {
  KnownTrials trials(probability, seed);
  return search_parameters(trials, options, core::RandomStream(seed, core::Purpose::kTest));
}

TEST(ConfidenceSequence, HoldsTheProbabilityAtAllTimesTogether) {
  constexpr double kTolerated = 0.05;
  constexpr int kRuns = 1000, kDraws = 400;
  for (const double truth : {0.95, 0.8}) {
    int missed = 0;
    for (int run = 0; run < kRuns; ++run) {
      core::RandomStream stream(17, core::Purpose::kTest, static_cast<std::uint64_t>(run));
      int successes = 0;
      bool held = true;
      for (int n = 1; n <= kDraws && held; ++n) {
        successes += stream.uniform() < truth;
        const ShareInterval interval = confidence_sequence(successes, n, kTolerated, {20.0, 0.5});
        held = interval.low <= truth && truth <= interval.high;
      }
      missed += !held;
    }
    // Five standard deviations above what is tolerated.
    EXPECT_LE(missed, kRuns * kTolerated + 5.0 * std::sqrt(kRuns * kTolerated)) << truth;
  }
}

TEST(ConfidenceSequence, IsHardlyWiderThanAnIntervalForAFixedNumberWhereNothingFails) {
  // Without a failure in n draws p^n reaches the error at 59 draws for 0.95 and 5 %.
  int draws = 1;
  while (confidence_sequence(draws, draws, 0.05, {20.0, 0.5}).low < 0.95) ++draws;
  EXPECT_GE(draws, 59);
  EXPECT_LE(draws, 80);
}

TEST(ClopperPearson, CoversWithItsConfidenceWhateverTheProbability) {
  constexpr int kDraws = 20;
  for (const double truth : {0.02, 0.3, 0.5, 0.93}) {
    double covered = 0.0;
    for (int s = 0; s <= kDraws; ++s) {
      const ShareInterval interval = clopper_pearson(s, kDraws, 0.1);
      if (truth < interval.low || truth > interval.high) continue;
      const double log_ways = simulation::log_gamma(kDraws + 1.0) - simulation::log_gamma(s + 1.0) -
                              simulation::log_gamma(kDraws - s + 1.0);
      covered += std::exp(log_ways + s * std::log(truth) + (kDraws - s) * std::log1p(-truth));
    }
    EXPECT_GE(covered, 0.9 - 1e-9) << truth;
  }
  EXPECT_NEAR(clopper_pearson(0, 10, 0.1).high, 1.0 - std::pow(0.05, 0.1), 1e-9);
  EXPECT_EQ(clopper_pearson(0, 10, 0.1).low, 0.0);
  EXPECT_EQ(clopper_pearson(10, 10, 0.1).high, 1.0);
}

TEST(ParameterSearch, FindsAHundredthOfAFourDimensionalSpace) {
  int found = 0;
  std::vector<int> trials;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const UnitPoint centre = random_centre(4, seed);
    SearchOptions options = options_of(4, seed);
    options.survey = false;
    const SearchResult result = searched(box_of(centre, 0.01), options, seed);
    if (result.first < 0) continue;
    ++found;
    trials.push_back(result.first_trials);
    EXPECT_LT(largest_distance(result.claims[0].at, centre), 0.5 * std::pow(0.01, 0.25) + 0.02);
    EXPECT_GE(result.claims[0].lower, options.wanted);
  }
  EXPECT_EQ(found, 20);
  std::sort(trials.begin(), trials.end());
  EXPECT_LT(trials[trials.size() / 2], 900);
}

/// The shares of wrong claims over problems of all kinds: with a good place, with none, and with many nearly good ones.
TEST(ParameterSearch, OfAThousandClaimsNoMoreThanOneInTwentyIsFalse) {
  int claims = 0, wrong = 0, searches = 0;
  for (std::uint64_t seed = 0; claims < 1000 && seed < 3000; ++seed) {
    const UnitPoint centre = random_centre(2, seed);
    const std::vector<Probability> problems = {
        box_of(centre, 0.05),
        // A peak of 0.97 on a slope: what lies beside it is nearly good enough.
        [&](std::span<const double> point) { return 0.97 - 0.3 * largest_distance(point, centre); },
        // Good in a tenth, and just too bad everywhere else.
        [&](std::span<const double> point) { return largest_distance(point, centre) < 0.16 ? 0.98 : 0.945; },
    };
    SearchOptions options = options_of(2, seed);
    options.survey = false;
    options.max_trials = 1200;
    for (const Probability& probability : problems) {
      const SearchResult result = searched(probability, options, seed);
      ++searches;
      for (const SearchClaim& claim : result.claims) {
        ++claims;
        wrong += probability(claim.at) < options.wanted;
      }
    }
  }
  RecordProperty("claims", claims);
  RecordProperty("wrong", wrong);
  EXPECT_GE(claims, 1000);
  EXPECT_LE(wrong, 0.05 * claims);
}

TEST(ParameterSearch, WhereNothingIsGoodEnoughItClaimsSoInFewSearchesOnly) {
  constexpr int kSearches = 300;
  int searches_with_claims = 0;
  for (std::uint64_t seed = 0; seed < kSearches; ++seed) {
    SearchOptions options = options_of(3, seed);
    options.survey = false;
    options.max_trials = 2500;
    const SearchResult result = searched([](std::span<const double>) { return 0.949; }, options, seed);
    searches_with_claims += !result.claims.empty();
    if (result.claims.empty()) {
      ASSERT_TRUE(result.nearest);
      EXPECT_FALSE(result.nearest->holds);
      EXPECT_GT(result.nearest->trials, 0);
    }
  }
  // Five standard deviations above one in twenty.
  EXPECT_LE(searches_with_claims, 0.05 * kSearches + 5.0 * std::sqrt(0.05 * kSearches));
}

TEST(ParameterSearch, ClaimsNeighbourhoodsInWhichTheMeanIsHighEnough) {
  int boxes = 0, wrong = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const UnitPoint centre = random_centre(3, seed);
    const Probability probability = box_of(centre, 0.05);
    const SearchResult result = searched(probability, options_of(3, seed), seed);
    if (!result.box) continue;
    ++boxes;
    core::RandomStream stream(seed, core::Purpose::kTest, 3);
    double mean = 0.0;
    constexpr int kDraws = 4000;
    for (int i = 0; i < kDraws; ++i) {
      UnitPoint point(3);
      for (std::size_t k = 0; k < 3; ++k)
        point[k] = std::clamp(stream.uniform(result.box->low[k], result.box->high[k]), 0.0, 1.0);
      mean += probability(point) / kDraws;
    }
    wrong += mean < 0.95;
    for (std::size_t k = 0; k < 3; ++k) EXPECT_GT(result.box->high[k] - result.box->low[k], 0.05);
  }
  EXPECT_GE(boxes, 40);
  EXPECT_LE(wrong, 0.05 * boxes + 5.0 * std::sqrt(0.05 * boxes));
}

TEST(ParameterSearch, TellsWhichParametersDecide) {
  // The second alone decides.
  const SearchResult result = searched(
      [](std::span<const double> point) { return std::abs(point[1] - 0.4) < 0.15 ? 1.0 : 0.0; }, options_of(3, 5), 5);
  ASSERT_EQ(result.fails_alone.size(), 3u);
  EXPECT_NEAR(result.fails_alone[0], 0.0, 1e-12);
  EXPECT_NEAR(result.fails_alone[1], 0.7, 0.07);
  EXPECT_NEAR(result.fails_alone[2], 0.0, 1e-12);
  ASSERT_TRUE(result.box);
  EXPECT_EQ(result.box->low[0], 0.0);
  EXPECT_EQ(result.box->high[0], 1.0);
  EXPECT_LT(result.box->high[1] - result.box->low[1], 0.32);
  EXPECT_TRUE(result.map_x == 1 || result.map_y == 1);
}

TEST(ParameterSearch, GoesRoundWhereAParameterIsPeriodic) {
  SearchOptions options = options_of(2, 3);
  options.periodic = {true, false};
  // Good about 0, which is 1.
  const SearchResult result = searched(
      [](std::span<const double> point) { return std::min(point[0], 1.0 - point[0]) < 0.1 ? 1.0 : 0.0; }, options, 3);
  ASSERT_TRUE(result.box);
  EXPECT_NEAR(result.box->high[0] - result.box->low[0], 0.2, 0.07);
}

TEST(ParameterSearch, SkipsWhatIsImpossible) {
  const SearchResult result =
      searched([](std::span<const double> point) { return point[0] < 0.6 ? -1.0 : 0.99; }, options_of(2, 9), 9);
  ASSERT_GE(result.first, 0);
  EXPECT_GT(result.claims[0].at[0], 0.6);
  EXPECT_NEAR(static_cast<double>(result.explored_impossible) / result.explored, 0.6, 0.1);
  const SearchResult nothing = searched([](std::span<const double>) { return -1.0; }, options_of(2, 9), 9);
  EXPECT_LT(nothing.first, 0);
  EXPECT_FALSE(nothing.nearest);
  EXPECT_EQ(nothing.all_trials, 0);
}

TEST(ParameterSearch, EndsWithinItsLimitAndWhenItIsStopped) {
  SearchOptions options = options_of(4, 1);
  options.max_trials = 500;
  const SearchResult limited = searched([](std::span<const double>) { return 0.3; }, options, 1);
  EXPECT_EQ(limited.stop, SearchStop::kMaxTrials);
  EXPECT_GE(limited.search_trials, 500);
  EXPECT_LE(limited.search_trials, 500 + 256);

  KnownTrials stopped([](std::span<const double>) { return 0.3; }, 1);
  stopped.stop_after(400);
  const SearchResult result = search_parameters(stopped, options, core::RandomStream(1, core::Purpose::kTest));
  EXPECT_EQ(result.stop, SearchStop::kStopped);
  EXPECT_LE(result.all_trials, 400);
}

TEST(ParameterSearch, OfFewTrialsTakesHardlyMore) {
  for (const int most : {1, 16, 17, 60, 100, 128}) {
    SearchOptions options = options_of(3, 2);
    options.max_trials = most;
    const SearchResult limited = searched([](std::span<const double>) { return 0.3; }, options, 2);
    EXPECT_EQ(limited.stop, SearchStop::kMaxTrials);
    EXPECT_GE(limited.search_trials, most);
    EXPECT_LE(limited.search_trials, std::max(16, 2 * most));
  }
}

// The first points are those of one net, however many are tried at once: also where few of them are possible.
TEST(ParameterSearch, TellsFromTheFirstFewTrialsOn) {
  for (const double possible : {1.0, 0.1, 0.02}) {
    const Probability probability = [&](std::span<const double> point) { return point[0] < possible ? 0.4 : -1.0; };
    std::vector<SearchResult> told;
    SearchOptions options = options_of(2, 3);
    options.max_trials = 128;
    KnownTrials trials(probability, 3);
    const SearchResult result = search_parameters(trials, options, core::RandomStream(3, core::Purpose::kTest), {},
                                                  [&](const SearchResult& so_far) { told.push_back(so_far); });
    ASSERT_GE(told.size(), 3u) << possible;
    for (std::size_t i = 0; i < told.size(); ++i) {
      EXPECT_EQ(told[i].all_trials, told[i].explored - told[i].explored_impossible) << "each has been tried once";
      EXPECT_LE(told[i].all_trials, 16 << i);
      if (i > 0) {
        EXPECT_GT(told[i].all_trials, told[i - 1].all_trials);
      }
      EXPECT_FALSE(told[i].leaders.empty());
    }
    const SearchResult untold = searched(probability, options, 3);
    EXPECT_EQ(untold.explored, result.explored);
    EXPECT_EQ(untold.explored_successes, result.explored_successes);
    ASSERT_EQ(untold.points.size(), result.points.size());
    for (std::size_t i = 0; i < result.points.size(); ++i) EXPECT_EQ(untold.points[i].at, result.points[i].at);
    EXPECT_NEAR(static_cast<double>(result.explored - result.explored_impossible) / result.explored, possible, 0.02);
  }
}

TEST(ParameterSearch, RepeatsWhatWasStoppedByItsNumberOfTrials) {
  const Probability probability = box_of({0.4, 0.5, 0.6}, 0.05);
  for (const int until : {20, 50, 100, 300, 700, 1500}) {
    KnownTrials stopped(probability, 4);
    stopped.stop_after(until);
    const SearchResult cut = search_parameters(stopped, options_of(3, 4), core::RandomStream(4, core::Purpose::kTest));
    if (cut.search_trials == 0) continue;
    SearchOptions exact = options_of(3, 4);
    exact.exact_trials = cut.search_trials;
    const SearchResult again = searched(probability, exact, 4);
    EXPECT_EQ(again.search_trials, cut.search_trials);
    EXPECT_EQ(again.explored, cut.explored) << "points whose trials were stopped are not counted";
    EXPECT_EQ(again.explored_impossible, cut.explored_impossible);
    EXPECT_EQ(again.explored_successes, cut.explored_successes);
    ASSERT_EQ(again.claims.size(), cut.claims.size());
    for (std::size_t i = 0; i < cut.claims.size(); ++i) {
      EXPECT_EQ(again.claims[i].at, cut.claims[i].at);
      EXPECT_EQ(again.claims[i].lower, cut.claims[i].lower);
    }
    EXPECT_EQ(again.map, cut.map);
  }
}

}  // namespace prescene::queries::parameter_search_test
