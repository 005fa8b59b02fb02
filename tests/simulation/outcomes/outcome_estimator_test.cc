// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/outcome_estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <string>

#include "expect_equal_estimates.h"
#include "toy_problems.h"

namespace prescene::simulation::outcome_estimator_test {
namespace {

using tests::ToyProblem;

core::RandomStream test_stream(std::uint64_t seed = 1) { return {seed, core::Purpose::kTest}; }

OutcomeEstimate estimate(const ToyProblem& problem, const EstimatorOptions& options, core::ThreadPool& pool,
                         const core::Cancellation* cancellation = nullptr, const core::ProgressSink& progress = {}) {
  const tests::FakeSimulator simulator = tests::standing_still();
  const std::vector<Variable> variables = problem.variables();
  return estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(), options, pool, cancellation,
                           progress);
}

TEST(OutcomeEstimator, NetsGrowByHalvesAndThirds) {
  std::vector<int> sizes;
  for (int n = 0; n < 1000;) sizes.push_back(n = next_net_size(n));
  EXPECT_EQ(sizes, (std::vector<int>{64, 96, 128, 192, 256, 384, 512, 768, 1024}));
  EXPECT_EQ(next_net_size(100), 128);
}

TEST(OutcomeEstimator, StopsAtTheToleranceAndSumsToOne) {
  core::ThreadPool pool(2);
  EstimatorOptions options;
  options.tolerance = 0.03;
  const OutcomeEstimate found = estimate(tests::curved_boundary(), options, pool);
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.stop, EstimateStop::kConverged);
  double sum = 0.0, weights = 0.0;
  for (const ClassEstimate& one : found.variables[0].classes) {
    EXPECT_LE(one.half_width, 0.03);
    EXPECT_LE(one.low, one.probability);
    EXPECT_GE(one.high, one.probability);
    sum += one.probability;
  }
  for (const InstanceRecord& record : found.instances) weights += record.weight;
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_NEAR(weights, 1.0, 1e-12);
}

TEST(OutcomeEstimator, SaysWhenItDidNotConverge) {
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.tolerance = 0.001;
  options.max_instances = 1000;  // not a size at which nets are even
  const OutcomeEstimate found = estimate(tests::chaotic(), options, pool);
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.stop, EstimateStop::kMaxInstances);
  EXPECT_EQ(found.instances.size(), 1000u);
}

TEST(OutcomeEstimator, EqualOutcomesLeaveAnIntervalOfSomeWidth) {
  core::ThreadPool pool(1);
  ToyProblem problem = tests::one_boundary();
  problem.classify = [](const belief::WorldState&) { return 0; };
  EstimatorOptions options;
  options.tolerance = 0.05;
  const OutcomeEstimate found = estimate(problem, options, pool);
  EXPECT_EQ(found.instances.size(), 64u);
  const ClassEstimate& always = found.variables[0].classes[0];
  EXPECT_EQ(always.probability, 1.0);
  EXPECT_EQ(always.high, 1.0);
  EXPECT_GT(always.low, 0.9);
  EXPECT_LT(always.low, 0.99);
  const ClassEstimate& never = found.variables[0].classes[1];
  EXPECT_EQ(never.low, 0.0);
  EXPECT_NEAR(never.high, 1.0 - always.low, 1e-12);
}

TEST(OutcomeEstimator, SameBitsForAnyNumberOfThreads) {
  const ToyProblem problem = tests::curved_boundary();
  core::ThreadPool one(1);
  const OutcomeEstimate first = estimate(problem, {}, one);
  for (int threads : {2, 3, 8}) {
    core::ThreadPool pool(threads);
    expect_equal(estimate(problem, {}, pool), first);
  }
}

TEST(OutcomeEstimator, AnotherSeedGivesOtherInstances) {
  core::ThreadPool pool(1);
  const ToyProblem problem = tests::curved_boundary();
  const tests::FakeSimulator simulator = tests::standing_still();
  const auto variables = problem.variables();
  const auto run = [&](std::uint64_t seed) {
    return estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(seed), {}, pool);
  };
  EXPECT_FALSE(run(1).instances[0].final == run(2).instances[0].final);
}

TEST(OutcomeEstimator, ATimeLimitIsReplayedAsItsInstanceCount) {
  core::ThreadPool pool(2);
  EstimatorOptions options;
  options.tolerance = 1e-4;
  options.max_instances = 1 << 20;
  options.max_seconds = 0.0;  // over after the first look at the clock
  const OutcomeEstimate limited = estimate(tests::curved_boundary(), options, pool);
  EXPECT_EQ(limited.stop, EstimateStop::kTimeLimit);
  EXPECT_GT(limited.instances.size(), 0u);
  EXPECT_LT(limited.instances.size(), 64u);

  options.max_seconds.reset();
  options.exact_instances = static_cast<int>(limited.instances.size());
  const OutcomeEstimate replayed = estimate(tests::curved_boundary(), options, pool);
  EXPECT_EQ(replayed.stop, EstimateStop::kExact);
  expect_equal(replayed, limited);
}

TEST(OutcomeEstimator, AnIntervalWithoutEndStopsAtTheMostInstances) {
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.confidence = 0.9999999999999999;  // rounds to a quantile of 1, which is infinite
  options.max_instances = 300;
  bool finite = true;
  const OutcomeEstimate found =
      estimate(tests::curved_boundary(), options, pool, nullptr, [&](const core::Progress& progress) {
        finite = finite && std::isfinite(progress.fraction) && std::isfinite(progress.seconds_left.value_or(0.0));
      });
  EXPECT_EQ(found.stop, EstimateStop::kMaxInstances);
  EXPECT_EQ(found.instances.size(), 300u);
  EXPECT_FALSE(found.converged);
  EXPECT_TRUE(finite);
}

TEST(OutcomeEstimator, NetsGrowUpToTheLargestNumberAndNoFurther) {
  EXPECT_EQ(next_net_size(std::numeric_limits<int>::min()), 64);
  EXPECT_EQ(next_net_size(64), 96);
  EXPECT_EQ(next_net_size((1 << 30) - 1), 1 << 30);
  EXPECT_EQ(next_net_size(1 << 30), 3 << 29);
  EXPECT_EQ(next_net_size(3 << 29), std::numeric_limits<int>::max());
  EXPECT_EQ(next_net_size(std::numeric_limits<int>::max()), std::numeric_limits<int>::max());
}

TEST(OutcomeEstimator, LittleMemoryForRunsChangesNoResult) {
  core::ThreadPool pool(1);
  const ToyProblem problem = tests::curved_boundary();
  RunRequest request;
  request.sample_interval = 0.01;
  std::size_t most_at_once = 0;
  const auto run = [&](std::size_t bytes) {
    EstimatorOptions options;
    options.exact_instances = 150;
    options.bytes_of_runs = bytes;
    std::size_t before = 0;
    most_at_once = 0;
    return estimate_outcomes(tests::standing_still(), problem.starts(), problem.variables(), request, test_stream(1),
                             options, pool, nullptr, [&](const core::Progress& progress) {
                               const std::size_t done = std::stoul(progress.text);
                               most_at_once = std::max(most_at_once, done - before);
                               before = done;
                             });
  };
  const OutcomeEstimate roomy = run(std::size_t{1} << 30);
  EXPECT_GE(most_at_once, 32u);
  const OutcomeEstimate tight = run(3 * bytes_of_run(request, roomy.instances[0].final.objects.size()));
  EXPECT_EQ(most_at_once, 3u);
  expect_equal(tight, roomy);
}

TEST(OutcomeEstimator, AnExactCountIsAPrefixOfALongerRun) {
  core::ThreadPool pool(1);
  EstimatorOptions options;
  options.exact_instances = 100;
  const OutcomeEstimate shorter = estimate(tests::curved_boundary(), options, pool);
  options.exact_instances = 357;
  const OutcomeEstimate longer = estimate(tests::curved_boundary(), options, pool);
  ASSERT_EQ(longer.instances.size(), 357u);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(longer.instances[i].final, shorter.instances[i].final);
}

TEST(OutcomeEstimator, CancellationKeepsWhatIsDone) {
  core::ThreadPool pool(1);
  core::Cancellation cancellation;
  EstimatorOptions options;
  options.tolerance = 1e-4;
  options.max_instances = 1 << 20;
  const OutcomeEstimate stopped =
      estimate(tests::curved_boundary(), options, pool, &cancellation, [&](const core::Progress& progress) {
        if (progress.text.starts_with("128 ")) cancellation.request();
      });
  EXPECT_EQ(stopped.stop, EstimateStop::kCancelled);
  EXPECT_EQ(stopped.instances.size(), 128u);
  EXPECT_EQ(stopped.variables.size(), 1u);

  options.exact_instances = 128;
  expect_equal(estimate(tests::curved_boundary(), options, pool), stopped);
}

TEST(OutcomeEstimator, CancellationWithinAChunkKeepsTheRunsThatWereFinished) {
  core::ThreadPool pool(1);
  const ToyProblem problem = tests::curved_boundary();
  const std::vector<Variable> variables = problem.variables();
  for (const int finished : {1, 20, 32, 50}) {  // the first chunk has 32
    core::Cancellation cancellation;
    int runs = 0;
    const tests::FakeSimulator simulator(
        [&](const belief::WorldState& start, const RunRequest& request, core::RandomStream) {
          if (++runs == finished) cancellation.request();
          belief::WorldState end = start;
          end.time += request.stop.duration;
          return end;
        });
    EstimatorOptions options;
    options.exact_instances = 1000;
    const OutcomeEstimate cut =
        estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(), options, pool, &cancellation);
    EXPECT_EQ(cut.stop, EstimateStop::kCancelled);
    EXPECT_EQ(cut.instances.size(), static_cast<std::size_t>(finished));
    options.exact_instances = finished;
    expect_equal(estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(), options, pool), cut);
  }
}

TEST(OutcomeEstimator, CancelledBeforeItBeganItHasNoProbabilities) {
  core::ThreadPool pool(1);
  core::Cancellation cancellation;
  cancellation.request();
  const OutcomeEstimate nothing = estimate(tests::one_boundary(), {}, pool, &cancellation);
  EXPECT_TRUE(nothing.instances.empty());
  EXPECT_TRUE(nothing.variables.empty());
  EXPECT_FALSE(nothing.converged);
}

TEST(OutcomeEstimator, ProgressRunsForwardToItsEnd) {
  core::ThreadPool pool(1);
  std::vector<core::Progress> told;
  const OutcomeEstimate found = estimate(tests::curved_boundary(), {}, pool, nullptr,
                                         [&](const core::Progress& progress) { told.push_back(progress); });
  ASSERT_GT(told.size(), 3u);
  for (std::size_t i = 1; i < told.size(); ++i) EXPECT_GE(told[i].fraction, told[i - 1].fraction);
  for (const core::Progress& progress : told) {
    ASSERT_TRUE(progress.seconds_left.has_value());
    EXPECT_GE(*progress.seconds_left, 0.0);
    EXPECT_LE(progress.fraction, 1.0);
  }
  EXPECT_EQ(told.back().fraction, 1.0);
  EXPECT_TRUE(found.converged);
}

TEST(OutcomeEstimator, ComponentsOfKnownMassAreRecovered) {
  core::ThreadPool pool(2);
  // Two narrow humps a hundred deviations apart: the class is the component.
  StartDistribution starts;
  starts.components.push_back(tests::normal_starts(3, 0.0, 0.985 * 7.0));
  starts.components.push_back(tests::normal_starts(3, 100.0, 0.015 * 7.0));
  Variable variable;
  variable.classes = {"near", "far"};
  variable.classify = [](const belief::Trajectory& run) { return tests::z_of(run.final(), 0) < 50.0 ? 0 : 1; };
  const tests::FakeSimulator simulator = tests::standing_still();
  const OutcomeEstimate found =
      estimate_outcomes(simulator, starts, std::span(&variable, 1), {}, test_stream(), {}, pool);
  EXPECT_NEAR(found.variables[0].classes[0].probability, 0.985, 1e-12);
  EXPECT_NEAR(found.variables[0].classes[1].probability, 0.015, 1e-12);
  // Even the rare one is looked at eight times, and its points are the first of its net.
  std::vector<std::uint32_t> points;
  double mass = 0.0;
  for (const InstanceRecord& record : found.instances)
    if (record.component == 1) {
      points.push_back(record.point);
      mass += record.weight;
    }
  ASSERT_GE(points.size(), 8u);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(points[i], i);
  EXPECT_NEAR(mass, 0.015, 1e-12);
}

TEST(OutcomeEstimator, ComponentsShareTheNetByTheirWeights) {
  core::ThreadPool pool(1);
  StartDistribution starts;
  starts.components.push_back(tests::normal_starts(2, 0.0, 0.5));
  starts.components.push_back(tests::normal_starts(2, 1.0, 0.3));
  starts.components.push_back(tests::normal_starts(2, 2.0, 0.2));
  Variable variable;
  variable.classes = {"positive", "negative"};
  variable.classify = [](const belief::Trajectory& run) { return tests::z_of(run.final(), 1) > 0.0 ? 0 : 1; };
  const tests::FakeSimulator simulator = tests::standing_still();
  EstimatorOptions options;
  options.tolerance = 0.01;
  const OutcomeEstimate found =
      estimate_outcomes(simulator, starts, std::span(&variable, 1), {}, test_stream(), options, pool);
  const double truth = 0.5 * 0.5 + 0.3 * core::normal_cdf(1.0) + 0.2 * core::normal_cdf(2.0);
  const ClassEstimate& one = found.variables[0].classes[0];
  EXPECT_TRUE(found.converged);
  EXPECT_LE(one.low, truth);
  EXPECT_GE(one.high, truth);
  // A prefix has about the right proportions, too.
  int counts[3] = {0, 0, 0};
  for (std::size_t i = 0; i < 64; ++i) ++counts[found.instances[i].component];
  EXPECT_NEAR(counts[0], 32, 8);
  EXPECT_NEAR(counts[1], 19, 8);
}

TEST(OutcomeEstimator, ManyDimensionsGoOnBeyondTheNet) {
  core::ThreadPool pool(1);
  ToyProblem problem = tests::one_boundary();
  problem.dimensions = core::SobolNet::kMaxDimensions + 9;
  std::set<double> last;
  problem.classify = [&](const belief::WorldState& state) {
    last.insert(tests::z_of(state, static_cast<std::size_t>(problem.dimensions - 1)));
    return tests::z_of(state, 0) < 0.0 ? 0 : 1;
  };
  problem.probabilities = {0.5, 0.5};
  EstimatorOptions options;
  options.exact_instances = 128;
  const OutcomeEstimate found = estimate(problem, options, pool);
  EXPECT_NEAR(found.variables[0].classes[0].probability, 0.5, 0.01);
  EXPECT_EQ(last.size(), 128u);
}

TEST(OutcomeEstimator, ACertainStartRunsTheInstancesForTheActionsSake) {
  core::ThreadPool pool(1);
  // No uncertain start; the instance's own stream decides.
  const tests::FakeSimulator coin([](const belief::WorldState& start, const RunRequest&, core::RandomStream stream) {
    belief::WorldState end = start;
    end.objects[0].X_WO.translation.x() = stream.uniform() < 0.25 ? 1.0 : 0.0;
    return end;
  });
  StartDistribution starts;
  starts.components.push_back({1.0, 0, [](std::span<const double>) {
                                 belief::WorldState state;
                                 state.objects.resize(1);
                                 return state;
                               }});
  Variable variable;
  variable.classes = {"heads", "tails"};
  variable.classify = [](const belief::Trajectory& run) { return tests::z_of(run.final(), 0) > 0.5 ? 0 : 1; };
  RunRequest request;
  auto push = std::make_unique<belief::Push>();  // on the stack g++ 12 takes parts for uninitialized under sanitizers
  push->to.x() = 1.0;
  push->lateral_error = belief::NormalScalar{0.0, 0.1};
  request.actions.push_back({0.0, *push});
  const OutcomeEstimate found =
      estimate_outcomes(coin, starts, std::span(&variable, 1), request, test_stream(), {}, pool);
  EXPECT_FALSE(found.certain);
  EXPECT_LE(found.variables[0].classes[0].low, 0.25);
  EXPECT_GE(found.variables[0].classes[0].high, 0.25);
}

TEST(OutcomeEstimator, AnInstanceCanBeRunAgainWithMoreSamples) {
  core::ThreadPool pool(1);
  StartDistribution starts;
  starts.components.push_back(tests::normal_starts(4, 0.0, 0.6));
  starts.components.push_back(tests::normal_starts(4, 5.0, 0.4));
  const tests::FakeSimulator simulator(
      [](const belief::WorldState& start, const RunRequest&, core::RandomStream stream) {
        belief::WorldState end = start;
        end.objects[0].X_WO.translation.x() += stream.normal();
        return end;
      });
  const OutcomeEstimate found = estimate_outcomes(simulator, starts, {}, {}, test_stream(), {}, pool);
  ASSERT_EQ(found.instances.size(), 56u);  // nothing was asked: one stage, 32 of one net and 24 of the other
  RunRequest fine;
  fine.sample_interval = 0.5;
  for (std::size_t i : {std::size_t{0}, std::size_t{17}, std::size_t{55}}) {
    const belief::Trajectory run = run_instance(simulator, starts, found, i, fine, test_stream(), pool);
    EXPECT_EQ(run.final(), found.instances[i].final);
    EXPECT_GT(run.states.size(), 5u);
  }
}

TEST(ClassEstimate, BlocksOfAnEvenNetHaveLittleVariance) {
  // Each block of four has one hit: the net knows the share better than independent draws would.
  ComponentClasses even;
  for (int i = 0; i < 64; ++i) even.classes.push_back(i % 4 == 0 ? 0 : 1);
  const ClassEstimate narrow = class_estimate(std::span(&even, 1), 0, 0.95);
  EXPECT_EQ(narrow.probability, 0.25);
  EXPECT_NEAR(narrow.half_width, 2.131449546 * 0.5 / 64.0, 1e-8);  // t of 15 degrees of freedom, continuity alone

  // All hits in the first block: the blocks vary much more than independent draws, so Wald's interval stands.
  ComponentClasses clumped;
  for (int i = 0; i < 64; ++i) clumped.classes.push_back(i < 16 ? 0 : 1);
  const ClassEstimate wide = class_estimate(std::span(&clumped, 1), 0, 0.95);
  EXPECT_NEAR(wide.half_width, 1.959963985 * std::sqrt(0.25 * 0.75 / 64.0 + 1.0 / (128.0 * 128.0)), 1e-8);
}

TEST(ClassEstimate, OneInstanceSaysLittle) {
  ComponentClasses single;
  single.classes = {0};
  const ClassEstimate one = class_estimate(std::span(&single, 1), 0, 0.95);
  EXPECT_EQ(one.probability, 1.0);
  EXPECT_LT(one.low, 0.2);
}

TEST(LookEstimate, IsExactWhereAClassIsRare) {
  // With confidence 1 - e, none of n draws: p up to 1 - (e / 2)^(1 / n); all of them: the same of the rest.
  ComponentClasses none;
  none.classes.assign(64, 1);
  const double reach = 1.0 - std::pow(0.5 * 0.01, 1.0 / 64.0);
  EXPECT_NEAR(look_estimate(std::span(&none, 1), 0, 0.99).high, reach, 1e-9);
  EXPECT_EQ(look_estimate(std::span(&none, 1), 0, 0.99).low, 0.0);
  EXPECT_NEAR(look_estimate(std::span(&none, 1), 1, 0.99).low, 1.0 - reach, 1e-9);
  EXPECT_EQ(look_estimate(std::span(&none, 1), 1, 0.99).high, 1.0);

  // With one of n draws, at the upper end p: (1 - p)^n + n p (1 - p)^(n - 1) = e / 2.
  ComponentClasses once = none;
  once.classes[20] = 0;
  const ClassEstimate rare = look_estimate(std::span(&once, 1), 0, 0.99);
  const double p = rare.high;
  EXPECT_NEAR(std::pow(1.0 - p, 64) + 64.0 * p * std::pow(1.0 - p, 63), 0.5 * 0.01, 1e-9);
  const ClassEstimate wald = class_estimate(std::span(&once, 1), 0, 0.99);
  EXPECT_EQ(rare.probability, wald.probability);
  EXPECT_LT(wald.high, rare.high);
  EXPECT_LE(rare.low, wald.low);
  EXPECT_GE(rare.half_width, wald.half_width);
}

TEST(LookEstimate, TakesTheNetForBetterWhereThatIsNoChance) {
  // The nets of ClassEstimate: one as even as can be, and one that scatters more than independent draws.
  ComponentClasses even, clumped;
  for (int i = 0; i < 256; ++i) even.classes.push_back(i % 4 == 0 ? 0 : 1);
  for (int i = 0; i < 256; ++i) clumped.classes.push_back(i < 64 ? 0 : 1);
  const ClassEstimate narrow = look_estimate(std::span(&even, 1), 0, 0.99);
  const ClassEstimate wide = look_estimate(std::span(&clumped, 1), 0, 0.99);
  EXPECT_LT(narrow.half_width, 0.5 * wide.half_width);
  EXPECT_LE(narrow.low, class_estimate(std::span(&even, 1), 0, 0.99).low);
  EXPECT_GE(narrow.high, class_estimate(std::span(&even, 1), 0, 0.99).high);
}

/// Of every `every`-th instance the simulation blows up.
class FailingSimulator final : public Simulator {
 public:
  explicit FailingSimulator(std::uint32_t every) : every_(every) {}
  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream& stream,
           InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> runs,
           const core::Cancellation* cancellation) const override {
    tests::standing_still().run(starts, request, stream, numbers, pool, runs, cancellation);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (numbers[i] % every_ == 0) runs[i].end = belief::TrajectoryEnd::kDiverged;
      runs[i].contacts = {{0, 1, 0.25, 0.5, 0.125, 1.0}};
    }
  }
  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>&,
                                          const core::RandomStream&) const override {
    return nullptr;
  }

 private:
  std::uint32_t every_;
};

TEST(OutcomeEstimator, FailedInstancesCountForNothingAndWidenIntervals) {
  core::ThreadPool pool(2);
  const ToyProblem problem = tests::one_boundary();
  const std::vector<Variable> variables = problem.variables();
  EstimatorOptions options;
  options.exact_instances = 512;
  const auto run = [&](const Simulator& simulator) {
    return estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(), options, pool);
  };
  const OutcomeEstimate sound = run(tests::standing_still()), failing = run(FailingSimulator(32));
  EXPECT_EQ(sound.failed, 0);
  EXPECT_EQ(failing.failed, 16);
  double sum = 0.0;
  for (std::size_t c = 0; c < 2; ++c) {
    const ClassEstimate &a = sound.variables[0].classes[c], &b = failing.variables[0].classes[c];
    sum += b.probability;
    EXPECT_LE(b.probability, a.probability);
    EXPECT_GE(b.half_width, a.half_width + 0.02);  // 16 of 512 failed: 3.1 points
    EXPECT_GE(b.high, problem.probabilities[c]);
    EXPECT_LE(b.low, problem.probabilities[c]);
  }
  EXPECT_NEAR(sum, 1.0 - 16.0 / 512.0, 1e-12);
  for (const InstanceRecord& record : failing.instances) EXPECT_EQ(record.failed, record.classes[0] == -1);
}

TEST(OutcomeEstimator, KeepsContactsWhenAskedAndTheHistoryOfItsIntervals) {
  core::ThreadPool pool(1);
  const ToyProblem problem = tests::one_boundary();
  const std::vector<Variable> variables = problem.variables();
  EstimatorOptions options;
  options.exact_instances = 200;
  const FailingSimulator simulator(1000);
  const auto run = [&] {
    return estimate_outcomes(simulator, problem.starts(), variables, {}, test_stream(), options, pool);
  };
  EXPECT_TRUE(run().instances[5].contacts.empty());
  options.keep_contacts = true;
  const OutcomeEstimate found = run();
  ASSERT_EQ(found.instances[5].contacts.size(), 1u);
  EXPECT_EQ(found.instances[5].contacts[0].largest_impulse, 0.125);
  std::vector<int> stages;
  for (const EstimateStage& stage : found.history) stages.push_back(stage.instances);
  EXPECT_EQ(stages, (std::vector<int>{64, 96, 128, 192, 200}));
  EXPECT_EQ(found.history.back().variables, found.variables);
}

TEST(OutcomeEstimator, WithoutUncertaintyOneInstanceTellsAll) {
  core::ThreadPool pool(1);
  const ToyProblem problem = tests::one_boundary();
  const std::vector<Variable> variables = problem.variables();
  const StartDistribution starts{
      {{1.0, 0, [](std::span<const double>) { return tests::normal_starts(8).draw(std::vector<double>(8, 0.5)); }}}};
  const OutcomeEstimate found =
      estimate_outcomes(tests::standing_still(), starts, variables, {}, test_stream(), {}, pool);
  EXPECT_TRUE(found.certain);
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.instances.size(), 1u);
  EXPECT_EQ(found.variables[0].classes[0].probability, 1.0);
  EXPECT_EQ(found.variables[0].classes[0].low, 1.0);
  EXPECT_EQ(found.variables[0].classes[1].high, 0.0);
}

}  // namespace
}  // namespace prescene::simulation::outcome_estimator_test
