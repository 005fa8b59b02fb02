// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/query_engine.h"

#include <type_traits>
#include <utility>

#include "prescene/core/check.h"
#include "tasks.h"

namespace prescene::queries {
namespace {

template <class Value>
void put(core::Result<Value> result, belief::Answer& answer) {
  if (result)
    answer.what = *std::move(result);
  else
    answer.error = core::to_string(result.status());
}

/// `make_prior` is called for what needs one; `known` is the belief or the scene.
template <class Known, class MakePrior>
void dispatch(const Known& known, const belief::Query& query, const QueryContext& context, const MakePrior& make_prior,
              belief::Answer& answer) {
  PRESCENE_CHECK(context.pool != nullptr);
  answer.id = query.id;
  std::visit(
      [&](const auto& what) {
        using Asked = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<Asked, belief::WhereQuery>)
          put(where(known, what), answer);
        else if constexpr (std::is_same_v<Asked, belief::PredictQuery>)
          put(predict(make_prior(), what, context), answer);
        else if constexpr (std::is_same_v<Asked, belief::StabilityQuery>)
          put(stability(make_prior(), what, context), answer);
        else
          put(view(make_prior(), what, context), answer);
      },
      query.what);
}

}  // namespace

belief::Answer answer(const belief::Belief& snapshot, const belief::Query& query, const QueryContext& context) {
  PRESCENE_CHECK(snapshot.scene != nullptr);
  belief::Answer result;
  result.step = snapshot.step;
  dispatch(
      snapshot, query, context, [&] { return prior_of(snapshot); }, result);
  return result;
}

belief::Answer answer(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed, const belief::Query& query,
                      const QueryContext& context) {
  PRESCENE_CHECK(scene != nullptr);
  belief::Answer result;
  dispatch(
      *scene, query, context, [&] { return prior_of(scene, seed); }, result);
  return result;
}

}  // namespace prescene::queries
