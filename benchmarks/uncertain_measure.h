// SPDX-License-Identifier: Apache-2.0
// What estimates of outcome probabilities cost and whether their intervals hold, on the scenes of
// tests/support/uncertain_scenes.h.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "prescene/simulation/outcomes/certifier.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::benchmarks {

enum class Stepping { kBullet, kLockstep };

/// A scene made ready for both ways of estimating.
struct UncertainProblem {
  /// `stepping` of the estimator; the baseline's is Bullet.
  UncertainProblem(const tests::NamedScene& named, Stepping stepping);

  std::string name;
  std::shared_ptr<const belief::Scene> scene;
  std::unique_ptr<simulation::Simulator> stepper;    ///< Steps through flights: the baseline's.
  std::unique_ptr<simulation::Simulator> simulator;  ///< The estimator's: skips them.
  simulation::StartDistribution starts;
  std::vector<simulation::Variable> variables;
  simulation::RunRequest request;
  std::unique_ptr<const simulation::Certifier> certifier;
  double certifier_cpu = 0.0;  ///< s, to make it.
};

/// Instances from independent random starts, run to rest step by step, and the same ended by certificates.
struct Bank {
  std::vector<int> classes;
  std::vector<double> seconds;                                               ///< Simulated, of each.
  double cpu = 0.0;                                                          ///< s, of one to rest.
  double certified_seconds = 0.0, flown_seconds = 0.0, certified_cpu = 0.0;  ///< Mean of one, with certificates.
  int certified = 0;
  int wrong = 0;  ///< Of these, of another class when the same simulator runs them to rest.
};
Bank make_bank(const UncertainProblem& problem, int count);

/// Plain Monte Carlo on the bank: independent instances until Wald's interval of every class is narrow enough.
struct Cost {
  double instances = 0.0;
  double seconds = 0.0;      ///< Simulated with looking for contacts.
  double all_seconds = 0.0;  ///< Simulated.
  double cpu = 0.0;          ///< s
};
Cost plain_cost(const Bank& bank, int classes, double tolerance, double confidence, int repetitions);

/// The estimator by itself with certificates and audit, one thread, for seeds 0, 1, ...
struct Estimates {
  std::vector<simulation::OutcomeEstimate> all;  ///< Without their instances.
  std::vector<double> instances;
  Cost mean;
  int certified = 0, audited = 0, mismatches = 0, switched_off = 0;
};
Estimates run_estimates(const UncertainProblem& problem, double tolerance, double confidence, int seeds);

/// Probabilities of the classes from one long net, with certificates.
std::vector<double> true_shares(const UncertainProblem& problem, int instances);

/// s of wall time, certifier included, of an estimate on `threads` threads; one for each seed.
std::vector<double> wall_times(const UncertainProblem& problem, double tolerance, double confidence, int threads,
                               int seeds);

/// Whether the audit of an estimate of so many instances notices a certifier that forgets the edges of supports.
bool audit_catches_mutation(const UncertainProblem& problem, int instances);

}  // namespace prescene::benchmarks
