// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/query_engine.h"

#include <algorithm>
#include <chrono>
#include <optional>
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
    answer.error = result.status();
}

/// The estimator looks at its time limit between instances, which may be long ones; beyond this nothing goes on. What
/// is finished by then is the answer.
std::optional<core::Cancellation::Clock::time_point> last_moment(const belief::Effort& effort) {
  if (!effort.max_seconds || effort.exact_instances) return std::nullopt;
  constexpr double kMost = 1e6;  // s: far from the end of the clock
  const std::chrono::duration<double> most(2.0 * std::min(*effort.max_seconds, kMost) + 2.0);
  return core::Cancellation::Clock::now() + std::chrono::duration_cast<core::Cancellation::Clock::duration>(most);
}

/// Calls `task` with a context that ends at the last moment.
template <class Task>
auto within_time(const belief::Effort& effort, const QueryContext& context, const Task& task) {
  const core::Cancellation never;
  const auto end = last_moment(effort);
  if (!end) return task(context);
  const core::Cancellation limit(context.cancellation != nullptr ? *context.cancellation : never, *end);
  QueryContext limited = context;
  limited.cancellation = &limit;
  return task(limited);
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
          put(within_time(what.effort, context,
                          [&](const QueryContext& limited) { return predict(make_prior(), what, limited); }),
              answer);
        else if constexpr (std::is_same_v<Asked, belief::StabilityQuery>)
          put(within_time(what.effort, context,
                          [&](const QueryContext& limited) { return stability(make_prior(), what, limited); }),
              answer);
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
