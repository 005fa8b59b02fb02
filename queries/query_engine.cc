// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/query_engine.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <type_traits>
#include <utility>

#include "achieve.h"
#include "next_view.h"
#include "predict.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/check.h"
#include "prescene/queries/relation_history.h"
#include "prescene/queries/relations.h"
#include "remarks.h"
#include "stability.h"
#include "view.h"
#include "where.h"

namespace prescene::queries {
namespace {

template <class Value>
void put(core::Result<Value> result, belief::Answer& answer) {
  if (result)
    answer.what = *std::move(result);
  else
    answer.error = result.status();
}

/// Calls `task` with a context that ends a little after the effort's time.
template <class Task>
auto within_time(const belief::Effort& effort, const QueryContext& context, const Task& task) {
  if (!effort.max_seconds || effort.exact_instances) return task(context);
  const core::Cancellation never;
  const auto end = deadline_after(*effort.max_seconds + kEndAfter);
  const core::Cancellation cancelled(context.cancellation ? *context.cancellation : never, end);
  const core::Cancellation abandoned(context.abandoned ? *context.abandoned : never, end);
  QueryContext limited = context;
  limited.cancellation = &cancelled;
  limited.abandoned = &abandoned;
  const auto cut = deadline_after(*effort.max_seconds + kCutAfter);
  limited.simulate_until = std::min(context.simulate_until.value_or(cut), cut);
  return task(limited);
}

/// Of a belief, also where its prior would leave the object out.
template <class MakePrior>
core::Result<belief::NextViewAnswer> looked_for(const belief::Belief& belief, const belief::NextViewQuery& query,
                                                const QueryContext& context, const MakePrior&) {
  return next_view(belief, query, context);
}
template <class MakePrior>
core::Result<belief::NextViewAnswer> looked_for(const belief::Scene&, const belief::NextViewQuery& query,
                                                const QueryContext& context, const MakePrior& make_prior) {
  return next_view(make_prior(), query, context);
}

/// `make_prior` is called for what needs one, `ask_relations` for relations; `known` is the belief or the scene.
template <class Known, class MakePrior, class AskRelations>
void dispatch(const Known& known, const belief::Query& query, const QueryContext& context, const MakePrior& make_prior,
              const AskRelations& ask_relations, belief::Answer& answer) {
  PRESCENE_CHECK(context.pool != nullptr);
  answer.id = query.id;
  if (query.stream) answer.is_final = true;
  if (const core::Status asked = belief::validate(query); !asked.ok()) return put<belief::WhereAnswer>(asked, answer);
  // Tells what is known so far under the answer's id and step.
  const auto told = [&](auto so_far) {
    belief::Answer partial;
    partial.id = answer.id;
    partial.step = answer.step;
    partial.is_final = false;
    partial.what = std::move(so_far);
    context.on_answer_so_far(partial);
  };
  const bool tells = query.stream && context.on_answer_so_far;
  std::visit(
      [&](const auto& what) {
        using Asked = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<Asked, belief::WhereQuery>)
          put(where(known, what), answer);
        else if constexpr (std::is_same_v<Asked, belief::PredictQuery>)
          put(within_time(what.effort, context,
                          [&](const QueryContext& limited) {
                            return predict(make_prior(), what, limited,
                                           tells ? SoFarSink<belief::PredictAnswer>(told) : nullptr);
                          }),
              answer);
        else if constexpr (std::is_same_v<Asked, belief::StabilityQuery>)
          put(within_time(what.effort, context,
                          [&](const QueryContext& limited) {
                            return stability(make_prior(), what, limited,
                                             tells ? SoFarSink<belief::StabilityAnswer>(told) : nullptr);
                          }),
              answer);
        else if constexpr (std::is_same_v<Asked, belief::AchieveQuery>)
          put(within_time(what.effort, context,
                          [&](const QueryContext& limited) {
                            return achieve(make_prior(), what, limited,
                                           tells ? SoFarSink<belief::AchieveAnswer>(told) : nullptr);
                          }),
              answer);
        else if constexpr (std::is_same_v<Asked, belief::RelationsQuery>)
          put(ask_relations(what), answer);
        else if constexpr (std::is_same_v<Asked, belief::TimelineQuery>)
          put(observed(known, what, context), answer);
        else if constexpr (std::is_same_v<Asked, belief::NextViewQuery>)
          put(looked_for(known, what, context, make_prior), answer);
        else
          put(view(make_prior(), what, context), answer);
      },
      query.what);
}

}  // namespace

core::Cancellation::Clock::time_point deadline_after(double seconds) {
  return core::Cancellation::Clock::now() +
         std::chrono::duration_cast<core::Cancellation::Clock::duration>(std::chrono::duration<double>(seconds));
}

belief::Answer answer(const belief::Belief& snapshot, const belief::Query& query, const QueryContext& context) {
  PRESCENE_CHECK(snapshot.scene != nullptr);
  belief::Answer result;
  result.step = snapshot.step;
  dispatch(
      snapshot, query, context, [&] { return prior_of(snapshot); },
      [&](const belief::RelationsQuery& asked) { return relations(snapshot, asked, context); }, result);
  std::visit(
      [&](auto& what) {
        if constexpr (requires { what.remarks; }) remark_on_loose_joints(snapshot, what.remarks);
      },
      result.what);
  return result;
}

belief::Answer answer(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed, const belief::Query& query,
                      const QueryContext& context) {
  PRESCENE_CHECK(scene != nullptr);
  belief::Answer result;
  dispatch(
      *scene, query, context, [&] { return prior_of(scene, seed); },
      [&](const belief::RelationsQuery& asked) { return relations(scene, seed, asked, context); }, result);
  return result;
}

}  // namespace prescene::queries
