// SPDX-License-Identifier: Apache-2.0
// What questions cost, and whether what is claimed is true: the search for action parameters against choices that are
// sampled and evaluated one after the other, in the same scenes and the same stepper.
//
//   bench_queries [--quick] [--seeds=N] [--scenes=N] [--runs=N] [--only=PART] [--benchmark_out=PATH]
//
// --seeds: searches a scene (10; quick 2). --scenes: random ones that are predicted (500; quick 20). --runs: plain ones
// of each scene of actions (4096; quick 64). --only: one of predictions, stability, achieve, actions.
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/action_targets.h"
#include "benchmarks/arguments.h"
#include "benchmarks/prediction_targets.h"
#include "benchmarks/report.h"
#include "benchmarks/statistics.h"
#include "prescene/core/text.h"
#include "prescene/queries/achieve_comparison.h"
#include "prescene/service/backends.h"
#include "tests/support/achieve_scenes.h"

namespace prescene::benchmarks {
namespace {

struct Options {
  int seeds = 10;
  int scenes = 500;
  int runs = 4096;
  std::string only;
  int checks = 4000;   // instances that a claim is checked with
  int choices = 1000;  // that the share of good ones is estimated from
  std::string out;
};

struct Measured {
  std::vector<double> seconds, ratios;                        // of the searches that found a choice
  double searched = 0.0, sampled = 0.0, sampled_early = 0.0;  // simulated seconds of these, summed
  int rich_scenes = 0;                                        // in which 1 % of the choices or more reach it
  int searches = 0, found = 0, claims = 0, wrong = 0, boxes = 0, wrong_boxes = 0;
  Table table{"achieve",
              {"scene", "seed", "share of choices that reach it", "first claim s", "instances", "simulated s",
               "sampled: choices", "sampled: simulated s", "rejecting early: simulated s", "P claimed from",
               "P checked", "box: P claimed from", "box: P checked"},
              {}};
};

/// Whether so many successes speak against the wanted probability, beyond chance in the check itself (one in a
/// thousand).
bool is_wrong(const queries::CheckedChoice& checked, double wanted) {
  const double n = checked.instances;
  const double sigma = std::sqrt(wanted * (1.0 - wanted) / n);
  return checked.successes / n < wanted - 3.1 * sigma;
}

core::Status measure(const tests::AchieveProblem& problem, const Options& arguments, service::Backends& backends,
                     core::ThreadPool& pool, Measured* measured) {
  const queries::QueryContext context = backends.query_context(pool);
  PRESCENE_TRY(const double share,
               queries::share_of_choices(problem.scene, 99, problem.query, context, arguments.choices, 40));
  std::fprintf(stderr, "%s: %.2f %% of the choices reach it\n", problem.name.c_str(), 100.0 * share);
  measured->rich_scenes += share >= 0.01;
  belief::AchieveQuery query = problem.query;
  for (int seed = 1; seed <= arguments.seeds; ++seed) {
    const auto number = static_cast<std::uint64_t>(seed);
    const belief::Answer answer = queries::answer(problem.scene, number, {"", query}, context);
    PRESCENE_RETURN_IF_ERROR(answer.error.at(problem.name));
    const auto& achieved = std::get<belief::AchieveAnswer>(answer.what);
    PRESCENE_TRY(const auto plain, queries::sample_and_evaluate(problem.scene, number, query, context, {}));
    queries::SamplingOptions rejecting;
    rejecting.reject_early = true;
    PRESCENE_TRY(const auto early, queries::sample_and_evaluate(problem.scene, number, query, context, rejecting));
    ++measured->searches;
    measured->found += achieved.found;
    const double none = std::numeric_limits<double>::quiet_NaN();
    double checked_share = none, box_low = none, box_share = none;
    if (achieved.found) {
      measured->seconds.push_back(achieved.first_certified_seconds);
      measured->ratios.push_back(plain.simulated_seconds / achieved.first_certified_simulated);
      measured->searched += achieved.first_certified_simulated;
      measured->sampled += plain.simulated_seconds;
      measured->sampled_early += early.simulated_seconds;
      for (const belief::ActionChoice& choice : achieved.choices) {
        PRESCENE_TRY(const auto checked,
                     queries::check_choice(problem.scene, 1000 + number, query, context, choice, arguments.checks));
        ++measured->claims;
        measured->wrong += is_wrong(checked, query.probability);
        checked_share = static_cast<double>(checked.successes) / checked.instances;
      }
      if (achieved.robust) {
        PRESCENE_TRY(const auto checked, queries::check_choice(problem.scene, 1000 + number, query, context,
                                                               *achieved.robust, arguments.checks));
        ++measured->boxes;
        measured->wrong_boxes += is_wrong(checked, query.probability);
        box_low = achieved.robust->lower;
        box_share = static_cast<double>(checked.successes) / checked.instances;
      }
    }
    measured->table.rows.push_back(
        {problem.name, static_cast<std::int64_t>(seed), share, achieved.found ? achieved.first_certified_seconds : none,
         static_cast<std::int64_t>(achieved.first_certified_instances), achieved.first_certified_simulated,
         static_cast<std::int64_t>(plain.choices), plain.simulated_seconds, early.simulated_seconds,
         achieved.found ? achieved.best.lower : none, checked_share, box_low, box_share});
  }
  return core::ok_status();
}

/// Targets of questions that this program does not measure yet.
void add_unmeasured(Report* report) {
  const auto add = [&](const char* work, Better better, Goal must, Goal aim, const char* unit) {
    report->add({.work = work,
                 .better = better,
                 .must = must,
                 .aim = aim,
                 .reached = std::nullopt,
                 .unit = unit,
                 .n = 0,
                 .baseline = "none",
                 .why = "not measured by this program yet"});
  };
  add("explain: right event first, of 300 episodes of 10 kinds", Better::kHigher, at_least(0.90), at_least(0.96), "");
  add("explain: expected calibration error", Better::kLower, at_most(0.05), at_most(0.02), "");
  add("explain: event time", Better::kLower, at_most(0.1), at_most(0.03), "s");
  add("explain: direction of the push", Better::kLower, at_most(20.0), at_most(10.0), "deg");
  add("explain: place of a hidden object within its 90 % region", Better::kWithin, Goal{0.85, 0.95}, Goal{0.88, 0.92},
      "");
  add("explain: 2 s of past, one object of five, to 5 %", Better::kLower, at_most(1.5), at_most(0.4), "s");
}

core::Status measure_achieve(const Options& arguments, Report* report) {
  report->note("Ten scenes of four free parameters (tests/support/achieve_scenes.cc), 240 Hz, all threads.");
  core::ThreadPool pool;
  service::Backends backends(pool);
  Measured measured;
  PRESCENE_TRY(const auto problems, tests::achieve_problems());
  for (const tests::AchieveProblem& problem : problems)
    PRESCENE_RETURN_IF_ERROR(measure(problem, arguments, backends, pool, &measured));
  const std::string searches = std::to_string(measured.found) + " of " + std::to_string(measured.searches) +
                               " searches found a choice; in " + std::to_string(measured.rich_scenes) +
                               " of the scenes 1 % of the choices or more reach it";
  report->add({.work = "achieve: first certified P >= 0.95, 4 free parameters, median",
               .better = Better::kLower,
               .must = at_most(1.0),
               .aim = at_most(0.2),
               .reached = measured.seconds.empty() ? std::nullopt : std::optional(median(measured.seconds)),
               .unit = "s",
               .n = measured.found,
               .baseline = "none",
               .why = searches + "; making the simulator is counted"});
  const auto over_all = [&](double sampled) {
    return measured.searched > 0.0 ? std::optional(sampled / measured.searched) : std::nullopt;
  };
  const std::string median_text =
      measured.ratios.empty() ? ""
                              : "; the median of single searches is " + core::rounded_text(median(measured.ratios));
  report->add({.work = "achieve: instance-seconds to it against sample-and-evaluate, all searches together",
               .must = at_least(8.0),
               .aim = at_least(20.0),
               .reached = over_all(measured.sampled),
               .unit = "x less",
               .n = measured.found,
               .baseline = "choices at random, each by the plain estimator to +-0.02, same starts and stepper",
               .why = searches + median_text});
  report->add({.work = "achieve: the same against sampling that leaves a choice once its interval is below 0.95",
               .must = std::nullopt,
               .aim = std::nullopt,
               .reached = over_all(measured.sampled_early),
               .unit = "x less",
               .n = measured.found,
               .baseline = "as above, with early rejection",
               .why = "reported only"});
  report->add({.work = "achieve: claims of P >= 0.95 that are false",
               .better = Better::kLower,
               .must = at_most(0.05),
               .aim = at_most(0.03),
               .reached = measured.claims == 0 ? std::nullopt
                                               : std::optional(static_cast<double>(measured.wrong) / measured.claims),
               .unit = "",
               .n = measured.claims,
               .baseline = std::to_string(arguments.checks) + " fresh instances of each",
               .why = std::to_string(measured.wrong_boxes) + " of " + std::to_string(measured.boxes) +
                      " neighbourhoods were false; a thousand claims on known probabilities are a test"});
  std::printf("%s\n", text_of(measured.table).c_str());
  report->add(std::move(measured.table));
  return core::ok_status();
}

int run(const Options& arguments) {
  const auto wanted = [&](std::string_view part) { return arguments.only.empty() || arguments.only == part; };
  if (!wanted("predictions") && !wanted("stability") && !wanted("achieve") && !wanted("actions")) {
    std::fprintf(stderr, "--only: give one of predictions, stability, achieve, actions\n");
    return 2;
  }
  Report report("queries", best_simd_target());
  const auto add = [&](Table table) {
    std::printf("%s\n", text_of(table).c_str());
    report.add(std::move(table));
  };
  if (wanted("stability")) add(measure_stability_time(arguments.seeds, &report));
  if (wanted("predictions")) add(measure_prediction_calibration(arguments.scenes, &report));
  if (wanted("actions")) add(measure_actions(arguments.runs, &report));
  if (wanted("achieve")) {
    const core::Status status = measure_achieve(arguments, &report);
    if (!status.ok()) {
      std::fprintf(stderr, "%s\n", core::to_string(status).c_str());
      return 1;
    }
  }
  if (arguments.only.empty()) add_unmeasured(&report);
  std::fputs(report.text().c_str(), stdout);
  return report.finish(arguments.out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::Options options;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] {
    options.seeds = 2;
    options.scenes = 20;
    options.runs = 64;
    options.checks = 1000;
    options.choices = 300;
  });
  arguments.number("seeds", 1, 1e6, &options.seeds);
  arguments.number("scenes", 1, 1e6, &options.scenes);
  arguments.number("runs", 16, 1e6, &options.runs);
  arguments.text("only", "PART", &options.only);
  arguments.text("benchmark_out", "PATH", &options.out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(options) : 2;
}
