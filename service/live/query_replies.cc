// SPDX-License-Identifier: Apache-2.0
#include "query_replies.h"

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "prescene/belief/json.h"

namespace prescene::service {
namespace {

// s between the last simulated instance and the end of all work on a question, at most.
constexpr double kRestSeconds = 1.5;
constexpr double kProgressInterval = 0.2;  // s, at least, between two messages on how far the work is

}  // namespace

std::string error_answer(const std::string& id, const core::Status& error) {
  nlohmann::ordered_json answer = nlohmann::ordered_json::object();
  if (!id.empty()) answer["id"] = id;
  answer.update(belief::error_to_json(error));
  return belief::json_text(answer);
}

void add_learned_seconds(core::TimeNs first_frame_ns, nlohmann::ordered_json& objects) {
  for (nlohmann::ordered_json& object : objects) {
    const core::TimeNs learned_ns = object.value("learned_ns", core::TimeNs{0});
    object["learned_s"] = object.value("lessons", 0) > 0
                              ? nlohmann::ordered_json(core::seconds_of(learned_ns - first_frame_ns))
                              : nlohmann::ordered_json();
  }
}

QueryReplies::QueryReplies(Backends& backends, const QueryWorkerSettings& settings,
                           std::function<std::shared_ptr<const belief::Belief>()> snapshot)
    : backends_(backends), settings_(settings), snapshot_(std::move(snapshot)) {}

core::ProgressSink QueryReplies::progress_of(const std::string& id) const {
  if (!settings_.on_progress || id.empty()) return {};
  return [this, id, told = std::optional<core::Stopwatch>()](const core::Progress& at) mutable {
    if (told && told->seconds() < kProgressInterval) return;
    told.emplace();
    nlohmann::ordered_json json{{"id", id}, {"fraction", at.fraction}, {"text", at.text}, {"seconds_left", nullptr}};
    if (at.seconds_left) json["seconds_left"] = *at.seconds_left;
    try {
      settings_.on_progress(belief::json_text(json));
    } catch (const std::exception&) {  // no reason to end the work
    }
  };
}

std::function<void(const belief::Answer&)> QueryReplies::so_far_of(const belief::Query& query) const {
  if (!settings_.on_answer_so_far || !query.stream || query.id.empty()) return {};
  return [this, told = std::optional<core::Stopwatch>()](const belief::Answer& so_far) mutable {
    if (told && told->seconds() < kSoFarInterval) return;
    try {
      settings_.on_answer_so_far(belief::json_text(belief::to_json(so_far)));
    } catch (const std::exception&) {  // no reason to end the work
    }
    told.emplace();
  };
}

template <class FrameQuestion, class AnswerIt>
QueryReplies::Reply QueryReplies::reply_from_frames(const FrameQuestion& question, const AnswerIt& answer_it,
                                                    queries::QueryContext context,
                                                    const core::Cancellation& cancelled) const {
  if (!answer_it)
    return {error_answer(question.id, core::unavailable("frames are not kept here, so that nothing can be explained")),
            false};
  if (question.max_seconds)
    context.simulate_until = std::min(*context.simulate_until, queries::deadline_after(*question.max_seconds));
  auto document = answer_it(question, context);
  if (document && question.stream) (*document)["final"] = true;
  if (document) return {belief::json_text(*document), true};
  // Its time was over in the middle of a search, unless somebody stopped it.
  const bool too_late = document.status().code() == core::StatusCode::kCancelled && !cancelled.requested();
  return {error_answer(question.id,
                       too_late ? core::unavailable("the time ran out: give an object, a shorter window or fewer "
                                                    "points, or let questions take longer (--most-question-seconds)")
                                : document.status()),
          false};
}

QueryReplies::Reply QueryReplies::reply_to(const AnyQuestion& question, const ReplyTerms& terms,
                                           const core::Cancellation& cancelled, core::ThreadPool& pool) const {
  queries::QueryContext context = backends_.query_context(pool);
  const core::Cancellation end(cancelled, queries::deadline_after(terms.most_seconds + kRestSeconds));
  context.cancellation = context.abandoned = &end;
  context.simulate_until = queries::deadline_after(terms.most_seconds);
  context.most_bytes = settings_.most_bytes;
  context.timeline = settings_.timeline;
  if (terms.tells_progress) context.progress = progress_of(id_in(question));
  if (context.progress) context.progress({0.0, std::nullopt, "begun"});
  if (const auto* to_explain = std::get_if<belief::ExplainQuestion>(&question))
    return reply_from_frames(*to_explain, settings_.explain, context, cancelled);
  if (const auto* why = std::get_if<belief::WhyQuestion>(&question))
    return reply_from_frames(*why, settings_.why, context, cancelled);
  const auto& query = std::get<belief::Query>(question);
  context.on_answer_so_far = so_far_of(query);
  return reply_to_query(query, terms, context);
}

QueryReplies::Reply QueryReplies::reply_to_query(const belief::Query& query, const ReplyTerms& terms,
                                                 const queries::QueryContext& context) const {
  const std::shared_ptr<const belief::Belief> belief = snapshot_();
  // Before the first frame the scene file is all that is known, and says more than the particles drawn from it.
  const belief::Answer answer = belief->step == 0 ? queries::answer(belief->scene, belief->seed, query, context)
                                                  : queries::answer(*belief, query, context);
  nlohmann::ordered_json document = belief::to_json(answer);
  // Before the first frame nothing was learned in this session.
  if (terms.session_begin_ns != 0 && std::holds_alternative<belief::WhereAnswer>(answer.what))
    add_learned_seconds(terms.session_begin_ns, document["where"]["items"]);
  return {belief::json_text(document), answer.what.index() > 0};
}

}  // namespace prescene::service
