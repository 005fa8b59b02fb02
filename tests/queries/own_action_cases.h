// SPDX-License-Identifier: Apache-2.0
// Kinds of actions that stand in for a scene's own, each with a law of its own for what comes of its numbers.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "prescene/queries/query_engine.h"
#include "tests/support/fake_simulator.h"

namespace prescene::queries::own_action_laws_test {

using belief::Action;

using Values = std::map<std::string, double>;

/// A kind of action in the sliding scene, how its numbers are written there by hand, and how far an instance's are from
/// those that would be best.
struct Case {
  std::string kind;
  Action own;
  std::vector<belief::ParameterRange> free;
  std::function<void(const Values&, belief::Scene&)> write;
  std::function<double(const std::vector<Action>&, const belief::WorldState&)> miss;
  bool carried = false;  // by a transport of the scene's before
};

template <class What>
const What& own_of(const std::vector<Action>& actions) {
  const What* found = nullptr;
  for (const Action& action : actions)
    if (const auto* one = std::get_if<What>(&action.what)) found = one;
  if (found == nullptr) throw std::logic_error("the action is not there");
  return *found;
}
template <class What>
What& own_of(std::vector<Action>& actions) {
  return const_cast<What&>(own_of<What>(std::as_const(actions)));
}

/// z of the mean, m.
double height_of(const belief::PoseDistribution& pose);
/// A unit vector in W's x-y plane.
geometry::Vector3d level(double direction_deg);
belief::Transport carry_to(const geometry::Vector3d& p, double duration = 0.5);

std::vector<Case> cases();
std::shared_ptr<belief::Scene> scene_of(const Case& one);
belief::AchieveQuery question(const Case& one);
/// The rougher the carton, the less the numbers may be off.
tests::FakeSimulator::Formula law_of(const Case& one);
belief::Answer ask(const Case& one, const belief::AchieveQuery& query, int threads = 2);

}  // namespace prescene::queries::own_action_laws_test
