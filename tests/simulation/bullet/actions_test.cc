// SPDX-License-Identifier: Apache-2.0
// Actions, contacts and ends of runs.
#include "bullet_scenes.h"
#include "tests/support/grip_contract.h"

namespace prescene::tests {
namespace {

INSTANTIATE_TEST_SUITE_P(Bullet, StepperContract,
                         testing::Values(Stepper{"bullet",
                                                 [](const Scene& scene, const simulation::MechanicsOptions& options) {
                                                   return simulator_of(scene, simulation::BulletOptions{options});
                                                 },
                                                 1e-12}),
                         [](const auto& stepper) { return stepper.param.name; });

}  // namespace
}  // namespace prescene::tests
