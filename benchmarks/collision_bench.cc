// SPDX-License-Identifier: Apache-2.0
// Compares our collision trees with other libraries and with their targets.
//
//   bench_collision [--quick] [--part=PART[,PART]...] [--only=NAME[,NAME]...] [--benchmark_out=PATH]
//
// --quick takes about a minute. --part: of queries, study (settings of our trees), cold (trees in no cache; not if
// quick) and spheres. --only measures just the queries of algorithms whose name contains one of the NAMEs, and of FCL.
#include <hwy/targets.h>
#include <sched.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/arguments.h"
#include "benchmarks/collision_algorithms.h"
#include "benchmarks/collision_measure.h"
#include "benchmarks/collision_plots.h"
#include "benchmarks/collision_tables.h"
#include "benchmarks/collision_targets.h"
#include "benchmarks/report.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

struct Options {
  bool quick = false;
  std::vector<std::string> parts;  ///< All if empty.
  std::vector<std::string> only;
  std::string out;

  bool wants(std::string_view part) const {
    if (!only.empty()) return part == "queries";
    return parts.empty() || std::find(parts.begin(), parts.end(), part) != parts.end();
  }
};

std::vector<Algorithm> chosen_algorithms(const Options& arguments) {
  std::vector<Algorithm> algorithms = our_algorithms();
  for (Algorithm& peer : peer_algorithms()) algorithms.push_back(std::move(peer));
  if (arguments.only.empty()) return algorithms;
  std::erase_if(algorithms, [&](const Algorithm& algorithm) {
    return algorithm.name != kFcl &&
           std::none_of(arguments.only.begin(), arguments.only.end(),
                        [&](const std::string& name) { return algorithm.name.find(name) != std::string::npos; });
  });
  return algorithms;
}

/// Queries run on one processor, the first that this program may use.
void stay_on_one_processor() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof(allowed), &allowed) != 0) return;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &allowed)) continue;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    sched_setaffinity(0, sizeof(one), &one);
    return;
  }
}

Measurements measure(const std::vector<tests::MeshPair>& pairs, const std::vector<Algorithm>& algorithms,
                     const std::vector<double>& shares, const MeasureOptions& options) {
  Measurements measurements;
  for (const tests::MeshPair& pair : pairs) {
    std::fprintf(stderr, "%s (%u and %u triangles): %zu algorithms\n", pair.name.c_str(), pair.a->triangle_count(),
                 pair.b->triangle_count(), algorithms.size());
    measure_pair(pair, algorithms, shares, options, &measurements);
  }
  return measurements;
}

/// Other settings of our trees, on a few pairs of middle size.
Measurements measure_study(const std::vector<tests::MeshPair>& pairs, const Options& arguments) {
  MeasureOptions options;
  options.configurations = arguments.quick ? 4 : 16;
  options.rounds = 3;
  std::vector<tests::MeshPair> chosen;
  for (const tests::MeshPair& pair : pairs) {
    const std::uint32_t triangles = pair.a->triangle_count() + pair.b->triangle_count();
    if (triangles > 20'000 && triangles < 150'000) chosen.push_back(pair);
  }
  if (arguments.quick) chosen.resize(std::min<std::size_t>(chosen.size(), 2));
  std::vector<Algorithm> algorithms = study_algorithms();
  // Whose distances place the bodies.
  for (Algorithm& peer : peer_algorithms())
    if (peer.name == kFcl) algorithms.push_back(std::move(peer));
  return measure(chosen, algorithms, {0.0, 0.01, 0.05}, options);
}

/// Only the queries by themselves.
Table without_repeats(Table table) {
  std::erase_if(table.rows, [](const std::vector<Figure>& row) { return row[1] != Figure("boolean"); });
  return table;
}

/// A million triangles, with cold caches.
Measurements measure_cold() {
  MeasureOptions options;
  options.configurations = 12;
  options.rounds = 3;
  options.cold = true;
  std::vector<Algorithm> algorithms = our_algorithms();
  for (Algorithm& peer : peer_algorithms()) algorithms.push_back(std::move(peer));
  std::erase_if(algorithms, [](const Algorithm& algorithm) { return algorithm.slow; });
  const std::vector<tests::MeshPair> pair = {
      {"bumpy_sphere / knot, 1M", tests::collision_mesh(tests::make_bumpy_sphere(0.1, 1'000'000), "bumpy_sphere_1M"),
       tests::collision_mesh(tests::make_knot(0.1, 1'000'000), "knot_1M")}};
  return measure(pair, algorithms, {0.0, 0.01, 0.05}, options);
}

void show(const char* title, const Table& table) {
  if (table.rows.empty()) return;
  std::printf("%s\n%s\n", title, text_of(table).c_str());
}

/// What was measured; without cells where it was not wanted.
struct Results {
  Measurements queries, study, cold;
};

Results measure_all(const Options& arguments, Report* report) {
  std::vector<tests::MeshPair> pairs = tests::recorded_mesh_pairs();
  if (pairs.empty()) {
    report->note(tests::missing_data_message("meshes"));
    report->note("So only shapes made here are measured.");
  }
  for (tests::MeshPair& pair : tests::made_mesh_pairs()) pairs.push_back(std::move(pair));
  report->note(
      "Queries are clocked one by one in streams of different poses, the smallest of some rounds, on one processor.");

  // Uses all processors, so before the rest is bound to one.
  if (arguments.wants("queries")) add_build_targets(report);
  stay_on_one_processor();

  MeasureOptions options;
  std::vector<double> shares = all_shares();
  if (arguments.quick) {
    options.configurations = 10;
    options.batches = 3;
    options.rounds = 5;
    shares = {0.0, 0.01, 0.05, -0.01};
  }
  Results results;
  if (arguments.wants("queries")) {
    results.queries = measure(pairs, chosen_algorithms(arguments), shares, options);
    add_query_targets(results.queries, report);
    add_memory_targets(results.queries, report);
  }
  if (arguments.wants("study")) {
    results.study = measure_study(pairs, arguments);
    add_study_targets(results.study, report);
  }
  if (arguments.wants("cold") && !arguments.quick) {
    results.cold = measure_cold();
    add_cold_targets(results.cold, report);
  }
  if (arguments.wants("spheres")) add_sphere_targets(arguments.quick, report);
  return results;
}

void print(const Report& report, const Results& results) {
  std::puts(report.text().c_str());
  show("Median times in microseconds, geometric means over pairs", summary_table(results.queries));
  show("Other settings, likewise over pairs of 20,000 to 150,000 triangles",
       without_repeats(summary_table(results.study)));
  show("Two meshes of a million triangles, caches cold", without_repeats(summary_table(results.cold)));
  show("Default tree by instruction set: median times in microseconds", target_table(results.queries));
  show("Answers against the exact reference", wrong_answer_counts(results.queries));
}

void add_raw_figures(const Results& results, Report* report) {
  const auto add = [&](const std::string& prefix, Table table) {
    table.name = prefix + table.name;
    report->add(std::move(table));
  };
  for (const auto& [prefix, measurements] :
       {std::pair("", &results.queries), std::pair("study_", &results.study), std::pair("cold_", &results.cold)}) {
    add(prefix, summary_table(*measurements));
    add(prefix, query_table(*measurements));
    add(prefix, cost_table(*measurements));
    add(prefix, wrong_answer_counts(*measurements));
    add(prefix, wrong_answer_table(*measurements));
    add(prefix, distance_difference_table(*measurements));
  }
  report->add(target_table(results.queries));
  report->add(ratio_table(results.queries));
  for (Plot& plot : query_plots(results.queries)) report->add(std::move(plot));
  for (Plot& plot : study_plots(results.study)) report->add(std::move(plot));
}

int run(const Options& arguments) {
  Report report("collision", best_simd_target());
  const Results results = measure_all(arguments, &report);
  print(report, results);
  if (arguments.out.empty()) return 0;
  add_raw_figures(results, &report);
  return report.finish(arguments.out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::Options options;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] { options.quick = true; });
  arguments.list("part", "PART", &options.parts);
  arguments.list("only", "NAME", &options.only);
  arguments.text("benchmark_out", "PATH", &options.out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(options) : 2;
}
