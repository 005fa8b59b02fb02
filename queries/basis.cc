// SPDX-License-Identifier: Apache-2.0
#include "basis.h"

#include <algorithm>

#include "prescene/core/text.h"

namespace prescene::queries {
namespace {

void account_for(const simulation::OutcomeEstimate& estimate, const Foresight& foresight, belief::Basis& basis) {
  constexpr double kNoticed = 0.002;  // m: what poses that rest by a scene file's rounded numbers do not reach
  basis.instances = static_cast<int>(estimate.instances.size());
  basis.failed_instances = estimate.failed;
  basis.simulated_seconds = estimate.simulated_seconds;
  basis.flown_seconds = estimate.flown_seconds;
  basis.step = foresight.simulator->step_size();
  const simulation::StepperUse stepper = foresight.simulator->stepper();
  basis.stepper = stepper.name;
  basis.not_lockstep = stepper.not_lockstep;
  basis.hull_error = stepper.hull_error;
  basis.certificates = {foresight.certifier != nullptr, estimate.certificates.certified, estimate.certificates.audited,
                        estimate.certificates.mismatches, estimate.certificates.switched_off};
  for (const simulation::InstanceRecord& record : estimate.instances) {
    basis.dropped_contacts += record.dropped_contacts;
    if (record.dropped_contacts > 0) ++basis.crowded_instances;
    if (record.deepest_overlap <= kNoticed) continue;
    basis.overlapping_share += record.weight;
    basis.deepest_overlap = std::max(basis.deepest_overlap, record.deepest_overlap);
  }
  basis.wall_seconds = estimate.wall_seconds;
  basis.cpu_seconds = estimate.cpu_seconds;
  basis.converged = estimate.converged;
}

}  // namespace

void account(const Foresight& foresight, belief::Basis& basis) {
  account_for(foresight.estimate, foresight, basis);
  basis.stopped = simulation::to_string(foresight.estimate.stop);
}

void account_so_far(const Foresight& foresight, const simulation::OutcomeEstimate& so_far, belief::Basis& basis) {
  account_for(so_far, foresight, basis);
}

std::string missing_text(const std::vector<std::string>& missing) {
  std::string names;
  for (const std::string& part : missing) names += (names.empty() ? "" : ", ") + part;
  return "The time ran out, or the question was stopped, before all of the answer was worked out. Missing or "
         "incomplete: " +
         names + ". Give more time, or ask for less.";
}

void remark_on_leaving(const simulation::OutcomeEstimate& estimate, double radius, std::vector<std::string>& remarks) {
  double share = 0.0;
  for (const simulation::InstanceRecord& record : estimate.instances) {
    const auto& objects = record.final.objects;
    if (std::any_of(objects.begin(), objects.end(), [&](const belief::ObjectState& object) {
          return !record.failed && object.X_WO.translation.norm() > radius;
        }))
      share += record.weight;
  }
  if (share > 0.0)
    remarks.push_back("In " + core::fixed_text(100.0 * share, 1) + " % of the instances something got farther than " +
                      core::fixed_text(radius, 0) +
                      " m from the world's origin. It is not simulated beyond, and judged as it was there.");
}

void remark_on_certainty(const simulation::OutcomeEstimate& estimate, std::vector<std::string>& remarks) {
  if (estimate.certain)
    remarks.push_back(
        "Nothing in the scene is uncertain: one instance shows what the simulator does, not how sure that is.");
}

}  // namespace prescene::queries
