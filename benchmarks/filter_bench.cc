// SPDX-License-Identifier: Apache-2.0
// What the filter reaches: physics that stays uncertain and is learned, tracking and finding where the truth is known,
// confidence, cost and memory.
//
//   bench_filter [--all] [--only=PART] [--seed=N] [--sequences=N] [--benchmark_out=PATH]
//
// --all: as many seeds, frames and rooms as the targets ask for, which takes hours. --seed: the first seed (301).
// --sequences: of each kind of the simulated suite (2). --only: memory, cost, physics, tracking or finding alone, or
// worlds, which is not among the others: particles that are worlds against independent ones where objects touch.
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <thread>

#include "benchmarks/arguments.h"
#include "benchmarks/filter_targets.h"
#include "benchmarks/filter_worlds.h"
#include "prescene/core/clock.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

struct FilterOptions {
  FilterEffort effort;
  std::string out;
  std::string only;  // "" = all parts
};

int run(const FilterOptions& arguments) {
  const FilterEffort& effort = arguments.effort;
  core::ThreadPool threads(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  Report report("filter", best_simd_target());
  report.note("seeds from " + std::to_string(effort.seed) + " on; settings were chosen on others");
  const core::Stopwatch watch;
  const auto part = [&](const char* what, const auto& add) {
    if (!arguments.only.empty() && arguments.only != what) return true;
    const core::Status status = add();
    std::fprintf(stderr, "%s: %s, %.0f s so far\n", what, status.ok() ? "done" : status.message().c_str(),
                 watch.seconds());
    return status.ok();
  };
  const bool good =
      part("memory", [&] { return add_memory_targets(effort, threads, &report); }) &&
      part("cost", [&] { return add_cost_targets(effort, threads, &report); }) &&
      part("physics", [&] { return add_physics_targets(effort, threads, &report); }) &&
      part("tracking",
           [&] { return add_tracking_targets(effort, tests::data_dir("carried_cube"), threads, &report); }) &&
      part("finding", [&] { return add_finding_targets(effort, tests::data_dir("ycb_video"), threads, &report); });
  if (arguments.only == "worlds") {
    const Table worlds = worlds_table(effort.seed, effort.sequences, threads);
    std::fputs(text_of(worlds).c_str(), stdout);
    report.add(worlds);
  }
  std::fputs(report.text().c_str(), stdout);
  const int written = report.finish(arguments.out);
  return good ? written : 1;
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::FilterOptions options;
  int seed = static_cast<int>(options.effort.seed);
  prescene::benchmarks::Arguments arguments;
  arguments.flag("all", [&] { options.effort = prescene::benchmarks::whole_filter_effort(); });
  arguments.one_of("only", {"memory", "cost", "physics", "tracking", "finding", "worlds"}, &options.only);
  arguments.number("seed", 1, 1e9, &seed);
  arguments.number("sequences", 1, 1000, &options.effort.sequences);
  arguments.text("benchmark_out", "PATH", &options.out);
  if (!arguments.parse(count, words)) return 2;
  options.effort.seed = static_cast<std::uint64_t>(seed);
  return prescene::benchmarks::run(options);
}
