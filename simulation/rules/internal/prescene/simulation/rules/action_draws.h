// SPDX-License-Identifier: Apache-2.0
// What is random in actions, drawn for one instance: by the simulator that executes them, and by who wants to know
// afterwards what it drew.
#pragma once

#include <optional>
#include <vector>

#include "prescene/belief/action.h"
#include "prescene/core/random.h"

namespace prescene::simulation {

struct DrawnAction {
  belief::Pose goal;                                    ///< Of place and transport.
  belief::Twist disturbance;                            ///< Of release.
  double sideways = 0.0;                                ///< Of push: the shift of its path to the left, m.
  belief::Vector3d impulse = belief::Vector3d::Zero();  ///< Of bump, N s.
  double force = 0.0;                                   ///< N: of a grip (each finger), pull, move_joint and insert.
  double torque = 0.0;                                  ///< N m: of insert.
  std::optional<double> friction = {};                  ///< Of a grip that has its own.
};

/// How many random numbers the actions of an instance take; 0 = nothing in them is random.
int action_dimensions(const std::vector<belief::Action>& actions);

/// One for each action. `stream` is the instance's own: stream.at(0, number of the instance) of the run's.
std::vector<DrawnAction> draw_actions(const std::vector<belief::Action>& actions, core::RandomStream stream);

/// The action with what was drawn in the place of its distributions.
void fix_draws(const DrawnAction& drawn, belief::Action& action);

}  // namespace prescene::simulation
