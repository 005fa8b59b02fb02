// SPDX-License-Identifier: Apache-2.0
// Object stability: does it stay as it is, or as it is when it is let go now?
#include <utility>

#include "basis.h"
#include "foresee.h"
#include "prescene/queries/typical_runs.h"
#include "remarks.h"
#include "stability.h"
#include "stability_margin.h"

namespace prescene::queries {
namespace {

/// Lets go of the object now. The hand leaves as the scene's own release says, else straight away from the object.
belief::Action release_now(const Prior& prior, std::size_t object) {
  const belief::SceneObject& held = prior.scene->objects[object];
  for (const belief::Action& action : prior.scene->actions) {
    const auto* release = std::get_if<belief::Release>(&action.what);
    if (release != nullptr && release->object == held.name) return {0.0, *release};
  }
  belief::Release release;
  release.object = held.name;
  release.retreat_duration = kRetreatDuration;
  release.retreat = kRetreat * geometry::Vector3d::UnitZ();
  const std::optional<int> hand = belief::find_robot_body(*prior.scene, *held.held_by);
  if (hand) {
    const belief::Pose X_WG = belief::pose_at(prior.scene->robot[static_cast<std::size_t>(*hand)], 0.0);
    const geometry::Vector3d away = X_WG.translation - prior.likeliest.objects[object].X_WO.translation;
    if (away.norm() > 1e-3) release.retreat = kRetreat * away.normalized();
  }
  return {0.0, release};
}

}  // namespace

core::Result<belief::StabilityAnswer> stability(const Prior& prior, const belief::StabilityQuery& query,
                                                const QueryContext& context,
                                                const SoFarSink<belief::StabilityAnswer>& so_far) {
  if (!(query.max_move > 0.0) || !(query.max_turn > 0.0))
    return core::invalid_input("max_move and max_turn have to be more than 0");
  const std::optional<int> object = belief::find_object(*prior.scene, query.object);
  if (!object) return no_such_object(prior, query.object);
  const auto index = static_cast<std::size_t>(*object);
  std::vector<belief::Action> actions;
  if (prior.scene->objects[index].held_by) actions.push_back(release_now(prior, index));

  const auto ever = [&](const char* name, belief::Predicate predicate) {
    return belief::Outcome{name, query.object, {belief::Condition{std::move(predicate), belief::When::kEver, false}}};
  };
  belief::ExclusiveOutcomes group{
      "stability",
      {ever("moves", belief::MovedMoreThan{query.max_move}), ever("turns", belief::TurnedMoreThan{query.max_turn})}};
  PRESCENE_TRY(auto scene, with_question(*prior.scene, std::move(actions), {}, {std::move(group)}));
  const auto begun = [&query](const simulation::OutcomeEstimate& estimate) {
    const simulation::ClassEstimate& stays = estimate.variables[0].classes[2];  // neither moves nor turns
    belief::StabilityAnswer answer;
    answer.object = query.object;
    answer.stable = {"stable", "", stays.probability, stays.low, stays.high};
    return answer;
  };
  ForesightDetail detail;
  if (so_far)
    detail.so_far = [&](const Foresight& foresight, const simulation::OutcomeEstimate& estimate) {
      belief::StabilityAnswer answer = begun(estimate);
      account_so_far(foresight, estimate, answer);
      so_far(std::move(answer));
    };
  PRESCENE_TRY(const Foresight foresight,
               foresee(prior, std::move(scene), query.duration, query.effort, context, detail));

  belief::StabilityAnswer answer = begun(foresight.estimate);
  account(foresight, answer);
  answer.remarks = remarks_of(answer, query.effort);
  if (const std::optional<std::size_t> unstable = typical_instance(foresight, 0, {0, 1}, index)) {
    if (const auto run = run_again(foresight, prior, *unstable, context))
      answer.likely_event = event_text(*foresight.scene, *run, *object, query.max_move, query.max_turn);
    else
      answer.remarks.push_back(missing_text({"likely_event"}));
  }
  remark_on_leaving(foresight.estimate, foresight.request.stop.world_radius, answer.remarks);
  remark_on_certainty(foresight.estimate, answer.remarks);
  PRESCENE_RETURN_IF_ERROR(add_stability_detail(prior, index, query, context, answer));
  return answer;
}

}  // namespace prescene::queries
