// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/parameter_search.h"

#include <algorithm>
#include <utility>

#include "claim_tests.h"
#include "peel_box.h"
#include "prescene/core/check.h"
#include "prescene/core/sobol.h"
#include "tried_points.h"

namespace prescene::queries {
namespace {

// Scenarios of the search: each explored point has its own, by its number in the net; points near successes have
// others; in races and surveys all points meet the same.
constexpr std::uint32_t kLocalScenarios = 1U << 23U, kCommonScenarios = 1U << 24U;
// Points of the net that are tried at first, and after how many of these what is known is told. Sixteen trials fill a
// vector of eight lanes on each of two threads: fewer hardly take less time. Only the last number changes results.
constexpr std::size_t kFirstPoints[] = {16, 32, 64, 128};
constexpr std::size_t kMostTries = 64;  // points of the net that are looked at for one that is possible
constexpr int kMostTests = 20;          // of points: the error that is left then is nothing
constexpr std::size_t kElites = 24;     // points that race

class Search {
 public:
  Search(TrialRunner& runner, const SearchOptions& options, const core::RandomStream& stream,
         const std::function<void(const SearchClaim&)>& on_claim,
         const std::function<void(const SearchResult&)>& on_round)
      : options_(options),
        on_claim_(on_claim),
        on_round_(on_round),
        dimensions_(options.periodic.size()),
        net_(static_cast<int>(dimensions_), options.net_seed),
        draws_(stream.for_purpose(core::Purpose::kAction).at(0)),
        tried_(runner, options, result_),
        tests_(runner, options, draws_, tried_, result_) {}

  SearchResult run() {
    find_first();
    if (result_.first >= 0 && on_round_) tell(tried_.ranked());
    if (result_.first >= 0 && options_.survey) {
      improve();
      if (on_round_) tell(tried_.ranked());
      survey(result_.claims[static_cast<std::size_t>(result_.best)].at);
      find_box();
      if (on_round_) tell(tried_.ranked());
      draw_map(result_.claims[static_cast<std::size_t>(result_.best)].at);
    }
    note_leaders(tried_.ranked());
    if (result_.first < 0) tell_nearest();
    result_.points = tried_.take();
    return std::move(result_);
  }

 private:
  // ---- exploring

  /// Adds so many possible points of the net, fewer where hardly anything is possible: `most` are looked at. Returns
  /// how many were.
  std::size_t explore(std::size_t count, std::size_t most, std::vector<TriedPoints::Pending>& pending) {
    std::size_t found = 0, tries = 0;
    for (; found < count && tries < most; ++tries) {
      UnitPoint at(dimensions_);
      const std::uint32_t number = next_in_net_++;
      net_.point(number, at);
      const std::size_t index = tried_.add(std::move(at), true);
      if (!tried_[index].possible) continue;
      pending.push_back({index, number});
      ++found;
    }
    return tries;
  }

  /// Tries the first points of the net, and tells what is known after each part of them but the last. Whether the
  /// search goes on.
  bool try_first_points() {
    constexpr std::size_t kAll = kFirstPoints[std::size(kFirstPoints) - 1];
    // All at once fill the lanes better, for who waits for the answer; but a limit within them is kept either way.
    const bool in_parts = on_round_ || options_.exact_trials.value_or(options_.max_trials) < static_cast<int>(kAll);
    std::size_t found = 0, tries = 0;
    for (const std::size_t count : kFirstPoints) {
      if (!in_parts && count < kAll) continue;
      if (found > 0) tell(tried_.ranked());
      std::vector<TriedPoints::Pending> pending;
      tries += explore(count - found, kMostTries * count - tries, pending);
      found += pending.size();
      if (!pending.empty() && !tried_.run_pending(pending)) return false;
      if (tried_.over()) break;
    }
    return found > 0;
  }

  void note_leaders(const std::vector<TriedPoints::Ranked>& order) {
    result_.leaders.clear();
    for (const TriedPoints::Ranked& one : std::span(order).first(std::min(order.size(), kMostLeaders))) {
      const SearchPoint& point = tried_[one.point];
      result_.leaders.push_back({point.at, point.successes, point.trials, one.merit});
    }
  }

  void tell(const std::vector<TriedPoints::Ranked>& order) {
    if (!on_round_ || tried_.over()) return;
    note_leaders(order);
    on_round_(result_);
  }

  /// Points about the best ones.
  void explore_near(const std::vector<TriedPoints::Ranked>& order, std::size_t count,
                    std::vector<TriedPoints::Pending>& pending) {
    const std::size_t parents = std::min(kElites, order.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < parents; ++i) sum += order[i].merit * order[i].merit;
    const double step = std::max(0.01, 0.5 * tried_.reach());
    for (std::size_t n = 0; n < count && parents > 0; ++n) {
      double pick = draws_.uniform() * sum;
      std::size_t parent = 0;
      while (parent + 1 < parents && (pick -= order[parent].merit * order[parent].merit) > 0.0) ++parent;
      UnitPoint at = tried_[order[parent].point].at;
      for (std::size_t i = 0; i < dimensions_; ++i) {
        at[i] = in_cube(options_, i, at[i] + draws_.normal(0.0, step));
      }
      const std::size_t index = tried_.add(std::move(at), false);
      if (tried_[index].possible) pending.push_back({index, kLocalScenarios + next_local_++});
    }
  }

  /// Doubles the trials of the best points (to four at least), in scenarios that they have in common: of those with
  /// fewer than `most` trials, `least` of which or more succeeded.
  void race(const std::vector<TriedPoints::Ranked>& order, std::size_t count, int most, double least,
            std::vector<TriedPoints::Pending>& pending) {
    std::size_t given = 0;
    for (std::size_t i = 0; i < std::min(kElites, order.size()) && given < count; ++i) {
      const SearchPoint& point = tried_[order[i].point];
      if (point.trials >= most || point.successes < least * point.trials) continue;
      for (int k = 0; k < std::max(3, point.trials) && given < count; ++k, ++given)
        pending.push_back({order[i].point, kCommonScenarios + static_cast<std::uint32_t>(point.trials + k)});
    }
  }

  // ---- testing

  /// Tests the point; a claim that holds is kept, one that does not adds to what the search knows.
  bool test_point(const TriedPoints::Ranked& candidate) {
    SearchPoint& point = tried_[candidate.point];
    point.tested = true;
    SearchClaim asked;
    asked.at = point.at;
    asked.merit = candidate.merit;
    const std::optional<SearchClaim> claim = tests_.test(asked, tests_.error_of(++point_tests_));
    if (!claim) return false;
    tried_[candidate.point].successes += claim->successes;
    tried_[candidate.point].trials += claim->trials;
    if (!claim->holds) return false;
    result_.claims.push_back(*claim);
    if (on_claim_) on_claim_(*claim);
    return true;
  }

  // ---- the course of the search

  /// A round of trials after the first points. Whether the search goes on.
  bool try_round() {
    constexpr std::size_t kExplored = 64, kNear = 32;
    std::vector<TriedPoints::Pending> pending;
    const std::vector<TriedPoints::Ranked> order = tried_.ranked();
    // Leaders of which too little is known race among themselves first, as exploring costs more.
    race(order, 48, 16, 0.7, pending);
    if (pending.size() < 8) {
      pending.clear();
      explore(kExplored, kMostTries * kExplored, pending);
      explore_near(order, order.empty() ? 0 : kNear, pending);
      race(order, 64, 128, 0.5, pending);
    }
    return !pending.empty() && tried_.run_pending(pending);
  }

  void find_first() {
    // A leading point is worth a test when the search takes it for a little better than wanted.
    const double worth_testing = options_.wanted + 0.15 * (1.0 - options_.wanted);
    if (tried_.over() || !try_first_points()) return;  // nothing is possible anywhere
    for (bool begun = false; result_.first < 0; begun = true) {
      if (begun && (tried_.over() || !try_round())) return;
      const std::vector<TriedPoints::Ranked> after = tried_.ranked();
      tell(after);
      for (const TriedPoints::Ranked& candidate : after) {
        const SearchPoint& point = tried_[candidate.point];
        if (candidate.merit < worth_testing) break;
        if (point.tested || point.trials < 8) continue;
        if (point_tests_ >= kMostTests) return;
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
    for (int round = 0; round < kRounds && !tried_.over(); ++round) {
      std::vector<TriedPoints::Pending> pending;
      const std::vector<TriedPoints::Ranked> order = tried_.ranked();
      explore(16, kMostTries * 16, pending);
      explore_near(order, 48, pending);
      race(order, 96, 32, 0.5, pending);
      if (!tried_.run_pending(pending)) return;
    }
    for (const TriedPoints::Ranked& candidate : tried_.ranked()) {
      if (tried_[candidate.point].tested) return;  // the first claim's point is the best
      if (tried_[candidate.point].trials < 16) continue;
      if (candidate.merit <= result_.claims.front().merit || point_tests_ >= kMostTests) return;
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
    std::vector<TriedPoints::Pending> pending;
    for (const UnitPoint& place : places) {
      const std::size_t index = tried_.add(place, false);
      numbers.push_back(index);
      for (int t = 0; t < trials && tried_[index].possible; ++t)
        pending.push_back({index, kCommonScenarios + static_cast<std::uint32_t>(t)});
    }
    if (tried_.over() || !tried_.run_pending(pending)) return {};
    std::vector<double> shares;
    for (const std::size_t index : numbers) {
      const SearchPoint& point = tried_[index];
      shares.push_back(point.possible ? static_cast<double>(point.successes) / point.trials : -1.0);
    }
    return shares;
  }

  /// The box: as far along each parameter as its profile succeeds, then peeled until trials all over it succeed often
  /// enough.
  void find_box() {
    if (tried_.over() || result_.profiles.size() != dimensions_) return;
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
    for (int round = 0; round < kRounds && tests < kMostBoxTests && !tried_.over(); ++round) {
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
      for (std::size_t k = 0; k < dimensions_; ++k) box.at.push_back(in_cube(options_, k, 0.5 * (low[k] + high[k])));
      box.merit = share;
      // A claim of its own, with its own tolerated error.
      const std::optional<SearchClaim> claim = tests_.test(box, tests_.error_of(++tests));
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
    std::vector<TriedPoints::Pending> pending;
    std::vector<std::size_t> numbers;
    const std::size_t before = samples.size();
    for (int t = 0; t < count; ++t) {
      UnitPoint at(dimensions_), in_range(dimensions_);
      for (std::size_t k = 0; k < dimensions_; ++k) {
        at[k] = low[k] + (high[k] - low[k]) * draws_.uniform();
        in_range[k] = in_cube(options_, k, at[k]);
      }
      samples.push_back({std::move(at), false});
      const std::size_t index = tried_.add(std::move(in_range), false);
      numbers.push_back(index);
      if (tried_[index].possible) pending.push_back({index, kLocalScenarios + next_local_++});
    }
    if (!tried_.run_pending(pending)) return false;
    for (std::size_t t = 0; t < numbers.size(); ++t) samples[before + t].succeeded = tried_[numbers[t]].successes > 0;
    return true;
  }

  void draw_map(const UnitPoint& centre) {
    if (tried_.over() || result_.fails_alone.size() != dimensions_ || dimensions_ < 2) return;
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
    std::vector<TriedPoints::Ranked> order = tried_.ranked();
    if (order.empty()) {
      for (std::size_t i = 0; i < tried_.size() && order.empty(); ++i)
        if (tried_[i].possible) order.push_back({i, 0.0});
    }
    if (order.empty()) return;
    SearchClaim claim;
    claim.at = tried_[order.front().point].at;
    claim.merit = order.front().merit;
    tests_.look_at(claim);
    result_.nearest = claim;
  }

  const SearchOptions& options_;
  const std::function<void(const SearchClaim&)>& on_claim_;
  const std::function<void(const SearchResult&)>& on_round_;
  std::size_t dimensions_;
  core::SobolNet net_;
  core::RandomStream draws_;
  SearchResult result_;
  TriedPoints tried_;
  ClaimTests tests_;
  std::uint32_t next_in_net_ = 0, next_local_ = 0;
  int point_tests_ = 0;
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
