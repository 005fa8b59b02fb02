// SPDX-License-Identifier: Apache-2.0
// How probable are the outcomes of a scene whose start is uncertain: the one estimator.
//
// Randomised quasi-Monte Carlo: one scrambled Sobol net over the whitened start belief [Owen 1997; Matousek 1998],
// grown in steps (64, 96, 128, 192, 256, 384, ...) until every interval is narrow enough. Aligned consecutive blocks of
// the net serve as pseudo-replicates, so that the whole net's accuracy is kept and still has an error estimate.
//
// The stop rule, looked at after each step of the net (end_of_net in outcome_estimator.cc):
// - converged: every half width is at most `tolerance`, and at least `min_instances` were run;
// - or `max_instances` were run;
// - with `exact_instances`: just that many were run, whatever the intervals say;
// - where nothing is random (OutcomeEstimate::certain): one instance of each component was run, which is converged.
// Between two chunks of instances it also ends when `max_seconds` are over (not with `exact_instances`) or the work is
// cancelled; what was finished until then is the estimate. EstimateStop says which of these it was.
//
//   StartDistribution starts = start_of(scene);
//   std::vector<Variable> variables = variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
//   OutcomeEstimate estimate = estimate_outcomes(simulator, starts, variables, request, stream, options, pool);
//   ... estimate.variables[0].classes[0].probability
//
// With EstimatorOptions::on_look, what is known is told while the work goes on: after the first 16 and 32 instances and
// at each growth of the net. Whoever looks at a class again and again, and stops when they like what they see, is not
// deceived: the look at 16 instances has 1/8 of the tolerated error, and of those after it the k-th has the share
// 7/8 / (k (k + 1)), so that the intervals of all looks at a class hold together with the wanted confidence
// (Bonferroni's inequality). This is true of each class by itself, not of all classes together. The intervals
// (look_estimate) are wider than the estimate's, as errors so small take tails that are exact.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/outcome.h"
#include "prescene/simulation/outcomes/start_distribution.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

/// Something of which exactly one of `classes` is true of each instance.
struct Variable {
  std::string name;                  ///< The group's name; empty for a single outcome.
  std::vector<std::string> classes;  ///< At least one.
  /// Index of the class that an instance belongs to. Pure; called from several threads.
  std::function<int(const belief::Trajectory&)> classify;
  /// What the classes mean, for certificates: class i is that outcome i is the first that holds, the last class that
  /// none does. Empty: they mean something else.
  std::vector<belief::Outcome> outcomes = {};
};
/// One variable an exclusive group (its classes end with "other"), one of two classes (name, "not name") an outcome, in
/// this order. Refers to `scene` by shared ownership.
std::vector<Variable> variables_of(const std::shared_ptr<const belief::Scene>& scene,
                                   std::vector<belief::Outcome> outcomes,
                                   std::vector<belief::ExclusiveOutcomes> exclusive_outcomes);

class Certifier;
struct OutcomeEstimate;

struct EstimatorOptions {
  double tolerance = 0.02;             ///< Half width of the intervals at which to stop, > 0.
  double confidence = 0.95;            ///< Of the intervals, in (0, 1).
  int min_instances = 0;               ///< Not converged before so many, whatever the intervals say.
  int max_instances = 4096;            ///< > 0.
  std::optional<double> max_seconds;   ///< Wall time. What it was worth is OutcomeEstimate::instances.
  std::optional<int> exact_instances;  ///< Replay: just this many, whatever the intervals say; > 0.
  /// Ends instances whose classes are decided (certifier.h), made for the same variables and request. Their `final` is
  /// then no place of rest: leave it out where that is used. Must outlive the estimate.
  const Certifier* certifier = nullptr;
  /// Keep each instance's contacts. Of an instance that a certificate ended they are those until then.
  bool keep_contacts = false;
  /// Memory that the states of runs under way may take, bytes: so many are run at once. Does not change results.
  std::size_t bytes_of_runs = std::size_t{256} << 20;
  double audit_share = 0.02;         ///< Of the decided instances that are run to rest all the same, in [0, 1].
  double tolerated_mismatch = 0.01;  ///< Share of the audited with another class beyond which nothing is certified.
  /// Told what is known so far, with the intervals of a look (top of this file); not where nothing is random. From the
  /// calling thread; may be empty. Does not change results but for the number of instances where the time runs out.
  std::function<void(const OutcomeEstimate& so_far)> on_look = {};
};

/// One simulated instance, without its path. Run it again with `run_instance` for that.
struct InstanceRecord {
  int component = 0;         ///< Of the start distribution.
  std::uint32_t point = 0;   ///< Index in the component's net.
  double weight = 0.0;       ///< The weights of all instances sum to one.
  std::vector<int> classes;  ///< One a variable; -1 = none, of an instance that failed.
  belief::WorldState final;
  belief::TrajectoryEnd end = belief::TrajectoryEnd::kDuration;
  double simulated_seconds = 0.0;
  double flown_seconds = 0.0;  ///< Of these, what took no search for contacts.
  bool certified = false;      ///< Ended by its certificate, and not audited since.
  /// The simulation blew up: no class is true of it (-1), and it counts for none.
  bool failed = false;
  double deepest_overlap = 0.0;                   ///< m, see Trajectory.
  std::int64_t dropped_contacts = 0;              ///< See Trajectory.
  std::vector<belief::ContactInterval> contacts;  ///< With EstimatorOptions::keep_contacts.
};

/// Instances that ended by a certificate, and what the audit found.
struct CertificateUse {
  int certified = 0;   ///< Decided early, those that were audited among them.
  int audited = 0;     ///< Of these run to rest, too.
  int mismatches = 0;  ///< Of these with another class than certified.
  /// Too many mismatches: all instances were run to rest after all, and the intervals owe nothing to certificates.
  bool switched_off = false;
  friend bool operator==(const CertificateUse&, const CertificateUse&) = default;
};

struct ClassEstimate {
  double probability = 0.0;
  double low = 0.0;  ///< Of the interval, within [0, 1].
  double high = 1.0;
  double half_width = 0.5;  ///< What the stop rule (top of this file) looks at.
  friend bool operator==(const ClassEstimate&, const ClassEstimate&) = default;
};
struct VariableEstimate {
  std::vector<ClassEstimate> classes;
  friend bool operator==(const VariableEstimate&, const VariableEstimate&) = default;
};

/// What was known after so many instances.
struct EstimateStage {
  int instances = 0;
  std::vector<VariableEstimate> variables;
  friend bool operator==(const EstimateStage&, const EstimateStage&) = default;
};

enum class EstimateStop {
  kConverged,     ///< Every half width reached the tolerance.
  kMaxInstances,  ///< Not converged: max_instances were run.
  kExact,         ///< exact_instances were run.
  kTimeLimit,
  kCancelled,
};
std::string to_string(EstimateStop stop);

struct OutcomeEstimate {
  std::vector<VariableEstimate> variables;  ///< As the variables given; empty when no instance was finished.
  std::vector<InstanceRecord> instances;    ///< In the order in which they count: a shorter estimate is a prefix.
  double simulated_seconds = 0.0;           ///< Of all instances together, audits and repairs included.
  double flown_seconds = 0.0;               ///< Of these, what took no search for contacts.
  CertificateUse certificates;
  /// Instances whose simulation failed. They might have been of any class: their share widens every interval.
  int failed = 0;
  /// Neither starts nor actions hold anything random: one instance a component is enough; intervals have no width.
  bool certain = false;
  std::vector<EstimateStage> history;  ///< At each growth of the net, the last being this estimate.
  double wall_seconds = 0.0;           ///< These two alone differ between runs of equal `instances.size()`.
  double cpu_seconds = 0.0;            ///< Of all threads of the process meanwhile.
  bool converged = false;              ///< Every half width is within the tolerance, however the work ended.
  EstimateStop stop = EstimateStop::kConverged;
};

/// Runs instances until the stop rule (top of this file) holds. The same arguments give the same bits for any number of
/// threads; with a time limit or cancellation, for equal numbers of instances (rerun with exact_instances for that
/// number). `variables` may be empty: then the first step at min_instances or above ends it. `stream` seeds the nets
/// and what is random in the simulator's actions. Progress is reported between chunks of instances, from the calling
/// thread; its seconds_left come from the rate at which the widest interval shrinks. With a certifier, the share of
/// audited instances that had another class times the share certified is added to every half width.
OutcomeEstimate estimate_outcomes(const Simulator& simulator, const StartDistribution& starts,
                                  std::span<const Variable> variables, const RunRequest& request,
                                  const core::RandomStream& stream, const EstimatorOptions& options,
                                  core::ThreadPool& pool, const core::Cancellation* cancellation = nullptr,
                                  const core::ProgressSink& progress = {});

/// The full trajectory of instance `index` of an estimate made with the same arguments; `request` may ask for more
/// samples. Ends as kCancelled if it is cancelled first.
belief::Trajectory run_instance(const Simulator& simulator, const StartDistribution& starts,
                                const OutcomeEstimate& estimate, std::size_t index, const RunRequest& request,
                                const core::RandomStream& stream, core::ThreadPool& pool,
                                const core::Cancellation* cancellation = nullptr);

/// Memory of one trajectory's states when it takes its whole duration, bytes.
std::size_t bytes_of_run(const RunRequest& request, std::size_t objects);

/// Number of instances after `count` in the growth of the net: 64, 96, 128, 192, 256, ... The largest int where the
/// next is larger.
int next_net_size(int count);

/// Classes of a set of instances, as an interval sees them: per component its weight and the class of its points in
/// order.
struct ComponentClasses {
  double weight = 1.0;       ///< The weights of all components sum to one.
  std::vector<int> classes;  ///< Of points 0, 1, ... of the component's net.
};
/// Share of class `which` with its interval. Per component N_k points in blocks of the largest power of two of which 12
/// fit (16 blocks when N_k = 2^j, 12 when 3 2^j), the block means' variance with a continuity term 1/(2 N_k), Student's
/// t with Welch-Satterthwaite degrees of freedom. Wald's interval with the same term instead where that is narrower, or
/// where the blocks' variance is not significantly (5 %) below that of independent draws. When the class holds of all
/// instances or none: Jeffreys' interval.
ClassEstimate class_estimate(std::span<const ComponentClasses> components, int which, double confidence);
/// The same share with an interval that holds with any confidence, however near to one: the wider at each end of
/// class_estimate's and that of Clopper and Pearson [1934]. The latter is exact for independent draws of equal weight.
/// It is for the number of such draws that the components are worth, 1 / sum of w_k^2 / N_k; components that differ
/// scatter less than so many draws [Hoeffding 1956]. Where the blocks' variance is below that of independent draws, and
/// would be by chance no more often than the interval may miss, it is for the number of draws with that variance [Korn
/// & Graubard 1998], and approximate.
ClassEstimate look_estimate(std::span<const ComponentClasses> components, int which, double confidence);

}  // namespace prescene::simulation
