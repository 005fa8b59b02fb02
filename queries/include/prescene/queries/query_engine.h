// SPDX-License-Identifier: Apache-2.0
// Answers questions about a belief, or about a scene of which nothing has been seen yet.
//
//   QueryContext context;
//   context.make_simulator = make_simulator;        // of a scene, by a backend: simulation/bullet or lockstep
//   context.pool = &pool;
//   belief::Answer answer = queries::answer(*snapshot, query, context);
//   if (!answer.error.ok()) ...
//
// Questions of eight kinds (belief::Query): `where` is everything, how are things related now (`relations`) and in
// what was observed (`timeline`): actual belief; what happens if (`predict`), does it stay (`stability`): state
// anticipation; what will the camera see (`view`), and from where would it see what is not known yet (`next_view`):
// observation anticipation; how must it be done, so that an outcome comes about (`achieve`): state explanation.
// docs/reference/queries.md says what the answers mean.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>

#include "prescene/belief/query.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/renderer.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::queries {

/// What answering takes; made by whoever chooses backends.
struct QueryContext {
  /// Of the scene to simulate: the belief's, with its objects where the belief has them. Needed by all but `where` and
  /// `next_view`; steps of another length only where PredictDetail::model_error is asked for.
  simulation::SimulatorFactory make_simulator;
  /// MechanicsOptions::edge_rounding of those simulators, m.
  double edge_rounding = simulation::MechanicsOptions{}.edge_rounding;
  /// Where shapes are kept over queries; null: answers have no belief::FlightForecast.
  simulation::ShapeStore* shapes = nullptr;
  /// Needed by `view` and `next_view`; called once a query.
  std::function<core::Result<std::unique_ptr<rendering::Renderer>>()> make_renderer;
  /// Never null. Its number of threads does not change answers.
  core::ThreadPool* pool = nullptr;
  /// Meshes to draw, kept over queries; may be null.
  filter::MeshCache* meshes = nullptr;
  /// May be null. A cancelled query simulates no more: it is answered from the instances that were finished, without
  /// the parts that take further ones; those are named in its remarks.
  const core::Cancellation* cancellation = nullptr;
  /// May be null. Nobody waits for the answer any more: the rest of the work is left out too.
  const core::Cancellation* abandoned = nullptr;
  /// From this moment on the probabilities are those of the instances that were finished; all else is still worked out.
  std::optional<core::Cancellation::Clock::time_point> simulate_until;
  /// Memory that instances and their states, or simulated images, may take, bytes: no more are run, and what needs more
  /// is refused.
  std::size_t most_bytes = std::size_t{16} << 30;
  /// What was observed until now, of TimelineQuery; may be empty, or give null, where nothing was kept.
  std::function<std::shared_ptr<const belief::ObservedTimeline>()> timeline;
  /// Called from the calling thread; may be empty.
  core::ProgressSink progress;
  /// Of a query that is to be streamed (belief::Query::stream): called from the calling thread with what is known so
  /// far, as soon as some instances are done and whenever there is more to tell; may be empty. Its intervals hold
  /// together (docs/reference/queries.md). Does not change the answer.
  std::function<void(const belief::Answer& so_far)> on_answer_so_far;
};

/// How long an answer takes beyond its Effort::max_seconds, s: instances under way are cut off after the first, and all
/// else ends after the second; what had to be left out is named in the remarks.
inline constexpr double kCutAfter = 0.6, kEndAfter = 1.5;

/// So many seconds from now, for QueryContext::simulate_until and cancellations.
core::Cancellation::Clock::time_point deadline_after(double seconds);

/// Answers from a snapshot. Objects that are lost or probably not there (existence below 1/2) take no part. The same
/// snapshot and query give the same answer (wall times aside), unless time ran out: then the answer's number of
/// instances, given as Effort::exact_instances, gives it again. What can't be answered has its reason in Answer::error.
belief::Answer answer(const belief::Belief& snapshot, const belief::Query& query, const QueryContext& context);

/// Answers from a scene's priors: the distributions of its file. Without actions in the query, the scene's are taken.
belief::Answer answer(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed, const belief::Query& query,
                      const QueryContext& context);

}  // namespace prescene::queries
