// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::simulation {
namespace {

template <class Distribution>
auto draw_from(const Distribution& distribution, core::RandomStream& stream) {
  std::vector<double> uniforms(static_cast<std::size_t>(belief::dimensions(distribution)));
  for (double& u : uniforms) u = stream.uniform();
  return belief::draw(distribution, uniforms);
}

/// Calls `each(distribution, drawn)` for what is random in an action, in the order in which it is drawn.
template <class Each>
void for_each_random(const belief::Action& action, DrawnAction& drawn, const Each& each) {
  if (const auto* place = std::get_if<belief::Place>(&action.what)) each(place->X_WO, drawn.goal);
  if (const auto* transport = std::get_if<belief::Transport>(&action.what)) each(transport->X_WO, drawn.goal);
  if (const auto* release = std::get_if<belief::Release>(&action.what)) each(release->disturbance, drawn.disturbance);
  if (const auto* push = std::get_if<belief::Push>(&action.what)) each(push->lateral_error, drawn.sideways);
  if (const auto* bump = std::get_if<belief::Bump>(&action.what)) each(bump->impulse, drawn.impulse);
  if (const auto* pull = std::get_if<belief::Pull>(&action.what)) each(pull->force, drawn.force);
  if (const auto* move = std::get_if<belief::MoveJoint>(&action.what)) each(move->force, drawn.force);
  if (const auto* insert = std::get_if<belief::Insert>(&action.what)) {
    each(insert->force, drawn.force);
    each(insert->torque, drawn.torque);
  }
  if (const auto* grasp = std::get_if<belief::Grasp>(&action.what); grasp != nullptr && grasp->grip) {
    each(grasp->grip->force, drawn.force);
    if (grasp->grip->friction) each(*grasp->grip->friction, drawn.friction.emplace());
  }
}

}  // namespace

int action_dimensions(const std::vector<belief::Action>& actions) {
  int sum = 0;
  DrawnAction unused;
  for (const belief::Action& action : actions)
    for_each_random(action, unused, [&](const auto& distribution, auto&) { sum += belief::dimensions(distribution); });
  return sum;
}

std::vector<DrawnAction> draw_actions(const std::vector<belief::Action>& actions, core::RandomStream stream) {
  std::vector<DrawnAction> drawn(actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i)
    for_each_random(actions[i], drawn[i],
                    [&](const auto& distribution, auto& to) { to = draw_from(distribution, stream); });
  return drawn;
}

void fix_draws(const DrawnAction& drawn, belief::Action& action) {
  if (auto* place = std::get_if<belief::Place>(&action.what)) place->X_WO = belief::FixedPose{drawn.goal};
  if (auto* transport = std::get_if<belief::Transport>(&action.what)) transport->X_WO = belief::FixedPose{drawn.goal};
  if (auto* push = std::get_if<belief::Push>(&action.what)) push->lateral_error = belief::FixedScalar{drawn.sideways};
  if (auto* release = std::get_if<belief::Release>(&action.what))
    release->disturbance = {belief::Vector3Distribution::fixed(drawn.disturbance.angular),
                            belief::Vector3Distribution::fixed(drawn.disturbance.linear)};
  if (auto* bump = std::get_if<belief::Bump>(&action.what))
    bump->impulse = belief::Vector3Distribution::fixed(drawn.impulse);
  if (auto* pull = std::get_if<belief::Pull>(&action.what)) pull->force = belief::FixedScalar{drawn.force};
  if (auto* move = std::get_if<belief::MoveJoint>(&action.what)) move->force = belief::FixedScalar{drawn.force};
  if (auto* insert = std::get_if<belief::Insert>(&action.what)) {
    insert->force = belief::FixedScalar{drawn.force};
    insert->torque = belief::FixedScalar{drawn.torque};
  }
  if (auto* grasp = std::get_if<belief::Grasp>(&action.what); grasp != nullptr && grasp->grip) {
    grasp->grip->force = belief::FixedScalar{drawn.force};
    if (drawn.friction) grasp->grip->friction = belief::FixedScalar{*drawn.friction};
  }
}

}  // namespace prescene::simulation
