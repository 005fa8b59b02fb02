// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/parameter_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "peel_box.h"
#include "prescene/core/check.h"
#include "prescene/core/sobol.h"
#include "prescene/queries/confidence_sequence.h"
#include "prescene/simulation/outcomes/quantiles.h"

namespace prescene::queries {
namespace {

// Scenarios of the search: each explored point has its own, by its number in the net; points near successes have
// others; in races and surveys all points meet the same.
constexpr std::uint32_t kLocalScenarios = 1U << 23U, kCommonScenarios = 1U << 24U;
constexpr int kMostTests = 20;         // of points: the error that is left then is nothing
constexpr int kMostTestTrials = 1024;  // of one test
constexpr int kNearestTrials = 128;    // of what is reported where no claim holds
constexpr int kFirstTestTrials = 64, kMoreTestTrials = 32;
constexpr std::size_t kElites = 24;   // points that race
constexpr std::size_t kRanked = 160;  // points whose neighbours are looked at, each of which takes a pass over all
constexpr double kGivenUp = 0.85;     // probability that the point is worse than wanted, at which its test ends
constexpr double kOwnWeight = 1.0;    // trials that the neighbours' mean counts for
// Where confidence sequences are narrow: a few per cent below 1, where claims are made.
constexpr PriorOfShare kNearOne{20.0, 0.5};

double wrapped(double value) { return value - std::floor(value); }

class Search {
 public:
  Search(TrialRunner& runner, const SearchOptions& options, const core::RandomStream& stream,
         const std::function<void(const SearchClaim&)>& on_claim,
         const std::function<void(const SearchResult&)>& on_round)
      : runner_(runner),
        options_(options),
        on_claim_(on_claim),
        on_round_(on_round),
        dimensions_(options.periodic.size()),
        net_(static_cast<int>(dimensions_), options.net_seed),
        draws_(stream.for_purpose(core::Purpose::kAction).at(0)) {}

  SearchResult run() {
    find_first();
    if (result_.first >= 0 && on_round_) tell(ranked());
    if (result_.first >= 0 && options_.survey) {
      improve();
      if (on_round_) tell(ranked());
      survey(result_.claims[static_cast<std::size_t>(result_.best)].at);
      find_box();
      if (on_round_) tell(ranked());
      draw_map(result_.claims[static_cast<std::size_t>(result_.best)].at);
    }
    note_leaders(ranked());
    if (result_.first < 0) tell_nearest();
    result_.points = std::move(points_);
    return std::move(result_);
  }

 private:
  struct Pending {
    std::size_t point;
    std::uint32_t scenario;
  };

  // ---- trials

  /// Runs trials at points of the search and counts them; false once the search is over.
  bool run_pending(std::vector<Pending>& pending) {
    if (over_) return false;
    std::vector<Trial> trials;
    for (const Pending& one : pending) trials.push_back({points_[one.point].at, one.scenario, false});
    std::vector<TrialEnd> ends(trials.size());
    if (!run_trials(trials, ends)) return false;
    for (std::size_t i = 0; i < pending.size(); ++i) {
      SearchPoint& point = points_[pending[i].point];
      const bool succeeded = ends[i] == TrialEnd::kSucceeds;
      if (point.trials == 0) {
        point.scenario = pending[i].scenario;
        point.first_succeeded = succeeded;
      }
      ++point.trials;
      point.successes += succeeded;
      if (point.explored && point.trials == 1) result_.explored_successes += succeeded;
    }
    pending.clear();
    return true;
  }

  /// Counts towards the limits. The trials count for something even if they reach a limit: then nothing comes after.
  bool run_trials(std::span<const Trial> trials, std::span<TrialEnd> ends) {
    if (over_) return false;
    if (trials.empty()) return true;
    if (runner_.enough() || !runner_.run(trials, ends)) {
      over_ = true;
      result_.stop = SearchStop::kStopped;
      return false;
    }
    result_.all_trials += static_cast<int>(trials.size());
    result_.search_trials += static_cast<int>(trials.size());
    const int most = options_.exact_trials.value_or(options_.max_trials);
    if (result_.search_trials >= most) {
      over_ = true;
      result_.stop = options_.exact_trials ? SearchStop::kExact : SearchStop::kMaxTrials;
    }
    return true;
  }

  std::size_t add_point(UnitPoint at, bool explored) {
    SearchPoint& point = points_.emplace_back();
    point.at = std::move(at);
    point.explored = explored;
    point.possible = runner_.possible(point.at);
    if (explored) {
      ++result_.explored;
      result_.explored_impossible += point.possible ? 0 : 1;
    }
    return points_.size() - 1;
  }

  // ---- exploring

  /// Adds so many possible points of the net; fewer where hardly anything is possible.
  void explore(std::size_t count, std::vector<Pending>& pending) {
    std::size_t found = 0;
    for (std::size_t tries = 0; found < count && tries < 64 * count; ++tries) {
      UnitPoint at(dimensions_);
      const std::uint32_t number = next_in_net_++;
      net_.point(number, at);
      const std::size_t index = add_point(std::move(at), true);
      if (!points_[index].possible) continue;
      pending.push_back({index, number});
      ++found;
    }
  }

  double distance_squared(const UnitPoint& a, const UnitPoint& b) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < dimensions_; ++i) {
      double apart = std::abs(a[i] - b[i]);
      if (options_.periodic[i]) apart = std::min(apart, 1.0 - apart);
      sum += apart * apart;
    }
    return sum;
  }

  /// How far a point says something of its neighbours: less than their mean distance.
  double reach() const {
    const auto count = static_cast<double>(std::max<std::size_t>(points_.size(), 16));
    return 0.6 * std::pow(count, -1.0 / static_cast<double>(dimensions_));
  }

  /// The share of success that trials at the point and near it let expect.
  double merit(std::size_t index) const {
    const SearchPoint& own = points_[index];
    const double reach_squared = std::pow(std::max(0.02, reach()), 2);
    double successes = overall_share(), trials = 1.0;
    for (std::size_t j = 0; j < points_.size(); ++j) {
      if (j == index) continue;
      const double apart = distance_squared(own.at, points_[j].at) / reach_squared;
      if (apart > 9.0) continue;
      const double weight = std::exp(-0.5 * apart);
      // What can't be done fails, and is known for certain; but as one trial, not more.
      successes += weight * points_[j].successes;
      trials += weight * (points_[j].possible ? points_[j].trials : 1);
    }
    return (own.successes + kOwnWeight * successes / trials) / (own.trials + kOwnWeight);
  }

  struct Ranked {
    std::size_t point;
    double merit;
  };
  /// Possible points with a success, the best first; of many, those that their own trials speak for most.
  std::vector<Ranked> ranked() const {
    const double overall = overall_share();
    std::vector<Ranked> order;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const SearchPoint& point = points_[i];
      if (!point.possible || point.successes == 0) continue;
      order.push_back({i, (point.successes + overall) / (point.trials + 1.0)});
    }
    const auto better = [](const Ranked& a, const Ranked& b) { return a.merit > b.merit; };
    std::stable_sort(order.begin(), order.end(), better);
    if (order.size() > kRanked) order.resize(kRanked);
    for (Ranked& one : order) one.merit = merit(one.point);
    std::stable_sort(order.begin(), order.end(), better);
    return order;
  }

  void note_leaders(const std::vector<Ranked>& order) {
    result_.leaders.clear();
    for (const Ranked& one : std::span(order).first(std::min(order.size(), kMostLeaders))) {
      const SearchPoint& point = points_[one.point];
      result_.leaders.push_back({point.at, point.successes, point.trials, one.merit});
    }
  }

  void tell(const std::vector<Ranked>& order) {
    if (!on_round_ || over_) return;
    note_leaders(order);
    on_round_(result_);
  }

  double overall_share() const {
    return (result_.explored_successes + 0.5) / (result_.explored - result_.explored_impossible + 1.0);
  }

  /// Points about the best ones.
  void explore_near(const std::vector<Ranked>& order, std::size_t count, std::vector<Pending>& pending) {
    const std::size_t parents = std::min(kElites, order.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < parents; ++i) sum += order[i].merit * order[i].merit;
    const double step = std::max(0.01, 0.5 * reach());
    for (std::size_t n = 0; n < count && parents > 0; ++n) {
      double pick = draws_.uniform() * sum;
      std::size_t parent = 0;
      while (parent + 1 < parents && (pick -= order[parent].merit * order[parent].merit) > 0.0) ++parent;
      UnitPoint at = points_[order[parent].point].at;
      for (std::size_t i = 0; i < dimensions_; ++i) {
        at[i] += draws_.normal(0.0, step);
        at[i] = options_.periodic[i] ? wrapped(at[i]) : std::clamp(at[i], 0.0, 1.0);
      }
      const std::size_t index = add_point(std::move(at), false);
      if (points_[index].possible) pending.push_back({index, kLocalScenarios + next_local_++});
    }
  }

  /// Doubles the trials of the best points (to four at least), in scenarios that they have in common: of those with
  /// fewer than `most` trials, `least` of which or more succeeded.
  void race(const std::vector<Ranked>& order, std::size_t count, int most, double least,
            std::vector<Pending>& pending) {
    std::size_t given = 0;
    for (std::size_t i = 0; i < std::min(kElites, order.size()) && given < count; ++i) {
      const SearchPoint& point = points_[order[i].point];
      if (point.trials >= most || point.successes < least * point.trials) continue;
      for (int k = 0; k < std::max(3, point.trials) && given < count; ++k, ++given)
        pending.push_back({order[i].point, kCommonScenarios + static_cast<std::uint32_t>(point.trials + k)});
    }
  }

  // ---- testing

  double error_of_test(int number) const { return (1.0 - options_.confidence) * std::pow(0.5, number); }

  /// Fresh trials at `at`, or anywhere in the box, until the claim holds or is given up. Nothing: stopped before.
  std::optional<SearchClaim> test(SearchClaim claim, double error) {
    ++result_.attempts;
    const PriorOfShare prior = kNearOne;
    while (!over_ && claim.trials < kMostTestTrials) {
      const int count = claim.trials == 0 ? kFirstTestTrials : kMoreTestTrials;
      if (!run_fresh(claim, count)) break;
      const ShareInterval interval = confidence_sequence(claim.successes, claim.trials, error, prior);
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

  bool run_fresh(SearchClaim& claim, int count) {
    std::vector<UnitPoint> places;
    std::vector<std::uint32_t> scenarios;
    for (int i = 0; i < count; ++i) {
      UnitPoint at = claim.at;
      const std::uint32_t scenario = next_fresh_++;
      if (!claim.low.empty()) {
        core::RandomStream place = draws_.at(1, scenario);
        for (std::size_t k = 0; k < dimensions_; ++k)
          at[k] = in_cube(k, claim.low[k] + (claim.high[k] - claim.low[k]) * place.uniform());
        if (!runner_.possible(at)) continue;  // fails
      }
      places.push_back(std::move(at));
      scenarios.push_back(scenario);
    }
    std::vector<Trial> trials;
    for (std::size_t i = 0; i < places.size(); ++i) trials.push_back({places[i], scenarios[i], true});
    std::vector<TrialEnd> ends(trials.size());
    if (!run_trials(trials, ends)) return false;
    claim.trials += count;
    claim.successes += static_cast<int>(std::count(ends.begin(), ends.end(), TrialEnd::kSucceeds));
    return true;
  }

  double in_cube(std::size_t parameter, double value) const {
    return options_.periodic[parameter] ? wrapped(value) : std::clamp(value, 0.0, 1.0);
  }

  /// Tests the point; a claim that holds is kept, one that does not adds to what the search knows.
  bool test_point(const Ranked& candidate) {
    SearchPoint& point = points_[candidate.point];
    point.tested = true;
    SearchClaim asked;
    asked.at = point.at;
    asked.merit = candidate.merit;
    const std::optional<SearchClaim> claim = test(asked, error_of_test(++tests_));
    if (!claim) return false;
    points_[candidate.point].successes += claim->successes;
    points_[candidate.point].trials += claim->trials;
    if (!claim->holds) return false;
    result_.claims.push_back(*claim);
    if (on_claim_) on_claim_(*claim);
    return true;
  }

  // ---- the course of the search

  void find_first() {
    // A leading point is worth a test when the search takes it for a little better than wanted.
    const double worth_testing = options_.wanted + 0.15 * (1.0 - options_.wanted);
    std::size_t to_explore = 128;
    while (!over_ && result_.first < 0) {
      std::vector<Pending> pending;
      const std::vector<Ranked> order = ranked();
      // Leaders of which too little is known race among themselves first, as exploring costs more.
      race(order, 48, 16, 0.7, pending);
      if (pending.size() < 8) {
        pending.clear();
        explore(to_explore, pending);
        explore_near(order, order.empty() ? 0 : 32, pending);
        race(order, 64, 128, 0.5, pending);
        to_explore = 64;
      }
      if (pending.empty()) return;  // nothing is possible anywhere
      if (!run_pending(pending)) return;
      const std::vector<Ranked> after = ranked();
      tell(after);
      for (const Ranked& candidate : after) {
        const SearchPoint& point = points_[candidate.point];
        if (candidate.merit < worth_testing) break;
        if (point.tested || point.trials < 8) continue;
        if (tests_ >= kMostTests) return;
        if (test_point(candidate)) {
          result_.first = result_.best = 0;
          result_.first_trials = result_.all_trials;
        }
        break;
      }
    }
  }

  /// Looks for better ones about the first claim.
  void improve() {
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds && !over_; ++round) {
      std::vector<Pending> pending;
      const std::vector<Ranked> order = ranked();
      explore(16, pending);
      explore_near(order, 48, pending);
      race(order, 96, 32, 0.5, pending);
      if (!run_pending(pending)) return;
    }
    for (const Ranked& candidate : ranked()) {
      if (points_[candidate.point].tested) return;  // the first claim's point is the best
      if (points_[candidate.point].trials < 16) continue;
      if (candidate.merit <= result_.claims.front().merit || tests_ >= kMostTests) return;
      if (test_point(candidate)) result_.best = static_cast<int>(result_.claims.size()) - 1;
      return;
    }
  }

  /// Shares of success along each parameter through a point.
  void survey(const UnitPoint& centre) {
    const auto values = static_cast<std::size_t>(options_.profile_values);
    for (std::size_t k = 0; k < dimensions_; ++k) {
      std::vector<UnitPoint> places;
      for (std::size_t v = 0; v < values; ++v) {
        UnitPoint at = centre;
        at[k] = (static_cast<double>(v) + 0.5) / static_cast<double>(values);
        places.push_back(std::move(at));
      }
      const std::vector<double> shares = shares_at(places, options_.profile_trials);
      if (shares.empty()) {
        result_.profiles.clear();
        result_.fails_alone.clear();
        return;
      }
      double mean = 0.0;
      for (const double share : shares) mean += std::max(0.0, share) / static_cast<double>(values);
      result_.profiles.push_back(shares);
      result_.fails_alone.push_back(1.0 - mean);
    }
  }

  /// Of `trials` in common scenarios at each place; -1 where nothing is possible; empty: the search is over.
  std::vector<double> shares_at(const std::vector<UnitPoint>& places, int trials) {
    std::vector<std::size_t> numbers;
    std::vector<Pending> pending;
    for (const UnitPoint& place : places) {
      const std::size_t index = add_point(place, false);
      numbers.push_back(index);
      for (int t = 0; t < trials && points_[index].possible; ++t)
        pending.push_back({index, kCommonScenarios + static_cast<std::uint32_t>(t)});
    }
    if (over_ || !run_pending(pending)) return {};
    std::vector<double> shares;
    for (const std::size_t index : numbers) {
      const SearchPoint& point = points_[index];
      shares.push_back(point.possible ? static_cast<double>(point.successes) / point.trials : -1.0);
    }
    return shares;
  }

  /// The box: as far along each parameter as its profile succeeds, then peeled until trials all over it succeed often
  /// enough.
  void find_box() {
    if (over_ || result_.profiles.size() != dimensions_) return;
    const UnitPoint& centre = result_.claims[static_cast<std::size_t>(result_.best)].at;
    UnitPoint low(dimensions_), high(dimensions_);
    for (std::size_t k = 0; k < dimensions_; ++k) {
      const std::vector<double>& profile = result_.profiles[k];
      const auto values = static_cast<int>(profile.size());
      const auto succeeds = [&](int cell) {
        return profile[static_cast<std::size_t>((cell % values + values) % values)] >= 1.0;
      };
      const int own = std::clamp(static_cast<int>(centre[k] * values), 0, values - 1);
      int first = own, last = own;
      const bool periodic = options_.periodic[k];
      while ((periodic ? last - first + 1 < values : first > 0) && succeeds(first - 1)) --first;
      while ((periodic ? last - first + 1 < values : last + 1 < values) && succeeds(last + 1)) ++last;
      const double cell = 1.0 / values;
      low[k] = std::min(centre[k], first * cell);
      high[k] = std::max(centre[k], (last + 1) * cell);
    }
    // Peeled a little further than what is worth a test, as what is left looks better than it is.
    const double worth_testing = options_.wanted + 0.4 * (1.0 - options_.wanted);
    const double peeled = options_.wanted + 0.8 * (1.0 - options_.wanted);
    constexpr int kTrials = 128, kRounds = 8, kMostBoxTests = 4;
    std::vector<BoxSample> samples;
    int tests = 0;
    for (int round = 0; round < kRounds && tests < kMostBoxTests && !over_; ++round) {
      const std::size_t before = samples.size();
      if (!sample_box(low, high, kTrials, samples)) return;
      const std::span<const BoxSample> newest = std::span(samples).subspan(before);
      const auto succeeded =
          std::count_if(newest.begin(), newest.end(), [](const BoxSample& s) { return s.succeeded; });
      const double share = static_cast<double>(succeeded) / static_cast<double>(newest.size());
      if (share < worth_testing) {
        peel_box(centre, samples, peeled, low, high);
        continue;
      }
      SearchClaim box;
      box.low = low;
      box.high = high;
      for (std::size_t k = 0; k < dimensions_; ++k) box.at.push_back(in_cube(k, 0.5 * (low[k] + high[k])));
      box.merit = share;
      // A claim of its own, with its own tolerated error.
      const std::optional<SearchClaim> claim = test(box, error_of_test(++tests));
      if (claim && claim->holds) {
        result_.box = claim;
        return;
      }
      for (std::size_t k = 0; k < dimensions_; ++k) {
        low[k] = centre[k] + 0.9 * (low[k] - centre[k]);
        high[k] = centre[k] + 0.9 * (high[k] - centre[k]);
      }
    }
  }

  bool sample_box(const UnitPoint& low, const UnitPoint& high, int count, std::vector<BoxSample>& samples) {
    std::vector<Pending> pending;
    std::vector<std::size_t> numbers;
    const std::size_t before = samples.size();
    for (int t = 0; t < count; ++t) {
      UnitPoint at(dimensions_), in_range(dimensions_);
      for (std::size_t k = 0; k < dimensions_; ++k) {
        at[k] = low[k] + (high[k] - low[k]) * draws_.uniform();
        in_range[k] = in_cube(k, at[k]);
      }
      samples.push_back({std::move(at), false});
      const std::size_t index = add_point(std::move(in_range), false);
      numbers.push_back(index);
      if (points_[index].possible) pending.push_back({index, kLocalScenarios + next_local_++});
    }
    if (!run_pending(pending)) return false;
    for (std::size_t t = 0; t < numbers.size(); ++t) samples[before + t].succeeded = points_[numbers[t]].successes > 0;
    return true;
  }

  void draw_map(const UnitPoint& centre) {
    if (over_ || result_.fails_alone.size() != dimensions_ || dimensions_ < 2) return;
    std::vector<std::size_t> order(dimensions_);
    for (std::size_t k = 0; k < dimensions_; ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return result_.fails_alone[a] > result_.fails_alone[b]; });
    const std::size_t x = std::min(order[0], order[1]), y = std::max(order[0], order[1]);
    std::vector<UnitPoint> places;
    for (int iy = 0; iy < options_.map_cells; ++iy)
      for (int ix = 0; ix < options_.map_cells; ++ix) {
        UnitPoint at = centre;
        at[x] = (ix + 0.5) / options_.map_cells;
        at[y] = (iy + 0.5) / options_.map_cells;
        places.push_back(std::move(at));
      }
    result_.map = shares_at(places, options_.map_trials);
    if (result_.map.empty()) return;
    result_.map_x = static_cast<int>(x);
    result_.map_y = static_cast<int>(y);
  }

  /// What is reported where no claim holds; beyond the limits of the search, so that there is an interval.
  void tell_nearest() {
    std::vector<Ranked> order = ranked();
    if (order.empty()) {
      for (std::size_t i = 0; i < points_.size() && order.empty(); ++i)
        if (points_[i].possible) order.push_back({i, 0.0});
    }
    if (order.empty()) return;
    SearchClaim claim;
    claim.at = points_[order.front().point].at;
    claim.merit = order.front().merit;
    std::vector<Trial> trials;
    for (int i = 0; i < kNearestTrials; ++i) trials.push_back({claim.at, next_fresh_++, true});
    std::vector<TrialEnd> ends(trials.size());
    if (runner_.run(trials, ends)) {
      result_.all_trials += kNearestTrials;
      claim.trials = kNearestTrials;
      claim.successes = static_cast<int>(std::count(ends.begin(), ends.end(), TrialEnd::kSucceeds));
      const ShareInterval interval = clopper_pearson(claim.successes, claim.trials, 1.0 - options_.confidence);
      claim.lower = interval.low;
      claim.upper = interval.high;
    }
    result_.nearest = claim;
  }

  TrialRunner& runner_;
  const SearchOptions& options_;
  const std::function<void(const SearchClaim&)>& on_claim_;
  const std::function<void(const SearchResult&)>& on_round_;
  std::size_t dimensions_;
  core::SobolNet net_;
  core::RandomStream draws_;
  std::vector<SearchPoint> points_;
  std::uint32_t next_in_net_ = 0, next_local_ = 0, next_fresh_ = 0;
  int tests_ = 0;
  bool over_ = false;
  SearchResult result_;
};

}  // namespace

SearchResult search_parameters(TrialRunner& runner, const SearchOptions& options, const core::RandomStream& stream,
                               const std::function<void(const SearchClaim&)>& on_claim,
                               const std::function<void(const SearchResult&)>& on_round) {
  PRESCENE_CHECK(!options.periodic.empty() && options.periodic.size() <= 16);
  PRESCENE_CHECK(options.wanted > 0.0 && options.wanted < 1.0);
  PRESCENE_CHECK(options.confidence > 0.0 && options.confidence < 1.0);
  PRESCENE_CHECK(options.max_trials > 0 && (!options.exact_trials || *options.exact_trials > 0));
  return Search(runner, options, stream, on_claim, on_round).run();
}

}  // namespace prescene::queries
