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

namespace prescene::service {
namespace {

// Longer ones are refused unread.
constexpr std::size_t kLongestQuestion = 1u << 20;
// Where there is no room, the id is looked for in questions up to this length only: in longer ones it takes too long.
constexpr std::size_t kLongestWithId = 4096;
constexpr std::size_t kMostRefusalsWaiting = 256;
// s between the last simulated instance and the end of all work on a question, at most.
constexpr double kRestSeconds = 1.5;
constexpr double kProgressInterval = 0.2;  // s, at least, between two messages on how far the work is

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

template <class Question>
const std::string& id_in(const Question& question) {
  return std::visit([](const auto& one) -> const std::string& { return one.id; }, question);
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

void add_learned_seconds(core::TimeNs first_frame_ns, nlohmann::ordered_json& objects) {
  for (nlohmann::ordered_json& object : objects) {
    const core::TimeNs learned_ns = object.value("learned_ns", core::TimeNs{0});
    object["learned_s"] = object.value("lessons", 0) > 0
                              ? nlohmann::ordered_json(core::seconds_of(learned_ns - first_frame_ns))
                              : nlohmann::ordered_json();
  }
}

QueryWorker::QueryWorker(Backends& backends, int threads, const QueryWorkerSettings& settings,
                         std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer)
    : backends_(backends),
      pool_(threads, core::PoolPriority::kLow),
      settings_(settings),
      default_seconds_(settings.default_seconds),
      most_seconds_(settings.most_seconds),
      snapshot_(std::move(snapshot)),
      on_answer_(std::move(on_answer)),
      reader_([this] { read_questions(); }) {
  try {
    simulator_ = std::thread([this] { simulate_questions(); });
  } catch (...) {  // no memory for it: the other one must end before this object does
    {
      const std::lock_guard lock(mutex_);
      stop_.request();
    }
    read_changed_.notify_all();
    reader_.join();
    throw;
  }
}

QueryWorker::~QueryWorker() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  read_changed_.notify_all();
  simulate_changed_.notify_all();
  reader_.join();
  simulator_.join();
}

QueryCounts QueryWorker::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void QueryWorker::ask(std::string question_json) {
  try {
    take(std::move(question_json));
  } catch (const std::exception&) {
    drop();
  }
}

void QueryWorker::take(std::string question_json) {
  const std::size_t bytes = std::min(question_json.size(), kLongestQuestion + 1);
  const bool may_have_id = question_json.size() <= kLongestWithId;
  if (question_json.size() > bytes) {  // what is longer is refused by the reader, and need not be kept
    question_json.resize(bytes);
    question_json.shrink_to_fit();
  }
  {
    const std::lock_guard lock(mutex_);
    if (unread_.size() < settings_.max_unread && unread_bytes_ + bytes <= settings_.max_unread_bytes) {
      unread_.push_back(std::move(question_json));
      unread_bytes_ += bytes;
      read_changed_.notify_one();
      return;
    }
    if (!may_have_id || too_many_.size() >= kMostRefusalsWaiting) {
      ++counts_.unanswered;
      return;
    }
  }
  std::string id = id_of(question_json);
  const std::lock_guard lock(mutex_);
  too_many_.push_back(std::move(id));
  read_changed_.notify_one();
}

void QueryWorker::read_questions() {
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
    if (!is_refusal) {
      read(question);
      continue;
    }
    try {
      refuse(id, too_many_wait(settings_.max_unread));
    } catch (const std::exception&) {
      drop();
    }
  }
}

void QueryWorker::read(const std::string& question_json) {
  std::string id;
  try {
    if (question_json.size() > kLongestQuestion)
      return refuse("", core::resource_exhausted("the question is longer than " + std::to_string(kLongestQuestion) +
                                                 " bytes: make it shorter"));
    if (const auto request = cancel_request(question_json)) {
      if (!*request) return refuse(id_of(question_json), request->status());
      return cancel(**request);
    }
    std::shared_ptr<const Question> question;
    if (belief::asks_to_explain(question_json)) {
      auto read = belief::explain_question_from_json(question_json);
      if (!read) return refuse(id_of(question_json), read.status());
      question = std::make_shared<const Question>(*std::move(read));
    } else {
      auto read = belief::query_from_json(question_json);
      if (!read) return refuse(id_of(question_json), read.status());
      const bool at_once = std::holds_alternative<belief::WhereQuery>(read->what) ||
                           std::holds_alternative<belief::TimelineQuery>(read->what);
      if (!at_once) bound_effort(*read, default_seconds_, most_seconds_);
      question = std::make_shared<const Question>(*std::move(read));
      if (at_once) return answer(*question, stop_);
    }
    id = id_in(*question);
    core::Status reason;
    {
      const std::lock_guard lock(mutex_);
      const auto has_id = [&id](const Work& other) { return other.question && id_in(*other.question) == id; };
      const auto same_id = std::find_if(waiting_.begin(), waiting_.end(), has_id);
      const Work& other = same_id != waiting_.end() ? *same_id : in_work_;
      if (!id.empty() && has_id(other)) {
        if (*other.question == *question) {
          ++counts_.repeated;
          return;
        }
        reason = core::invalid_input("another question with the id '" + id +
                                     "' is not answered yet: choose another id, one that no other client uses");
      } else if (waiting_.size() < settings_.max_waiting) {
        waiting_.push_back(
            {question, std::make_shared<core::Cancellation>(stop_, core::Cancellation::Clock::time_point::max())});
        simulate_changed_.notify_one();
        return;
      } else {
        reason = too_many_wait(settings_.max_waiting);
      }
    }
    refuse(id, reason);
  } catch (const std::exception&) {
    refuse_after_exception(id, "the question could not be read");
  }
}

void QueryWorker::cancel(const CancelRequest& request) {
  bool waited = false, worked_on = false;
  {
    const std::lock_guard lock(mutex_);
    ++counts_.cancels;
    worked_on = in_work_.question && id_in(*in_work_.question) == request.question;
    if (worked_on) in_work_.end->request();  // its answer says the rest
    waited = std::erase_if(waiting_, [&](const Work& work) { return id_in(*work.question) == request.question; }) > 0;
  }
  if (waited) refuse(request.question, core::cancelled("cancelled before it was begun"));
  if (request.id.empty()) return;
  send(waited || worked_on
           ? belief::json_text({{"id", request.id}, {"cancelled", request.question}})
           : error_answer(request.id, core::not_found("no question with the id '" + request.question +
                                                      "' waits or is worked on: it may be answered already")),
       nullptr);
}

void QueryWorker::simulate_questions() {
  core::lower_thread_priority();
  for (;;) {
    Work work;
    {
      std::unique_lock lock(mutex_);
      simulate_changed_.wait(lock, [&] { return stop_.requested() || !waiting_.empty(); });
      if (stop_.requested()) return;
      work = std::move(waiting_.front());
      waiting_.pop_front();
      in_work_ = work;
    }
    answer(*work.question, *work.end);
  }
}

void QueryWorker::answer(const Question& question, const core::Cancellation& cancelled) {
  const std::string& id = id_in(question);
  const auto finish = [&] {
    // Before the answer goes out: whoever has it may ask under the same id again.
    const std::lock_guard lock(mutex_);
    if (in_work_.question.get() == &question) in_work_ = {};
  };
  try {
    const Reply reply = reply_to(question, cancelled);
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

core::ProgressSink QueryWorker::progress_of(const std::string& id) const {
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

QueryWorker::Reply QueryWorker::reply_to(const Question& question, const core::Cancellation& cancelled) {
  queries::QueryContext context = backends_.query_context(pool_);
  const double most_seconds = most_seconds_;
  const core::Cancellation end(cancelled, queries::deadline_after(most_seconds + kRestSeconds));
  context.cancellation = context.abandoned = &end;
  context.simulate_until = queries::deadline_after(most_seconds);
  context.most_bytes = settings_.most_bytes;
  context.timeline = settings_.timeline;
  if (&cancelled != &stop_) context.progress = progress_of(id_in(question));  // `where` is answered at once
  if (context.progress) context.progress({0.0, std::nullopt, "begun"});
  if (const auto* to_explain = std::get_if<belief::ExplainQuestion>(&question))
    return reply_to(*to_explain, context, cancelled);
  return reply_to(std::get<belief::Query>(question), context);
}

QueryWorker::Reply QueryWorker::reply_to(const belief::Query& query, const queries::QueryContext& context) {
  const std::shared_ptr<const belief::Belief> belief = snapshot_();
  // Before the first frame the scene file is all that is known, and says more than the particles drawn from it.
  const belief::Answer answer = belief->step == 0 ? queries::answer(belief->scene, belief->seed, query, context)
                                                  : queries::answer(*belief, query, context);
  nlohmann::ordered_json document = belief::to_json(answer);
  // Before the first frame nothing was learned in this session.
  if (const core::TimeNs begin_ns = session_begin_ns_;
      begin_ns != 0 && std::holds_alternative<belief::WhereAnswer>(answer.what))
    add_learned_seconds(begin_ns, document["where"]["items"]);
  return {belief::json_text(document), answer.what.index() > 0};
}

QueryWorker::Reply QueryWorker::reply_to(const belief::ExplainQuestion& question, queries::QueryContext context,
                                         const core::Cancellation& cancelled) {
  if (!settings_.explain)
    return {error_answer(question.id, core::unavailable("frames are not kept here, so that nothing can be explained")),
            false};
  if (question.max_seconds)
    context.simulate_until = std::min(*context.simulate_until, queries::deadline_after(*question.max_seconds));
  const auto document = settings_.explain(question, context);
  if (document) return {belief::json_text(*document), true};
  // Its time was over in the middle of a search, unless somebody stopped it.
  const bool too_late = document.status().code() == core::StatusCode::kCancelled && !cancelled.requested();
  return {error_answer(question.id,
                       too_late ? core::unavailable("the time ran out: give an object, a shorter window or fewer "
                                                    "points, or let questions take longer (--most-question-seconds)")
                                : document.status()),
          false};
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
