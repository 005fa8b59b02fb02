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

}  // namespace

int action_dimensions(const std::vector<belief::Action>& actions) {
  int sum = 0;
  for (const belief::Action& action : actions) {
    if (const auto* place = std::get_if<belief::Place>(&action.what))
      sum += belief::dimensions(place->X_WO);
    else if (const auto* transport = std::get_if<belief::Transport>(&action.what))
      sum += belief::dimensions(transport->X_WO);
    else if (const auto* release = std::get_if<belief::Release>(&action.what))
      sum += belief::dimensions(release->disturbance);
    else if (const auto* push = std::get_if<belief::Push>(&action.what))
      sum += belief::dimensions(push->lateral_error);
  }
  return sum;
}

std::vector<DrawnAction> draw_actions(const std::vector<belief::Action>& actions, core::RandomStream stream) {
  std::vector<DrawnAction> drawn(actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i) {
    const belief::Action& action = actions[i];
    if (const auto* place = std::get_if<belief::Place>(&action.what))
      drawn[i].goal = draw_from(place->X_WO, stream);
    else if (const auto* transport = std::get_if<belief::Transport>(&action.what))
      drawn[i].goal = draw_from(transport->X_WO, stream);
    else if (const auto* release = std::get_if<belief::Release>(&action.what))
      drawn[i].disturbance = draw_from(release->disturbance, stream);
    else if (const auto* push = std::get_if<belief::Push>(&action.what))
      drawn[i].sideways = draw_from(push->lateral_error, stream);
  }
  return drawn;
}

}  // namespace prescene::simulation
