// SPDX-License-Identifier: Apache-2.0
// Compares our collision trees with other libraries and with their targets.
//
//   bench_collision [--quick] [--only=NAME[,NAME]...] [--benchmark_out=PATH]
//
// --quick takes about a minute; --only measures just the algorithms whose name contains one of the NAMEs, and FCL, and
// leaves out the study of settings.
#include <sched.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/benchmarks/collision_algorithms.h"
#include "prescene/benchmarks/collision_measure.h"
#include "prescene/benchmarks/collision_plots.h"
#include "prescene/benchmarks/collision_tables.h"
#include "prescene/benchmarks/collision_targets.h"
#include "prescene/benchmarks/report.h"
#include "prescene/tests/support/collision_meshes.h"
#include "prescene/tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

struct Arguments {
  bool quick = false;
  std::vector<std::string> only;
  std::string out;
};

bool parse(int count, char** words, Arguments* arguments) {
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    if (word == "--quick") {
      arguments->quick = true;
    } else if (word.starts_with("--benchmark_out=")) {
      arguments->out = word.substr(word.find('=') + 1);
    } else if (word.starts_with("--only=")) {
      std::string_view names = word.substr(word.find('=') + 1);
      while (!names.empty()) {
        const std::size_t comma = std::min(names.find(','), names.size());
        arguments->only.emplace_back(names.substr(0, comma));
        names.remove_prefix(std::min(comma + 1, names.size()));
      }
    } else {
      std::fprintf(stderr, "usage: %s [--quick] [--only=NAME[,NAME]...] [--benchmark_out=PATH]\n", words[0]);
      return false;
    }
  }
  return true;
}

std::vector<Algorithm> chosen_algorithms(const Arguments& arguments) {
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

/// The best instruction set that the machine has and the kernels are compiled for.
std::string simd_target() { return hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()); }

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
Measurements measure_study(const std::vector<tests::MeshPair>& pairs, const Arguments& arguments) {
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
Table without_turns(Table table) {
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

void show(const char* title, const Table& table) { std::printf("%s\n%s\n", title, text_of(table).c_str()); }

int run(const Arguments& arguments) {
  Report report("collision", simd_target());
  std::vector<tests::MeshPair> pairs = tests::recorded_mesh_pairs();
  if (pairs.empty()) report.note(tests::missing_data_message("meshes") + " Only shapes made here are measured.");
  for (tests::MeshPair& pair : tests::made_mesh_pairs()) pairs.push_back(std::move(pair));
  report.note(
      "Queries are clocked one by one in streams of different poses, the smallest of some rounds, on one processor.");

  // Uses all processors, so before the rest is bound to one.
  add_build_targets(&report);
  stay_on_one_processor();

  MeasureOptions options;
  std::vector<double> shares = all_shares();
  if (arguments.quick) {
    options.configurations = 10;
    options.batches = 3;
    options.rounds = 5;
    shares = {0.0, 0.01, 0.05, -0.01};
  }
  const Measurements measurements = measure(pairs, chosen_algorithms(arguments), shares, options);
  add_query_targets(measurements, &report);
  add_memory_targets(measurements, &report);
  Measurements study, cold;
  if (arguments.only.empty()) {
    study = measure_study(pairs, arguments);
    add_study_targets(study, &report);
    if (!arguments.quick) cold = measure_cold();
    add_cold_targets(cold, &report);
  }

  std::puts(report.text().c_str());
  show("Median times in microseconds, geometric means over pairs", summary_table(measurements));
  if (!study.cells.empty())
    show("Other settings, likewise over pairs of 20,000 to 150,000 triangles", without_turns(summary_table(study)));
  if (!cold.cells.empty()) show("Two meshes of a million triangles, caches cold", without_turns(summary_table(cold)));
  show("Default tree by instruction set: median times in microseconds", target_table(measurements));
  show("Answers against the exact reference", wrong_answer_counts(measurements));
  if (arguments.out.empty()) return 0;

  for (Table table : {summary_table(measurements), wrong_answer_counts(measurements), target_table(measurements),
                      ratio_table(measurements), query_table(measurements), cost_table(measurements),
                      wrong_answer_table(measurements)})
    report.add(std::move(table));
  for (Table table : {summary_table(study), wrong_answer_counts(study), query_table(study), cost_table(study)}) {
    table.name = "study_" + table.name;
    report.add(std::move(table));
  }
  for (Table table : {summary_table(cold), query_table(cold), cost_table(cold)}) {
    table.name = "cold_" + table.name;
    report.add(std::move(table));
  }
  for (Plot& plot : query_plots(measurements)) report.add(std::move(plot));
  if (!study.cells.empty())
    for (Plot& plot : study_plots(study)) report.add(std::move(plot));
  const core::Status status = report.write(arguments.out);
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.message().c_str());
  return status.ok() ? 0 : 1;
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::Arguments arguments;
  if (!prescene::benchmarks::parse(count, words, &arguments)) return 2;
  return prescene::benchmarks::run(arguments);
}
