// SPDX-License-Identifier: Apache-2.0
// Compares our collision trees with other libraries and with their targets.
//
//   bench_collision [--quick] [--only=NAME[,NAME]...] [--benchmark_out=PATH]
//
// --quick takes about a minute; --only measures just the algorithms whose name contains one of the NAMEs, and FCL.
#include <sched.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/benchmarks/collision_algorithms.h"
#include "prescene/benchmarks/collision_measure.h"
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

std::string simd_target() {
  const std::int64_t supported = hwy::SupportedTargets();
  return hwy::TargetName(supported & -supported);  // the lowest bit is the best one
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

int run(const Arguments& arguments) {
  Report report("collision", simd_target());
  std::vector<tests::MeshPair> pairs = tests::recorded_mesh_pairs();
  if (pairs.empty()) report.note(tests::missing_data_message("meshes") + " Only shapes made here are measured.");
  for (tests::MeshPair& pair : tests::made_mesh_pairs()) pairs.push_back(std::move(pair));

  // Uses all processors, so before the rest is bound to one.
  add_build_targets(&report);
  stay_on_one_processor();

  MeasureOptions options;
  std::vector<double> shares = all_shares();
  if (arguments.quick) {
    options.configurations = 8;
    options.rounds = 3;
    shares = {0.0, 0.01, 0.05, -0.01};
  }
  const std::vector<Algorithm> algorithms = chosen_algorithms(arguments);
  Measurements measurements;
  for (const tests::MeshPair& pair : pairs) {
    std::fprintf(stderr, "%s (%u and %u triangles)\n", pair.name.c_str(), pair.a->triangle_count(),
                 pair.b->triangle_count());
    measure_pair(pair, algorithms, shares, options, &measurements);
  }
  add_query_targets(measurements, &report);
  add_memory_targets(measurements, &report);

  std::puts(report.text().c_str());
  const Table summary = summary_table(measurements), answers = wrong_answer_counts(measurements);
  std::printf("Median times in microseconds, geometric means over %zu pairs\n%s\n", pairs.size(),
              text_of(summary).c_str());
  std::printf("Answers against the exact reference\n%s\n", text_of(answers).c_str());
  if (arguments.out.empty()) return 0;
  report.add(summary);
  report.add(answers);
  report.add(ratio_table(measurements));
  report.add(query_table(measurements));
  report.add(cost_table(measurements));
  report.add(wrong_answer_table(measurements));
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
