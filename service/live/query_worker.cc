// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/query_worker.h"

#include <algorithm>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/thread_priority.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"
#include "query_replies.h"

namespace prescene::service {
namespace {

// Longer ones are refused unread.
constexpr std::size_t kLongestQuestion = 1u << 20;
// Where there is no room, the id is looked for in questions up to this length only: in longer ones it takes too long.
constexpr std::size_t kLongestWithId = 4096;
constexpr std::size_t kMostRefusalsWaiting = 256;

/// Questions without limits of their own are bounded in time, so that a robot gets its answer.
void bound_effort(belief::Query& query, double default_seconds, double most_seconds) {
  const auto bound = [=](belief::Effort& effort) {
    if (!effort.exact_instances)
      effort.max_seconds = std::min(effort.max_seconds.value_or(default_seconds), most_seconds);
  };
  if (auto* predict = std::get_if<belief::PredictQuery>(&query.what)) bound(predict->effort);
  if (auto* stability = std::get_if<belief::StabilityQuery>(&query.what)) bound(stability->effort);
  if (auto* achieve = std::get_if<belief::AchieveQuery>(&query.what)) bound(achieve->effort);
}

/// Nothing where the text is no request to cancel.
std::optional<core::Result<CancelRequest>> cancel_request(const std::string& text) {
  // Looked for first, as all but a few texts are questions and need not be parsed twice.
  if (text.find("\"cancel\"") == std::string::npos) return std::nullopt;
  const auto document = belief::parse_json(text, kLongestWithId);
  if (!document || !document->is_object() || !document->contains("cancel")) return std::nullopt;
  const auto& question = document->at("cancel");
  CancelRequest request{question.is_string() ? question.get<std::string>() : "", id_of_document(*document)};
  if (!request.question.empty() && document->size() == (document->contains("id") ? 2U : 1U)) return request;
  return core::invalid_input("cancel: give the id of a question: {\"cancel\": \"7\"}");
}

core::Status no_room(FairBound bound, const FairLimits& limits) {
  const std::string wait = std::string(" ") + kQuestionsWait;
  switch (bound) {
    case FairBound::kOfClient:
      return core::unavailable(std::to_string(limits.of_client) + wait +
                               ", as many as one client may have waiting: ask again later");
    case FairBound::kOfAll:
      return core::unavailable(std::to_string(limits.of_all) + wait +
                               ", as many as may wait of all clients together, and of this one as many as of any "
                               "other or more: ask again later");
    case FairBound::kBytesOfAll:
      return core::unavailable("so many long" + wait + " that the " + std::to_string(limits.bytes_of_all >> 10) +
                               " KiB for their text are full: ask again later, or give shorter ones");
  }
  return core::unavailable(kQuestionsWait);
}

}  // namespace

QueryWorker::QueryWorker(Backends& backends, int threads, const QueryWorkerSettings& settings,
                         std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer)
    : settings_(settings),
      default_seconds_(settings.default_seconds),
      most_seconds_(settings.most_seconds),
      replies_(std::make_unique<QueryReplies>(backends, settings_, std::move(snapshot))),
      on_answer_(std::move(on_answer)),
      unread_(settings.unread),
      waiting_(settings.waiting) {
  const auto at_once = static_cast<std::size_t>(std::max(1, settings.at_once));
  in_work_.resize(at_once);
  for (std::size_t i = 0; i < at_once; ++i)
    pools_.push_back(std::make_unique<core::ThreadPool>(threads, core::PoolPriority::kLow));
  try {
    reader_ = std::thread([this] { read_questions(); });
    for (std::size_t i = 0; i < at_once; ++i) simulators_.emplace_back([this, i] { simulate_questions(i); });
  } catch (...) {  // no memory for one: the others must end before this object does
    end_threads();
    throw;
  }
}

QueryWorker::~QueryWorker() { end_threads(); }

void QueryWorker::end_threads() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  read_changed_.notify_all();
  simulate_changed_.notify_all();
  if (reader_.joinable()) reader_.join();
  for (std::thread& simulator : simulators_) simulator.join();
}

QueryCounts QueryWorker::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void QueryWorker::ask(std::string question_json, const std::string& client) {
  try {
    take(std::move(question_json), client);
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::take(std::string question_json, const std::string& client) {
  const std::size_t bytes = std::min(question_json.size(), kLongestQuestion + 1);
  if (question_json.size() > bytes) {  // what is longer is refused by the reader, and need not be kept
    question_json.resize(bytes);
    question_json.shrink_to_fit();
  }
  std::vector<FairQueue<std::string>::Refused> refused;
  {
    const std::lock_guard lock(mutex_);
    refused = unread_.push(client, std::move(question_json), bytes);
    read_changed_.notify_one();
  }
  for (const auto& one : refused) note_no_room(one.item, no_room(one.bound, settings_.unread));
}

void QueryWorker::note_no_room(const std::string& question_json, const core::Status& reason) {
  try {
    {
      const std::lock_guard lock(mutex_);
      if (question_json.size() > kLongestWithId || too_many_.size() >= kMostRefusalsWaiting) {
        ++counts_.unanswered;
        return;
      }
    }
    turn_away(id_of(question_json), reason);
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::turn_away(const std::string& id, const core::Status& reason) {
  try {
    Refusal refusal{id.size() <= kLongestWithId ? id : "", reason};
    const std::lock_guard lock(mutex_);
    if (too_many_.size() >= kMostRefusalsWaiting) {
      ++counts_.unanswered;
      return;
    }
    too_many_.push_back(std::move(refusal));
    read_changed_.notify_one();
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::read_questions() {
  for (bool refusals_first = false;; refusals_first = !refusals_first) {
    std::optional<FairQueue<std::string>::Entry> question;
    Refusal refusal;
    {
      std::unique_lock lock(mutex_);
      read_changed_.wait(lock, [&] { return stop_.requested() || !unread_.empty() || !too_many_.empty(); });
      if (stop_.requested()) return;
      if (unread_.empty() || (refusals_first && !too_many_.empty())) {
        refusal = std::move(too_many_.front());
        too_many_.pop_front();
      } else {
        question = unread_.pop();
      }
    }
    if (question)
      read(question->item, *question->client);
    else
      refuse(refusal.id, refusal.reason);
  }
}

void QueryWorker::read(const std::string& question_json, const std::string& client) {
  std::string id;
  try {
    if (question_json.size() > kLongestQuestion)
      return refuse("", core::resource_exhausted("the question is longer than " + std::to_string(kLongestQuestion) +
                                                 " bytes: make it shorter"));
    if (const auto request = cancel_request(question_json)) {
      if (!*request) return refuse(id_of(question_json), request->status());
      return cancel(**request);
    }
    std::shared_ptr<const AnyQuestion> question;
    if (belief::asks_to_explain(question_json)) {
      auto read = belief::explain_question_from_json(question_json);
      if (!read) return refuse(id_of(question_json), read.status());
      question = std::make_shared<const AnyQuestion>(*std::move(read));
    } else if (belief::asks_why(question_json)) {
      auto read = belief::why_question_from_json(question_json);
      if (!read) return refuse(id_of(question_json), read.status());
      question = std::make_shared<const AnyQuestion>(*std::move(read));
    } else {
      auto read = belief::query_from_json(question_json);
      if (!read) return refuse(id_of(question_json), read.status());
      const bool at_once = std::holds_alternative<belief::WhereQuery>(read->what) ||
                           std::holds_alternative<belief::TimelineQuery>(read->what);
      if (!at_once) bound_effort(*read, default_seconds_, most_seconds_);
      question = std::make_shared<const AnyQuestion>(*std::move(read));
      if (at_once) return answer(*question, stop_, *pools_.front());
    }
    id = id_in(*question);
    core::Status reason;
    std::vector<FairQueue<Work>::Refused> refused;
    {
      const std::lock_guard lock(mutex_);
      if (const Work* other = id.empty() ? nullptr : find_work(id)) {
        if (*other->question == *question) {
          ++counts_.repeated;
          return;
        }
        reason = core::invalid_input("another question with the id '" + id +
                                     "' is not answered yet: choose another id, one that no other client uses");
      } else {
        auto end = std::make_shared<core::Cancellation>(stop_, core::Cancellation::Clock::time_point::max());
        refused = waiting_.push(client, {question, std::move(end)}, question_json.size());
        simulate_changed_.notify_one();
      }
    }
    for (const auto& one : refused) refuse(id_in(*one.item.question), no_room(one.bound, settings_.waiting));
    if (!reason.ok()) refuse(id, reason);
  } catch (const std::exception&) {
    refuse_after_exception(id, "the question could not be read");
  }
}

const QueryWorker::Work* QueryWorker::find_work(const std::string& id) const {
  const auto has_id = [&id](const Work& work) { return work.question && id_in(*work.question) == id; };
  for (const Simulating& one : in_work_)
    if (has_id(one.work)) return &one.work;
  return waiting_.find_if(has_id);
}

void QueryWorker::cancel(const CancelRequest& request) {
  bool waited = false, worked_on = false;
  {
    const std::lock_guard lock(mutex_);
    ++counts_.cancels;
    const auto is_meant = [&](const Work& work) { return work.question && id_in(*work.question) == request.question; };
    for (const Simulating& one : in_work_) {
      if (!is_meant(one.work)) continue;
      worked_on = true;
      one.work.end->request();  // its answer says the rest
    }
    waited = waiting_.erase_if(is_meant) > 0;
  }
  if (waited) refuse(request.question, core::cancelled("cancelled before it was begun"));
  if (request.id.empty()) return;
  send(waited || worked_on
           ? belief::json_text({{"id", request.id}, {"cancelled", request.question}})
           : error_answer(request.id, core::not_found("no question with the id '" + request.question +
                                                      "' waits or is worked on: it may be answered already")),
       nullptr);
}

std::optional<FairQueue<QueryWorker::Work>::Entry> QueryWorker::take_next() {
  const auto is_of_frames = [](const Work& work) {
    return work.question && !std::holds_alternative<belief::Query>(*work.question);
  };
  return waiting_.pop_if([&](const std::string& client, const Work& work) {
    return std::none_of(in_work_.begin(), in_work_.end(), [&](const Simulating& one) {
      return one.work.question && (*one.client == client || (is_of_frames(one.work) && is_of_frames(work)));
    });
  });
}

void QueryWorker::simulate_questions(std::size_t thread) {
  core::lower_thread_priority();
  for (;;) {
    std::optional<FairQueue<Work>::Entry> next;
    {
      std::unique_lock lock(mutex_);
      simulate_changed_.wait(lock, [&] { return stop_.requested() || (next = take_next()); });
      if (stop_.requested()) return;
      in_work_[thread] = {next->item, std::move(next->client)};
    }
    answer(*next->item.question, *next->item.end, *pools_[thread]);
  }
}

void QueryWorker::answer(const AnyQuestion& question, const core::Cancellation& cancelled, core::ThreadPool& pool) {
  const std::string& id = id_in(question);
  const auto finish = [&] {
    // Before the answer goes out: whoever has it may ask under the same id again.
    const std::lock_guard lock(mutex_);
    for (Simulating& one : in_work_)
      if (one.work.question.get() == &question) one = {};
    simulate_changed_.notify_all();  // the next question of the same client may begin
  };
  try {
    const bool is_simulated = &cancelled != &stop_;
    const QueryReplies::Reply reply =
        replies_->reply_to(question, {most_seconds_, session_begin_ns_, is_simulated}, cancelled, pool);
    finish();
    if (reply.text.size() > interfaces::CdrLimits().max_string_bytes)
      return refuse(id, core::resource_exhausted("the answer has " + std::to_string(reply.text.size() >> 20) +
                                                 " MiB, more than clients take: ask for less at a time"));
    send(reply.text, reply.is_answer ? &QueryCounts::answered : &QueryCounts::refused);
  } catch (const std::exception&) {
    finish();
    refuse_after_exception(id, "the question could not be answered");
  }
}

void QueryWorker::refuse(const std::string& id, const core::Status& reason) {
  try {
    send(error_answer(id, reason), &QueryCounts::refused);
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::refuse_after_exception(const std::string& id, const char* doing) {
  try {
    refuse(id, note_exception(doing));
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::send(const std::string& answer, std::uint64_t QueryCounts::*fate) {
  // Counted before: whoever has the answer finds it counted.
  if (fate != nullptr) {
    const std::lock_guard lock(mutex_);
    ++(counts_.*fate);
  }
  try {
    on_answer_(answer);
  } catch (const std::exception&) {
    if (fate == nullptr) return;
    {
      const std::lock_guard lock(mutex_);
      --(counts_.*fate);
    }
    drop();
  }
}

void QueryWorker::drop() {
  try {
    static_cast<void>(note_exception("no answer could be sent"));
  } catch (const std::exception&) {  // no memory for its text, either
  }
  const std::lock_guard lock(mutex_);
  ++counts_.unanswered;
}

core::Status QueryWorker::note_exception(const char* doing) {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return core::resource_exhausted(std::string(doing) + ": it does not fit into the memory; ask for less");
  } catch (const std::exception& error) {
    {
      const std::lock_guard lock(mutex_);
      ++counts_.failed;
      counts_.last_failure_ns = core::steady_now_ns();
      counts_.last_failure = error.what();
    }
    return core::unavailable(std::string(doing) + ": " + error.what());
  }
}

}  // namespace prescene::service
