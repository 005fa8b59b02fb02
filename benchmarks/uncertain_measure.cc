// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/uncertain_measure.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::benchmarks {
namespace {

using simulation::BulletOptions;
using simulation::EstimatorOptions;
using simulation::OutcomeEstimate;

std::unique_ptr<simulation::Simulator> bullet_of(const belief::Scene& scene, bool skip_flight) {
  BulletOptions options;
  options.skip_flight = skip_flight;
  simulation::ShapeStore shapes;
  auto made = simulation::make_bullet_simulator(scene, shapes, options);
  PRESCENE_CHECK(made.ok());
  return *std::move(made);
}

std::unique_ptr<simulation::Simulator> lockstep_of(const belief::Scene& scene) {
  simulation::ShapeStore shapes;
  auto made = simulation::make_lockstep_simulator(scene, shapes);
  PRESCENE_CHECK(made.ok());
  return *std::move(made);
}

OutcomeEstimate estimate(const UncertainProblem& problem, const EstimatorOptions& options, std::uint64_t seed,
                         core::ThreadPool& pool) {
  return simulation::estimate_outcomes(*problem.simulator, problem.starts, problem.variables, problem.request,
                                       core::RandomStream(seed, core::Purpose::kEvaluation), options, pool);
}

}  // namespace

UncertainProblem::UncertainProblem(const tests::NamedScene& named, Stepping stepping)
    : name(named.name), scene(named.scene) {
  stepper = bullet_of(*scene, false);
  simulator = stepping == Stepping::kBullet ? bullet_of(*scene, true) : lockstep_of(*scene);
  starts = simulation::start_of(scene);
  variables = simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
  request.stop.duration = scene->duration;
  const double begin = core::process_cpu_seconds();
  certifier = simulation::make_certifier(scene, variables, request);
  certifier_cpu = core::process_cpu_seconds() - begin;
  PRESCENE_CHECK(certifier);
}

Bank make_bank(const UncertainProblem& problem, int count) {
  const simulation::StartComponent& component = problem.starts.components[0];
  core::RandomStream stream(1, core::Purpose::kStartBelief);
  std::vector<double> uniforms(static_cast<std::size_t>(component.dimensions));
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(component.draw(uniforms));
  }
  const core::RandomStream actions(1, core::Purpose::kAction);
  core::ThreadPool pool(1);
  std::vector<belief::Trajectory> runs(starts.size());
  Bank bank;
  double begin = core::process_cpu_seconds();
  problem.stepper->run(starts, problem.request, actions, 0, pool, runs);
  bank.cpu = (core::process_cpu_seconds() - begin) / count;
  for (const belief::Trajectory& run : runs) {
    bank.classes.push_back(problem.variables[0].classify(run));
    bank.seconds.push_back(run.simulated_seconds);
  }

  // What certificates are compared with is the same simulator.
  problem.simulator->run(starts, problem.request, actions, 0, pool, runs);
  std::vector<int> at_rest;
  for (const belief::Trajectory& run : runs) at_rest.push_back(problem.variables[0].classify(run));

  simulation::RunRequest request = problem.request;
  request.end_rule = problem.certifier.get();
  begin = core::process_cpu_seconds();
  problem.simulator->run(starts, request, actions, 0, pool, runs);
  bank.certified_cpu = (core::process_cpu_seconds() - begin) / count;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    bank.certified_seconds += runs[i].simulated_seconds / count;
    bank.flown_seconds += runs[i].flown_seconds / count;
    if (runs[i].end != belief::TrajectoryEnd::kDecided) continue;
    ++bank.certified;
    const double left = request.stop.duration - runs[i].simulated_seconds;
    bank.wrong += (*problem.certifier->classes(runs[i].final(), left))[0] != at_rest[i];
  }
  return bank;
}

Cost plain_cost(const Bank& bank, int classes, double tolerance, double confidence, int repetitions) {
  constexpr int kFewest = 64, kBetweenLooks = 16;
  const double quantile = core::inverse_normal_cdf(0.5 + 0.5 * confidence);
  core::RandomStream stream(2, core::Purpose::kEvaluation);
  Cost cost;
  for (int r = 0; r < repetitions; ++r) {
    std::vector<double> counts(static_cast<std::size_t>(classes), 0.0);
    double seconds = 0.0, n = 0.0;
    for (bool narrow = false; !narrow;) {
      const auto i = static_cast<std::size_t>(stream.uniform_below(bank.classes.size()));
      counts[static_cast<std::size_t>(bank.classes[i])] += 1.0;
      seconds += bank.seconds[i];
      n += 1.0;
      if (n < kFewest || static_cast<int>(n) % kBetweenLooks != 0) continue;
      narrow = std::all_of(counts.begin(), counts.end(), [&](double count) {
        const double p = count / n;
        return quantile * std::sqrt(p * (1.0 - p) / n + 0.25 / (n * n)) <= tolerance;
      });
    }
    cost.instances += n / repetitions;
    cost.seconds += seconds / repetitions;
  }
  cost.cpu = cost.instances * bank.cpu;
  return cost;
}

Estimates run_estimates(const UncertainProblem& problem, double tolerance, double confidence, int seeds) {
  Estimates estimates;
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.tolerance = tolerance;
  options.confidence = confidence;
  options.max_instances = 8192;
  options.certifier = problem.certifier.get();
  const double begin = core::process_cpu_seconds();
  for (int seed = 0; seed < seeds; ++seed) {
    OutcomeEstimate one = estimate(problem, options, static_cast<std::uint64_t>(seed), pool);
    estimates.instances.push_back(static_cast<double>(one.instances.size()));
    estimates.mean.instances += estimates.instances.back() / seeds;
    estimates.mean.seconds += (one.simulated_seconds - one.flown_seconds) / seeds;
    estimates.mean.all_seconds += one.simulated_seconds / seeds;
    estimates.certified += one.certificates.certified;
    estimates.audited += one.certificates.audited;
    estimates.mismatches += one.certificates.mismatches;
    estimates.switched_off += one.certificates.switched_off;
    one.instances.clear();
    estimates.all.push_back(std::move(one));
  }
  estimates.mean.cpu = (core::process_cpu_seconds() - begin) / seeds + problem.certifier_cpu;
  return estimates;
}

std::vector<double> true_shares(const UncertainProblem& problem, int instances) {
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.exact_instances = instances;
  options.certifier = problem.certifier.get();
  const OutcomeEstimate found = estimate(problem, options, 1'000'000, pool);
  std::vector<double> shares;
  for (const simulation::ClassEstimate& one : found.variables[0].classes) shares.push_back(one.probability);
  return shares;
}

std::vector<double> wall_times(const UncertainProblem& problem, double tolerance, double confidence, int threads,
                               int seeds) {
  core::ThreadPool pool(threads);
  std::vector<double> times;
  for (int seed = 0; seed < seeds; ++seed) {
    const core::Stopwatch watch;
    const auto certifier = simulation::make_certifier(problem.scene, problem.variables, problem.request);
    EstimatorOptions options;
    options.tolerance = tolerance;
    options.confidence = confidence;
    options.certifier = certifier.get();
    estimate(problem, options, static_cast<std::uint64_t>(seed), pool);
    times.push_back(watch.seconds());
  }
  return times;
}

bool audit_catches_mutation(const UncertainProblem& problem, int instances) {
  simulation::CertifierOptions forgetful;
  forgetful.shorten_arms = false;
  const auto certifier = simulation::make_certifier(problem.scene, problem.variables, problem.request, forgetful);
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.exact_instances = instances;
  options.certifier = certifier.get();
  return estimate(problem, options, 3, pool).certificates.switched_off;
}

}  // namespace prescene::benchmarks
