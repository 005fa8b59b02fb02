// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/answering_desk.h"

#include <algorithm>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

// Longer ones are refused unread.
constexpr std::size_t kLongestQuestion = 1u << 20;
// Where there is no room, the id is looked for in questions up to this length only: in longer ones it takes too long.
constexpr std::size_t kLongestWithId = 4096;
constexpr std::size_t kMostRefusalsWaiting = 256;
// s between the last simulated instance and the end of all work on a question, at most.
constexpr double kRestSeconds = 1.5;

core::Cancellation::Clock::time_point deadline_after(double seconds) {
  return core::Cancellation::Clock::now() +
         std::chrono::duration_cast<core::Cancellation::Clock::duration>(std::chrono::duration<double>(seconds));
}

/// Questions without limits of their own are bounded in time, so that a robot gets its answer.
void bound_effort(belief::Query& query, const DeskSettings& settings) {
  const auto bound = [&settings](belief::Effort& effort) {
    if (!effort.exact_instances)
      effort.max_seconds = std::min(effort.max_seconds.value_or(settings.default_seconds), settings.most_seconds);
  };
  if (auto* predict = std::get_if<belief::PredictQuery>(&query.what)) bound(predict->effort);
  if (auto* stability = std::get_if<belief::StabilityQuery>(&query.what)) bound(stability->effort);
}

core::Status too_many_wait(std::size_t count) {
  return core::unavailable(std::to_string(count) + " " + kQuestionsWait + ": ask again later");
}

}  // namespace

std::string error_answer(const std::string& id, const core::Status& error) {
  nlohmann::ordered_json answer = nlohmann::ordered_json::object();
  if (!id.empty()) answer["id"] = id;
  answer.update(belief::error_to_json(error));
  return belief::json_text(answer);
}

AnsweringDesk::AnsweringDesk(Backends& backends, int threads, const DeskSettings& settings,
                             std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer)
    : backends_(backends),
      pool_(threads),
      settings_(settings),
      snapshot_(std::move(snapshot)),
      on_answer_(std::move(on_answer)),
      reader_([this] { read_questions(); }),
      simulator_([this] { simulate_questions(); }) {}

AnsweringDesk::~AnsweringDesk() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  read_changed_.notify_all();
  simulate_changed_.notify_all();
  reader_.join();
  simulator_.join();
}

DeskCounts AnsweringDesk::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void AnsweringDesk::ask(std::string question_json) {
  {
    const std::lock_guard lock(mutex_);
    const std::size_t bytes = std::min(question_json.size(), kLongestQuestion + 1);
    if (unread_.size() < settings_.max_unread && unread_bytes_ + bytes <= settings_.max_unread_bytes) {
      question_json.resize(bytes);  // what is longer is refused by the reader, and need not be kept
      unread_.push_back(std::move(question_json));
      unread_bytes_ += bytes;
      read_changed_.notify_one();
      return;
    }
    if (question_json.size() > kLongestWithId || too_many_.size() >= kMostRefusalsWaiting) {
      ++counts_.unanswered;
      return;
    }
  }
  std::string id = id_of(question_json);
  const std::lock_guard lock(mutex_);
  too_many_.push_back(std::move(id));
  read_changed_.notify_one();
}

void AnsweringDesk::read_questions() {
  for (bool refusals_first = false;; refusals_first = !refusals_first) {
    std::string question, id;
    bool is_refusal = false;
    {
      std::unique_lock lock(mutex_);
      read_changed_.wait(lock, [&] { return stop_.requested() || !unread_.empty() || !too_many_.empty(); });
      if (stop_.requested()) return;
      is_refusal = unread_.empty() || (refusals_first && !too_many_.empty());
      if (is_refusal) {
        id = std::move(too_many_.front());
        too_many_.pop_front();
      } else {
        question = std::move(unread_.front());
        unread_.pop_front();
        unread_bytes_ -= question.size();
      }
    }
    if (is_refusal)
      refuse(id, too_many_wait(settings_.max_unread));
    else
      read(question);
  }
}

void AnsweringDesk::read(const std::string& question_json) {
  std::string id;
  core::Status reason;
  try {
    if (question_json.size() > kLongestQuestion)
      return refuse("", core::resource_exhausted("the question is longer than " + std::to_string(kLongestQuestion) +
                                                 " bytes: make it shorter"));
    auto query = belief::query_from_json(question_json);
    if (!query) return refuse(id_of(question_json), query.status());
    if (std::holds_alternative<belief::WhereQuery>(query->what)) return answer(*query);
    id = query->id;
    bound_effort(*query, settings_);
    const std::lock_guard lock(mutex_);
    const auto is_same = [&id](const belief::Query& other) { return other.id == id; };
    if (!id.empty() && (id == id_in_work_ || std::any_of(waiting_.begin(), waiting_.end(), is_same))) {
      ++counts_.repeated;
      return;
    }
    if (waiting_.size() < settings_.max_waiting) {
      waiting_.push_back(*std::move(query));
      simulate_changed_.notify_one();
      return;
    }
    reason = too_many_wait(settings_.max_waiting);
  } catch (const std::exception& error) {
    note_failure(error.what());
    reason = core::unavailable(std::string("the question could not be read: ") + error.what());
  }
  refuse(id, reason);
}

void AnsweringDesk::simulate_questions() {
  for (;;) {
    belief::Query query;
    {
      std::unique_lock lock(mutex_);
      simulate_changed_.wait(lock, [&] { return stop_.requested() || !waiting_.empty(); });
      if (stop_.requested()) return;
      query = std::move(waiting_.front());
      waiting_.pop_front();
      id_in_work_ = query.id;
    }
    answer(query);
  }
}

void AnsweringDesk::answer(const belief::Query& query) {
  Reply reply;
  core::Status reason;
  try {
    reply = reply_to(query);
    if (reply.text.size() > interfaces::CdrLimits().max_string_bytes)
      reason = core::resource_exhausted("the answer has " + std::to_string(reply.text.size() >> 20) +
                                        " MiB, more than clients take: ask for less at a time");
  } catch (const std::bad_alloc&) {
    reason = core::resource_exhausted("the answer does not fit into the memory: ask for less");
  } catch (const std::exception& error) {
    note_failure(error.what());
    reason = core::unavailable(std::string("the question could not be answered: ") + error.what());
  }
  {
    // Before the answer goes out: whoever has it may ask under the same id again.
    const std::lock_guard lock(mutex_);
    if (!std::holds_alternative<belief::WhereQuery>(query.what)) id_in_work_.clear();
    if (reason.ok()) ++(reply.is_answer ? counts_.answered : counts_.refused);
  }
  if (reason.ok())
    send(reply.text);
  else
    refuse(query.id, reason);
}

AnsweringDesk::Reply AnsweringDesk::reply_to(const belief::Query& query) {
  queries::QueryContext context = backends_.query_context(pool_);
  const core::Cancellation end(stop_, deadline_after(settings_.most_seconds + kRestSeconds));
  context.cancellation = context.abandoned = &end;
  context.simulate_until = deadline_after(settings_.most_seconds);
  context.most_bytes = settings_.most_bytes;
  const std::shared_ptr<const belief::Belief> belief = snapshot_();
  // Before the first frame the scene file is all that is known, and says more than the particles drawn from it.
  const belief::Answer answer = belief->step == 0 ? queries::answer(belief->scene, belief->seed, query, context)
                                                  : queries::answer(*belief, query, context);
  return {belief::json_text(belief::to_json(answer)), answer.what.index() > 0};
}

void AnsweringDesk::refuse(const std::string& id, const core::Status& reason) {
  {
    const std::lock_guard lock(mutex_);
    ++counts_.refused;
  }
  send(error_answer(id, reason));
}

void AnsweringDesk::send(const std::string& answer) {
  try {
    on_answer_(answer);
  } catch (const std::exception& error) {
    note_failure(error.what());
  }
}

void AnsweringDesk::note_failure(const std::string& what) {
  const std::lock_guard lock(mutex_);
  ++counts_.failed;
  counts_.last_failure = what;
}

}  // namespace prescene::service
