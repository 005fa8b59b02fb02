// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/action_targets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "benchmarks/plain_runs.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/backends.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

constexpr double kPlainStep = 1.0 / 2000;  // s
constexpr double kTolerance = 0.005;
constexpr double kDoubt = 0.05;  // that some interval of a scene misses
constexpr std::array kScenes = {"slipped_carton", "bumped_mug",        "bottle_pushed_unseen", "drawer_opened",
                                "balls_poured",   "canister_inserted", "stack_of_three",       "upright_on_shelf"};

struct Interval {
  double low = 0.0, high = 1.0;
};
/// Wilson's, of `hits` among n; z standard errors to each side.
Interval wilson(double hits, double n, double z) {
  const double share = hits / n, scale = 1.0 + z * z / n;
  const double middle = (share + 0.5 * z * z / n) / scale;
  const double half = z / scale * std::sqrt(share * (1.0 - share) / n + 0.25 * z * z / (n * n));
  // Without hits, or with nothing else, one end is exact but for rounding.
  return {hits > 0.0 ? middle - half : 0.0, hits < n ? middle + half : 1.0};
}

/// Adds a row for each of the scene's probabilities. Returns whether all agree.
bool compare(const std::string& name, int runs, core::ThreadPool& pool, Table* table) {
  auto read = interfaces::read_scene(tests::source_dir() / "scenarios" / (name + ".yaml"));
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
  const auto scene = std::make_shared<const belief::Scene>(*std::move(read));
  service::Backends backends(pool);
  belief::PredictQuery query;
  query.effort.tolerance = kTolerance;
  const belief::Answer answer = queries::answer(scene, 1, {"", query}, backends.query_context(pool));
  PRESCENE_CHECK_MSG(answer.error.ok(), answer.error.message());
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  const std::vector<belief::Trajectory> plain = plain_runs(*scene, runs, kPlainStep, 2, pool);

  const double z = -core::inverse_normal_cdf(0.5 * kDoubt / static_cast<double>(predicted.outcomes.size()));
  bool agree = true;
  for (const simulation::Variable& variable :
       simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes)) {
    for (std::size_t c = 0; c < variable.classes.size(); ++c) {
      for (const belief::OutcomeProbability& outcome : predicted.outcomes) {
        if (outcome.name != variable.classes[c] || (!outcome.group.empty() && outcome.group != variable.name)) continue;
        double hits = 0.0;
        for (const belief::Trajectory& run : plain) hits += variable.classify(run) == static_cast<int>(c) ? 1.0 : 0.0;
        const Interval interval = wilson(hits, runs, z);
        const bool within = interval.low <= outcome.probability && outcome.probability <= interval.high;
        agree = agree && within;
        table->rows.push_back({name, outcome.name, outcome.probability, static_cast<std::int64_t>(predicted.instances),
                               predicted.stepper, hits / runs, interval.low, interval.high,
                               std::string(within ? "yes" : "no")});
      }
    }
  }
  return agree;
}

}  // namespace

Table measure_actions(int runs, Report* report) {
  Table table{"actions", {"scene", "outcome", "P", "instances", "stepper", "plain runs", "from", "to", "within"}, {}};
  core::ThreadPool pool;
  int agree = 0;
  for (const char* name : kScenes) {
    std::fprintf(stderr, "actions: %s\n", name);
    agree += compare(name, runs, pool, &table) ? 1 : 0;
  }
  report->add({.work = "actions: scenes whose probabilities are all within the interval of plain runs",
               .better = Better::kHigher,
               .must = at_least(8.0),
               .aim = at_least(8.0),
               .reached = static_cast<double>(agree),
               .unit = "of 8 scenes",
               .n = runs,
               .baseline = "Bullet's stepper at 1/2000 s",
               .why = "n: plain runs of each scene"});
  return table;
}

}  // namespace prescene::benchmarks
