// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/answering_desk.h"

#include <algorithm>
#include <new>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

// Longer ones are refused by the reader of questions in any case.
constexpr std::size_t kLongestWithId = 1u << 20;

core::Cancellation::Clock::time_point deadline_after(double seconds) {
  return core::Cancellation::Clock::now() +
         std::chrono::duration_cast<core::Cancellation::Clock::duration>(std::chrono::duration<double>(seconds));
}

/// Questions without limits of their own are bounded in time, so that a robot gets its answer.
void bound_effort(belief::Query& query, double seconds) {
  const auto bound = [seconds](belief::Effort& effort) {
    if (!effort.max_seconds && !effort.exact_instances) effort.max_seconds = seconds;
  };
  if (auto* predict = std::get_if<belief::PredictQuery>(&query.what)) bound(predict->effort);
  if (auto* stability = std::get_if<belief::StabilityQuery>(&query.what)) bound(stability->effort);
}

}  // namespace

std::string error_answer(const std::string& question_json, const core::Status& error) {
  nlohmann::ordered_json answer = nlohmann::ordered_json::object();
  if (const std::string id = id_of(question_json); !id.empty()) answer["id"] = id;
  answer.update(belief::error_to_json(error));
  return answer.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

AnsweringDesk::AnsweringDesk(Backends& backends, int threads, const DeskSettings& settings,
                             std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer)
    : backends_(backends),
      pool_(threads),
      settings_(settings),
      snapshot_(std::move(snapshot)),
      on_answer_(std::move(on_answer)),
      thread_([this] { work(); }) {}

AnsweringDesk::~AnsweringDesk() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  changed_.notify_all();
  thread_.join();
}

void AnsweringDesk::ask(std::string question_json) {
  const auto question =
      question_json.size() <= kLongestWithId ? parse_or_discard(question_json) : nlohmann::ordered_json();
  std::string id = id_of_document(question);
  const bool is_quick = question.contains("where");
  {
    const std::lock_guard lock(mutex_);
    const auto is_same = [&id](const Waiting& other) { return other.id == id; };
    if (!id.empty() && (id == id_in_work_ || std::any_of(waiting_.begin(), waiting_.end(), is_same))) return;
    if (waiting_.size() < settings_.max_waiting) {
      const auto place = is_quick ? std::ranges::find(waiting_, false, &Waiting::is_quick) : waiting_.end();
      waiting_.insert(place, {std::move(id), std::move(question_json), is_quick});
      changed_.notify_all();
      return;
    }
  }
  on_answer_(question_json, error_answer(question_json, core::unavailable(std::to_string(settings_.max_waiting) + " " +
                                                                          kQuestionsWait + ": ask again later")));
}

void AnsweringDesk::work() {
  for (;;) {
    std::string question;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_.requested() || !waiting_.empty(); });
      if (stop_.requested()) return;
      question = std::move(waiting_.front().question);
      id_in_work_ = std::move(waiting_.front().id);
      waiting_.pop_front();
    }
    const std::string answered = answer(question);
    {
      const std::lock_guard lock(mutex_);
      id_in_work_.clear();
    }
    on_answer_(question, answered);
  }
}

std::string AnsweringDesk::answer(const std::string& question_json) {
  auto query = belief::query_from_json(question_json);
  if (!query) return error_answer(question_json, query.status());
  bound_effort(*query, settings_.default_seconds);
  queries::QueryContext context = backends_.query_context(pool_);
  const core::Cancellation limit(stop_, deadline_after(settings_.most_seconds));
  context.cancellation = &limit;
  try {
    const std::shared_ptr<const belief::Belief> belief = snapshot_();
    // Before the first frame the scene file is all that is known, and says more than the particles drawn from it.
    const belief::Answer answer = belief->step == 0 ? queries::answer(belief->scene, belief->seed, *query, context)
                                                    : queries::answer(*belief, *query, context);
    std::string text = belief::to_json(answer).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    if (text.size() <= interfaces::CdrLimits().max_string_bytes) return text;
    return error_answer(question_json,
                        core::resource_exhausted("the answer has " + std::to_string(text.size() >> 20) +
                                                 " MiB, more than clients take: ask for less at a time"));
  } catch (const std::bad_alloc&) {
    return error_answer(question_json,
                        core::resource_exhausted("the answer does not fit into the memory: ask for less"));
  }
}

}  // namespace prescene::service
