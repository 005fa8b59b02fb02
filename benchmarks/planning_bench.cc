// SPDX-License-Identifier: Apache-2.0
// Which share of a planner's time is collision checking: OMPL's RRTConnect with our discrete and our continuous
// queries, and with FCL.
//
//   bench_planning [--quick] [--seeds=N] [--benchmark_out=PATH]
//
// --seeds: searches a problem and way of checking (20; quick 3), the same for all ways.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/arguments.h"
#include "benchmarks/planning_problems.h"
#include "benchmarks/report.h"
#include "benchmarks/statistics.h"

namespace prescene::benchmarks {
namespace {

constexpr std::array<std::pair<Checking, const char*>, 3> kWays = {{{Checking::kSampled, "ours, sampled"},
                                                                    {Checking::kSampledFcl, "FCL, sampled"},
                                                                    {Checking::kContinuous, "ours, continuous"}}};

struct Sums {
  std::vector<double> seconds, shares;
  double states = 0.0, motions = 0.0, all_seconds = 0.0, checking = 0.0;
  std::int64_t found = 0, bad = 0;
};

Sums measure(const PlanningProblem& problem, Checking checking, int seeds) {
  Sums sums;
  for (int seed = 1; seed <= seeds; ++seed) {
    const PlanningRun run = plan(problem, checking, static_cast<std::uint32_t>(seed));
    sums.found += run.found;
    sums.bad += run.bad_motions > 0;
    sums.seconds.push_back(run.seconds);
    sums.shares.push_back(run.share);
    sums.states += static_cast<double>(run.states);
    sums.motions += static_cast<double>(run.motions);
    sums.all_seconds += run.seconds;
    sums.checking += run.seconds * run.share;
  }
  return sums;
}

int run(int seeds, const std::string& out) {
  Report report("planning", best_simd_target());
  report.note("OMPL's RRTConnect as it comes; the sampled ways check every 1 % of the space, which is OMPL's default.");
  report.note(
      "Times are processor time of one thread; shares are of wall time. Ways of checking take turns problem by "
      "problem.");
  Table table{"planning",
              {"problem", "checking", "searches", "paths found", "median ms", "share of checks", "states a search",
               "motions a search", "us a state or motion", "paths that collide"},
              {}};
  for (const PlanningProblem& problem : planning_problems()) {
    std::vector<Sums> all;
    for (const auto& [checking, name] : kWays) {
      std::fprintf(stderr, "%s: %s\n", problem.name.c_str(), name);
      const Sums sums = measure(problem, checking, seeds);
      const double checks = checking == Checking::kContinuous ? sums.motions : sums.states;
      table.rows.push_back({problem.name, std::string(name), static_cast<std::int64_t>(seeds), sums.found,
                            1e3 * median(sums.seconds), median(sums.shares), sums.states / seeds, sums.motions / seeds,
                            1e6 * sums.checking / std::max(1.0, checks), sums.bad});
      report.add({.work = "share of the time that is collision checking, " + std::string(name) + ": " + problem.name,
                  .better = Better::kLower,
                  .must = std::nullopt,
                  .aim = std::nullopt,
                  .reached = median(sums.shares),
                  .unit = "",
                  .n = seeds,
                  .baseline = "none"});
      all.push_back(sums);
    }
    report.add({.work = "planning with sampled motions: " + problem.name,
                .must = std::nullopt,
                .aim = std::nullopt,
                .reached = all[1].all_seconds / all[0].all_seconds,
                .unit = "x",
                .n = seeds,
                .baseline = "FCL for the same states, the same seeds"});
    report.add({.work = "checking with sampled motions: " + problem.name,
                .must = std::nullopt,
                .aim = std::nullopt,
                .reached = all[1].checking / all[0].checking,
                .unit = "x",
                .n = seeds,
                .baseline = "FCL for the same states, the same seeds"});
    report.add({.work = "planning with continuous motions: " + problem.name,
                .must = std::nullopt,
                .aim = std::nullopt,
                .reached = all[1].all_seconds / all[2].all_seconds,
                .unit = "x",
                .n = seeds,
                .baseline = "FCL with sampled motions, the same seeds"});
  }
  std::printf("%s\n%s", text_of(table).c_str(), report.text().c_str());
  report.add(std::move(table));
  return report.finish(out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  int seeds = 20;
  std::string out;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] { seeds = 3; });
  arguments.number("seeds", 1, 1e6, &seeds);
  arguments.text("benchmark_out", "PATH", &out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(seeds, out) : 2;
}
