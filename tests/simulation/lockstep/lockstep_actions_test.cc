// SPDX-License-Identifier: Apache-2.0
// Actions, contacts and ends of runs, as of any stepper.
#include "lockstep_scenes.h"
#include "tests/support/grip_contract.h"

namespace prescene::tests {
namespace {

INSTANTIATE_TEST_SUITE_P(Lockstep, StepperContract,
                         testing::Values(Stepper{"lockstep",
                                                 [](const Scene& scene, const simulation::MechanicsOptions& options) {
                                                   return lockstep_of(scene, simulation::LockstepOptions{options});
                                                 },
                                                 2e-6}),
                         [](const auto& stepper) { return stepper.param.name; });

}  // namespace
}  // namespace prescene::tests
