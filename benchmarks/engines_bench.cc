// SPDX-License-Identifier: Apache-2.0
// Outcome probabilities of twenty small scenes (tests/support/engine_scenes.h) by both steppers and by MuJoCo,
// from the same uncertain starts: where do engines disagree by more than sampling explains?
//
//   bench_engines [--quick] [--instances=N] [--dice=N] [--only=PART] [--benchmark_out=PATH]
//
// --instances: starts a scene (512; quick 64). --dice: dice of a kind that MuJoCo throws (128; quick 4). --only: scenes
// or dice.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

#include "benchmarks/arguments.h"
#include "benchmarks/dice_engines.h"
#include "benchmarks/report.h"
#include "prescene/core/check.h"
#include "prescene/service/backends.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/peers/scene_mujoco.h"
#include "tests/support/engine_scenes.h"

namespace prescene::benchmarks {
namespace {

constexpr double kFineStep = 1.0 / 2000.0;  // s, at which ours are looked at once more
constexpr double kQuantile = 1.645;         // of 90 %

struct Problem {
  tests::EngineScene named;
  simulation::Variable variable;
  std::vector<belief::WorldState> starts;
};

Problem problem_of(const tests::EngineScene& named, int instances) {
  Problem problem{named, simulation::variables_of(named.scene, {}, named.scene->exclusive_outcomes)[0], {}};
  const simulation::StartDistribution distribution = simulation::start_of(named.scene);
  const simulation::StartSampler sampler(distribution.components[0], 7);
  for (int i = 0; i < instances; ++i) problem.starts.push_back(sampler.draw(static_cast<std::uint32_t>(i)));
  return problem;
}

/// The class of each start; -1 where the run blew up.
std::vector<int> classes_by(const simulation::Simulator& simulator, const Problem& problem) {
  simulation::RunRequest request;
  request.stop.duration = problem.named.scene->duration;
  std::vector<belief::Trajectory> runs(problem.starts.size());
  core::ThreadPool pool(2);
  simulator.run(problem.starts, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, runs);
  std::vector<int> classes;
  for (const belief::Trajectory& run : runs)
    classes.push_back(run.end == belief::TrajectoryEnd::kDiverged ? -1 : problem.variable.classify(run));
  return classes;
}

std::vector<int> by_bullet(const Problem& problem, double step) {
  simulation::BulletOptions options;
  options.step = step;
  simulation::ShapeStore shapes;
  const auto simulator = simulation::make_bullet_simulator(*problem.named.scene, shapes, options);
  PRESCENE_CHECK(simulator.ok());
  return classes_by(**simulator, problem);
}

/// In the steps that users get (`step: auto`).
std::vector<int> by_default(const Problem& problem, service::Stepper stepper) {
  core::ThreadPool pool(2);
  service::BackendSettings settings;
  settings.stepper = stepper;
  service::Backends backends(pool, settings);
  const auto simulator = backends.make_simulator(*problem.named.scene, 1.0);
  PRESCENE_CHECK(simulator.ok());
  return classes_by(**simulator, problem);
}

std::vector<int> by_mujoco(const Problem& problem) {
  tests::MujocoScene engine(*problem.named.scene);
  std::vector<int> classes;
  for (const belief::WorldState& start : problem.starts) {
    const belief::Trajectory run = engine.run(start, problem.named.scene->duration);
    classes.push_back(run.end == belief::TrajectoryEnd::kDiverged ? -1 : problem.variable.classify(run));
  }
  return classes;
}

/// Of those that did not blow up.
double share(const std::vector<int>& classes, int which) {
  const auto n =
      static_cast<double>(classes.size() - static_cast<std::size_t>(std::count(classes.begin(), classes.end(), -1)));
  return static_cast<double>(std::count(classes.begin(), classes.end(), which)) / n;
}

double half_width(double p, double n) { return kQuantile * std::sqrt(std::max(p * (1.0 - p), 0.25 / n) / n); }

double same(const std::vector<int>& a, const std::vector<int>& b) {
  double count = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] == b[i] ? 1.0 : 0.0;
  return count / static_cast<double>(a.size());
}

bool disagree(double p, double q, double n) { return std::abs(p - q) > half_width(p, n) + half_width(q, n); }

/// Prints and reports the twenty scenes.
void measure_scenes(int instances, Report* report) {
  report->note("Scenes of tests/support/engine_scenes.cc, " + std::to_string(instances) +
               " starts each; a class disagrees where shares differ by more than both 90 % intervals.");
  Table classes{"classes",
                {"scene", "class", "bullet", "lockstep", "bullet 1/2000 s", "mujoco", "half width", "disagrees",
                 "disagrees at 1/2000 s"},
                {}};
  Table runs{"runs",
             {"scene", "same end, lockstep", "same end, mujoco", "same end, mujoco and 1/2000 s", "blown up in mujoco"},
             {}};
  int scenes_apart = 0, scenes_apart_fine = 0;
  const double n = instances;
  for (const tests::EngineScene& named : tests::engine_scenes()) {
    std::fprintf(stderr, "%s\n", named.name.c_str());
    const Problem problem = problem_of(named, instances);
    const std::vector<int> bullet = by_default(problem, service::Stepper::kBullet);
    const std::vector<int> lockstep = by_default(problem, service::Stepper::kLockstep);
    const std::vector<int> fine = by_bullet(problem, kFineStep);
    const std::vector<int> mujoco = by_mujoco(problem);
    bool apart = false, apart_fine = false;
    for (int c = 0; c < static_cast<int>(problem.variable.classes.size()); ++c) {
      const double p = share(bullet, c), q = share(mujoco, c), p_fine = share(fine, c);
      const bool differs = disagree(p, q, n), differs_fine = disagree(p_fine, q, n);
      apart = apart || differs;
      apart_fine = apart_fine || differs_fine;
      classes.rows.push_back({named.name, problem.variable.classes[static_cast<std::size_t>(c)], p, share(lockstep, c),
                              p_fine, q, half_width(p, n), static_cast<std::int64_t>(differs),
                              static_cast<std::int64_t>(differs_fine)});
    }
    scenes_apart += apart;
    scenes_apart_fine += apart_fine;
    runs.rows.push_back({named.name, same(bullet, lockstep), same(bullet, mujoco), same(fine, mujoco),
                         static_cast<std::int64_t>(std::count(mujoco.begin(), mujoco.end(), -1))});
  }
  report->add({.work = "scenes in which a share differs from MuJoCo's at 1/2000 s beyond both intervals",
               .better = Better::kLower,
               .must = at_most(1.0),
               .aim = at_most(0.0),
               .reached = scenes_apart,
               .unit = "of " + std::to_string(runs.rows.size()),
               .n = static_cast<std::int64_t>(runs.rows.size()),
               .baseline = "MuJoCo 2.2.2",
               .why = std::to_string(scenes_apart_fine) + " with steps of 1/2000 s of ours"});
  std::printf("%s\n%s\n", text_of(classes).c_str(), text_of(runs).c_str());
  report->add(std::move(classes));
  report->add(std::move(runs));
}

int run(int instances, int dice, const std::string& only, const std::string& out) {
  if (!only.empty() && only != "scenes" && only != "dice") {
    std::fprintf(stderr, "--only: give scenes or dice\n");
    return 2;
  }
  Report report("engines", best_simd_target());
  if (only != "scenes") {
    Table table = measure_dice_in_mujoco(4096, dice, &report);
    std::printf("%s\n", text_of(table).c_str());
    report.add(std::move(table));
  }
  if (only != "dice") measure_scenes(instances, &report);
  std::fputs(report.text().c_str(), stdout);
  return report.finish(out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  int instances = 512, dice = 128;
  std::string only, out;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] {
    instances = 64;
    dice = 4;
  });
  arguments.number("instances", 1, 1e6, &instances);
  arguments.number("dice", 2, 1e6, &dice);
  arguments.text("only", "PART", &only);
  arguments.text("benchmark_out", "PATH", &out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(instances, dice, only, out) : 2;
}
