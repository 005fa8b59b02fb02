// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/evolution_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace prescene::tests {
namespace {

using simulation::SearchParameter;
using simulation::SearchResult;

SearchResult evolution_search(const std::vector<SearchParameter>& parameters,
                              const simulation::EvolutionSearch::Cost& cost, const simulation::SearchEnd& end,
                              int max_evaluations, core::RandomStream stream,
                              const simulation::SearchProgress& progress = {}) {
  simulation::EvolutionSearch search(parameters, end, stream);
  search.run(cost, max_evaluations, progress);
  return search.best();
}

core::RandomStream stream(std::uint64_t seed) { return {seed, core::Purpose::kTest}; }

std::vector<SearchParameter> parameters(std::size_t count, double start, double step, double low, double high) {
  return std::vector<SearchParameter>(count, {"p", start, step, low, high});
}

/// Axes of lengths 1 to 1000, turned by 30 degrees in each plane of neighbours, with its minimum 0 at 0.7.
double turned_ellipsoid(std::span<const double> x) {
  std::vector<double> y(x.begin(), x.end());
  for (double& value : y) value -= 0.7;
  for (std::size_t i = 0; i + 1 < y.size(); ++i) {
    const double a = 0.866 * y[i] - 0.5 * y[i + 1];
    y[i + 1] = 0.5 * y[i] + 0.866 * y[i + 1];
    y[i] = a;
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i)
    sum += std::pow(10.0, 6.0 * static_cast<double>(i) / static_cast<double>(y.size() - 1)) * y[i] * y[i];
  return sum;
}

double rosenbrock(std::span<const double> x) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i)
    sum += 100.0 * std::pow(x[i + 1] - x[i] * x[i], 2) + std::pow(1.0 - x[i], 2);
  return sum;
}

TEST(EvolutionSearch, FindsTheMiddleOfATurnedEllipsoid) {
  const SearchResult found =
      evolution_search(parameters(8, 0.0, 0.5, -10.0, 10.0), turned_ellipsoid, {1e-6}, 20000, stream(1));
  for (const double value : found.values) EXPECT_NEAR(value, 0.7, 1e-3);
  EXPECT_LT(found.evaluations, 20000);
}

TEST(EvolutionSearch, FollowsABentValley) {
  const SearchResult found =
      evolution_search(parameters(5, -0.5, 0.3, -5.0, 5.0), rosenbrock, {1e-6}, 30000, stream(2));
  for (const double value : found.values) EXPECT_NEAR(value, 1.0, 1e-3);
}

TEST(EvolutionSearch, StaysWithinBoundsAndFindsAMinimumOnThem) {
  int outside = 0;
  const auto cost = [&](std::span<const double> x) {
    for (const double value : x) outside += value < 0.2 || value > 1.0 ? 1 : 0;
    return x[0] + 2.0 * x[1] - x[2];
  };
  const SearchResult found = evolution_search(parameters(3, 0.5, 0.5, 0.2, 1.0), cost, {1e-4}, 5000, stream(3));
  EXPECT_EQ(outside, 0);
  EXPECT_NEAR(found.values[0], 0.2, 1e-2);
  EXPECT_NEAR(found.values[1], 0.2, 1e-2);
  EXPECT_NEAR(found.values[2], 1.0, 1e-2);
}

TEST(EvolutionSearch, TheSameSeedTriesTheSame) {
  const auto run = [](std::uint64_t seed) {
    std::vector<double> tried;
    const auto cost = [&](std::span<const double> x) {
      tried.push_back(x[0]);
      return turned_ellipsoid(x);
    };
    evolution_search(parameters(4, 0.0, 0.5, -10.0, 10.0), cost, {1e-3}, 200, stream(seed));
    return tried;
  };
  EXPECT_EQ(run(5), run(5));
  EXPECT_NE(run(5), run(6));
}

TEST(EvolutionSearch, EndsAtItsAccuracyItsEvaluationsOrWhenTold) {
  const auto all = parameters(4, 0.0, 0.5, -10.0, 10.0);
  const SearchResult rough = evolution_search(all, turned_ellipsoid, {1e-1}, 100000, stream(1));
  const SearchResult fine = evolution_search(all, turned_ellipsoid, {1e-5}, 100000, stream(1));
  EXPECT_LT(rough.evaluations, fine.evaluations);
  EXPECT_LT(fine.cost, rough.cost);
  EXPECT_EQ(evolution_search(all, turned_ellipsoid, {1e-9}, 77, stream(1)).evaluations, 77);
  const auto stop = [](const SearchResult& best) { return best.evaluations < 20; };
  EXPECT_EQ(evolution_search(all, turned_ellipsoid, {1e-9}, 1000, stream(1), stop).evaluations, 20);
}

TEST(EvolutionSearch, SaysWhetherItSettledOrWasCut) {
  const auto all = parameters(4, 0.0, 0.5, -10.0, 10.0);
  EXPECT_TRUE(evolution_search(all, turned_ellipsoid, {1e-1}, 100000, stream(1)).settled);
  EXPECT_FALSE(evolution_search(all, turned_ellipsoid, {1e-9}, 77, stream(1)).settled);
  // Where nothing is to be gained, its patience ends it.
  const auto flat = [](std::span<const double>) { return 1.0; };
  const SearchResult patient = evolution_search(all, flat, {1e-9, 100, 0.01}, 1000, stream(1));
  EXPECT_TRUE(patient.settled);
  EXPECT_GE(patient.evaluations, 100);
  EXPECT_LT(patient.evaluations, 120);
  EXPECT_FALSE(evolution_search(all, flat, {1e-9, 100, 0.01}, 50, stream(1)).settled);
}

TEST(EvolutionSearch, GoesOnWhereItStopped) {
  const auto all = parameters(4, 0.0, 0.5, -10.0, 10.0);
  simulation::EvolutionSearch search(all, {1e-2}, stream(1));
  // Generations of eight, after the start.
  search.run(turned_ellipsoid, 81);
  EXPECT_EQ(search.best().evaluations, 81);
  search.run(turned_ellipsoid, 100000);
  const SearchResult at_once = evolution_search(all, turned_ellipsoid, {1e-2}, 100000, stream(1));
  EXPECT_EQ(search.best().cost, at_once.cost);
  EXPECT_EQ(search.best().evaluations, at_once.evaluations);
}

TEST(EvolutionSearch, TriesNothingWithoutABudget) {
  const auto all = parameters(4, 0.0, 0.5, -10.0, 10.0);
  simulation::EvolutionSearch search(all, {1e-2}, stream(1));
  for (const int budget : {-3, 0}) {
    search.run(turned_ellipsoid, budget);
    EXPECT_EQ(search.best().evaluations, 0);
  }
  search.run(turned_ellipsoid, 1);
  EXPECT_EQ(search.best().evaluations, 1);
}

TEST(EvolutionSearch, ReturnsTheBestThatItTried) {
  double least = 1e300;
  const auto cost = [&](std::span<const double> x) {
    const double value = turned_ellipsoid(x) + 50.0 * std::sin(20.0 * x[0]);
    least = std::min(least, value);
    return value;
  };
  const SearchResult found = evolution_search(parameters(3, 0.0, 0.5, -2.0, 2.0), cost, {1e-3}, 500, stream(4));
  EXPECT_EQ(found.cost, least);
  EXPECT_EQ(cost(found.values), least);
}

}  // namespace
}  // namespace prescene::tests
