// SPDX-License-Identifier: Apache-2.0
// What is told of certificates when the work on them is cut short.
#include <gtest/gtest.h>

#include <cmath>

#include "expect_equal_estimates.h"
#include "prescene/simulation/outcomes/certifier.h"
#include "toy_problems.h"

namespace prescene::simulation {
namespace {

using tests::ToyProblem;

/// Certificates end every instance at its start. Runs to rest are cancelled from instance `until` on.
class CertifiedSimulator final : public Simulator {
 public:
  explicit CertifiedSimulator(std::uint32_t until) : until_(until) {}
  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream& stream,
           InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> runs,
           const core::Cancellation* cancellation) const override {
    tests::standing_still().run(starts, request, stream, numbers, pool, runs, cancellation);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (request.end_rule)
        runs[i].end = belief::TrajectoryEnd::kDecided;
      else if (numbers[i] >= until_)
        runs[i].end = belief::TrajectoryEnd::kCancelled;
    }
  }
  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>&,
                                          const core::RandomStream&) const override {
    return nullptr;
  }

 private:
  std::uint32_t until_;
};

/// Wrong where z is in the middle.
class ToyCertifier final : public Certifier {
 public:
  ToyCertifier(const Variable& variable, double wrong_below) : variable_(variable), wrong_below_(wrong_below) {}
  std::optional<std::vector<int>> classes(const belief::WorldState& state, double) const override {
    belief::Trajectory run;
    run.states = {state};
    const int right = variable_.classify(run);
    return std::vector<int>{std::abs(tests::z_of(state, 0)) < wrong_below_ ? 1 - right : right};
  }

 private:
  const Variable& variable_;
  double wrong_below_;
};

TEST(CertificateAudit, CancelledItCountsTheCertificatesThatWereKept) {
  core::ThreadPool pool(2);
  const core::RandomStream stream(1, core::Purpose::kTest);
  const ToyProblem problem = tests::one_boundary();
  const std::vector<Variable> variables = problem.variables();
  for (const double wrong_below : {0.0, 0.002, 0.1}) {
    const ToyCertifier certifier(variables[0], wrong_below);
    EstimatorOptions options;
    options.certifier = &certifier;
    options.audit_share = 0.2;
    options.exact_instances = 600;
    const auto run = [&](std::uint32_t until) {
      return estimate_outcomes(CertifiedSimulator(until), problem.starts(), variables, {}, stream, options, pool);
    };
    for (const std::uint32_t until : {40U, 77U, 150U, 311U}) {
      options.exact_instances = 600;
      const OutcomeEstimate cut = run(until);
      EXPECT_EQ(cut.stop, EstimateStop::kCancelled);
      ASSERT_GE(cut.instances.size(), 1U);
      EXPECT_LE(cut.certificates.certified, static_cast<int>(cut.instances.size()));
      options.exact_instances = static_cast<int>(cut.instances.size());
      const OutcomeEstimate replayed = run(1U << 31U);
      EXPECT_EQ(cut.certificates, replayed.certificates) << until << ", wrong below " << wrong_below;
      expect_equal(cut, replayed);
    }
  }
}

}  // namespace
}  // namespace prescene::simulation
