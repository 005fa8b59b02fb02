// SPDX-License-Identifier: Apache-2.0
// Ends instances whose outcome is decided: the energy that is left can't change it any more.
//
// Potential and kinetic energy of all bodies together never grow, so no centre of mass gets higher than its share of
// them lifts it. Compared with the least heights that ways to another answer pass: tipping over an edge of the body or
// of what it stands on, climbing over a rim. What has fallen off the edge of everything is decided by where it lands.
// docs/studies/uncertain_physics.md has the conditions; they are conservative where they can be and audited where not.
//
//   const auto certifier = make_certifier(scene, variables, request);   // null: nothing that it understands
//   options.certifier = certifier.get();                                // of estimate_outcomes
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

struct CertifierOptions {
  /// Where the spheres of objects that collide as spheres are kept; without it, scenes that have such get no
  /// certificates.
  ShapeStore* shapes = nullptr;
  /// MechanicsOptions::edge_rounding of the simulator that runs the instances, m.
  double edge_rounding = MechanicsOptions{}.edge_rounding;
  /// Simulator::length_scale() of that simulator: rooms for its errors, and the rounding of edges, are as many times
  /// larger.
  double length_scale = 1.0;
  /// Off only to see that the audit catches it: supports are taken to be without edges.
  bool shorten_arms = true;
  /// Looked at between the conditions, each of which takes some milliseconds; may be null.
  const core::Cancellation* cancellation = nullptr;
};

class Certifier : public EndRule {
 public:
  /// The class of every variable, where all are decided. Pure.
  virtual std::optional<std::vector<int>> classes(const belief::WorldState& state, double seconds_left) const = 0;
  bool ends(const belief::WorldState& state, double seconds_left) const final {
    return classes(state, seconds_left).has_value();
  }
};

/// Understands conditions at the end: inside a volume, below a height, upright, a face up, resting on a support or
/// object; and actions that let go. Null where any variable needs something else, gravity is not along -z of W, or
/// spheres stand for a support, or when it is cancelled. `request` gives actions and duration.
std::unique_ptr<const Certifier> make_certifier(const std::shared_ptr<const belief::Scene>& scene,
                                                std::span<const Variable> variables, const RunRequest& request,
                                                const CertifierOptions& options = {});

}  // namespace prescene::simulation
