// SPDX-License-Identifier: Apache-2.0
// What the filter reaches: physics that stays uncertain and is learned, tracking and finding where the truth is known,
// confidence, cost and memory.
//
//   bench_filter [--all] [--only=PART] [--seed=N] [--sequences=N] [--benchmark_out=PATH]
//
// --all: as many seeds, frames and rooms as the targets ask for, which takes hours. --seed: the first seed (301).
// --sequences: of each kind of the simulated suite (2). --only: memory, cost, physics, tracking or finding alone.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>

#include "benchmarks/filter_targets.h"
#include "prescene/core/clock.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

struct FilterArguments {
  FilterEffort effort;
  std::string out;
  std::string only;  // "" = all parts
};

constexpr std::array<std::string_view, 5> kParts = {"memory", "cost", "physics", "tracking", "finding"};

bool parse(int count, char** words, FilterArguments* arguments) {
  for (int i = 1; i < count; ++i)
    if (std::string_view(words[i]) == "--all") arguments->effort = whole_filter_effort();
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    const char* value = words[i] + std::min(word.find('=') + 1, word.size());
    const auto number = [&](long least) {
      const long n = std::strtol(value, nullptr, 10);
      if (n < least) std::fprintf(stderr, "%s: give a number of %ld or more\n", words[i], least);
      return n;
    };
    if (word == "--all") continue;
    if (word.starts_with("--benchmark_out=")) {
      arguments->out = value;
    } else if (word.starts_with("--only=")) {
      arguments->only = value;
      if (std::find(kParts.begin(), kParts.end(), arguments->only) == kParts.end()) {
        std::fprintf(stderr, "%s: give memory, cost, physics, tracking or finding\n", words[i]);
        return false;
      }
    } else if (word.starts_with("--seed=")) {
      const long n = number(1);
      if (n < 1) return false;
      arguments->effort.seed = static_cast<std::uint64_t>(n);
    } else if (word.starts_with("--sequences=")) {
      const long n = number(1);
      if (n < 1) return false;
      arguments->effort.sequences = static_cast<int>(std::min(n, 1000L));
    } else {
      std::fprintf(
          stderr,
          "bench_filter [--all] [--only=PART] [--seed=N] [--sequences=N] [--benchmark_out=PATH]; this is none: %s\n",
          words[i]);
      return false;
    }
  }
  return true;
}

int run(const FilterArguments& arguments) {
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
  std::fputs(report.text().c_str(), stdout);
  const int written = report.finish(arguments.out);
  return good ? written : 1;
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::FilterArguments arguments;
  if (!prescene::benchmarks::parse(count, words, &arguments)) return 2;
  return prescene::benchmarks::run(arguments);
}
