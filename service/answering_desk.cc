// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/answering_desk.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"

namespace prescene::service {
namespace {

/// Questions without limits of their own are bounded in time, so that a robot gets its answer.
void bound_effort(belief::Query& query, double seconds) {
  const auto bound = [seconds](belief::Effort& effort) {
    if (!effort.max_seconds && !effort.exact_instances) effort.max_seconds = seconds;
  };
  if (auto* predict = std::get_if<belief::PredictQuery>(&query.what)) bound(predict->effort);
  if (auto* stability = std::get_if<belief::StabilityQuery>(&query.what)) bound(stability->effort);
}

}  // namespace

std::string error_answer(const std::string& question_json, const std::string& text) {
  nlohmann::ordered_json answer = nlohmann::ordered_json::object();
  const auto question = nlohmann::ordered_json::parse(question_json, nullptr, false);
  if (question.is_object() && question.contains("id") && question["id"].is_string()) answer["id"] = question["id"];
  answer["error"] = text;
  return answer.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

AnsweringDesk::AnsweringDesk(Backends& backends, int threads, std::size_t max_waiting, double default_seconds,
                             std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer)
    : backends_(backends),
      pool_(threads),
      max_waiting_(max_waiting),
      default_seconds_(default_seconds),
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
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < max_waiting_) {
      waiting_.push_back(std::move(question_json));
      changed_.notify_all();
      return;
    }
  }
  on_answer_(question_json,
             error_answer(question_json, std::to_string(max_waiting_) + " questions wait already: ask again later"));
}

void AnsweringDesk::work() {
  for (;;) {
    std::string question;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_.requested() || !waiting_.empty(); });
      if (stop_.requested()) return;
      question = std::move(waiting_.front());
      waiting_.pop_front();
    }
    on_answer_(question, answer(question));
  }
}

std::string AnsweringDesk::answer(const std::string& question_json) {
  auto query = belief::query_from_json(question_json);
  if (!query) return error_answer(question_json, query.status().message());
  bound_effort(*query, default_seconds_);
  queries::QueryContext context = backends_.query_context(pool_);
  context.cancellation = &stop_;
  return belief::to_json(queries::answer(*snapshot_(), *query, context))
      .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace prescene::service
