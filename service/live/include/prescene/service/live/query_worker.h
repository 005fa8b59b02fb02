// SPDX-License-Identifier: Apache-2.0
// Answers questions that come in as JSON, from snapshots of the belief, on threads of its own: one reads questions,
// answers `where` and `timeline` and refuses what it must; the others answer what has to be simulated, each one
// question at a time. So `where` never waits for a simulation. What is simulated takes as many threads as the filter
// for each question in work, which get the processor after the filter's (nice 10).
//
// Clients take turns, one question each, both in being read and in being simulated. Of each client one question at most
// is simulated at a time, so that none can keep the others waiting for longer than one of its questions takes.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/explain_question.h"
#include "prescene/belief/why_question.h"
#include "prescene/core/clock.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/fair_queue.h"

namespace prescene::service {

/// s, at least, between two answers so far to a question: what a reader with a history of ten answers can take of
/// several questions.
inline constexpr double kSoFarInterval = 0.05;

struct QueryWorkerSettings {
  /// Questions that wait to be simulated; more are answered with an error that names the bound.
  FairLimits waiting = {16, 64, std::size_t{16} << 20};
  /// Come, but not looked at yet; more are answered with such an error, too.
  FairLimits unread = {64, 256, std::size_t{4} << 20};
  int at_once = 2;               ///< Questions, of different clients, that are simulated at a time; >= 1.
  double default_seconds = 0.8;  ///< Time that a question without limits of its own may take.
  double most_seconds = 10.0;    ///< Time that any question may take, and at most 2 s more.
  /// Memory that the instances of a question may take; what needs more is refused, or ends with fewer instances.
  std::size_t most_bytes = std::size_t{512} << 20;
  /// Of belief::TimelineQuery, see queries::QueryContext; called on all threads.
  std::function<std::shared_ptr<const belief::ObservedTimeline>()> timeline = {};
  /// Answers belief::ExplainQuestion with the answer's document, or says why not; called on one thread at a
  /// time, with the time that it has in `context`. Empty: such questions are refused.
  std::function<core::Result<nlohmann::ordered_json>(const belief::ExplainQuestion& question,
                                                     const queries::QueryContext& context)>
      explain = {};
  /// The same of belief::WhyQuestion; not called while `explain` is.
  std::function<core::Result<nlohmann::ordered_json>(const belief::WhyQuestion& question,
                                                     const queries::QueryContext& context)>
      why = {};
  /// Told how far the work on a question with an id is, as JSON: {"id", "fraction", "text", "seconds_left" (null while
  /// there is no estimate)}. Called on the threads that simulate when work begins and some times a second after that;
  /// may be empty.
  std::function<void(const std::string& progress)> on_progress = {};
  /// Told what is known so far of a question with an id and `"stream": true`: the answer's document with
  /// `"final": false`. Called on the threads that simulate, before the answer, at most 20 times a second for each
  /// question; may be empty.
  std::function<void(const std::string& answer)> on_answer_so_far = {};
};

/// {"cancel": question, "id": id}, the latter optional.
struct CancelRequest {
  std::string question;
  std::string id;
};

/// What became of the questions since the start. Each that was asked and neither waits nor is worked on counts as
/// answered, refused, unanswered or repeated, once.
struct QueryCounts {
  std::uint64_t answered = 0;  ///< As asked.
  std::uint64_t refused = 0;   ///< Answered with an error: not understood, not possible, or too many waited.
  /// Dropped without an answer: so many came that not even an error could be sent, or the answer could not be handed
  /// over.
  std::uint64_t unanswered = 0;
  std::uint64_t repeated = 0;  ///< Came again while the same question with the same id waited.
  std::uint64_t cancels = 0;   ///< No questions: {"cancel": ID}. What they end is counted as above.
  /// Exceptions, other than that the memory ended, that ended the work on a question or on handing over its answer:
  /// bugs. Such questions are among those refused or unanswered.
  std::uint64_t failed = 0;
  std::string last_failure;          ///< What the last of these exceptions said, and when, as of
  core::TimeNs last_failure_ns = 0;  ///< core::steady_now_ns().
  friend bool operator==(const QueryCounts&, const QueryCounts&) = default;
};

/// In the error of a question that came when too many waited.
inline constexpr const char* kQuestionsWait = "questions wait already";

/// The answer's text as JSON. Called on the worker's threads, on several at once.
using AnswerSink = std::function<void(const std::string& answer)>;

/// What is worked on for some time, or answered at once.
using AnyQuestion = std::variant<belief::Query, belief::ExplainQuestion, belief::WhyQuestion>;

class QueryReplies;

class QueryWorker {
 public:
  /// `threads` for simulating; `snapshot` gives the belief to ask, from any thread. All must outlive the worker.
  QueryWorker(Backends& backends, int threads, const QueryWorkerSettings& settings,
              std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer);
  /// Stops what is being answered and drops what waits.
  ~QueryWorker();
  QueryWorker(const QueryWorker&) = delete;
  QueryWorker& operator=(const QueryWorker&) = delete;

  /// Takes a question; returns at once, from any thread. One that is not understood or comes when too many wait gets an
  /// answer that says so. A question that waits to be simulated, or is being simulated, is not taken again: clients ask
  /// again when an answer is late. Another question with its id is refused: its asker would take the first one's answer
  /// for its own. {"cancel": ID} ends the work on a question: one that waits is refused, one that is being simulated is
  /// answered from what was simulated until now. Such a request is answered itself only if it has an "id" of its own:
  /// {"id", "cancelled": ID}, or an error where no question with that id waits. One that finds no room counts as a
  /// refused question. `client` says who asks: clients take turns. No exception leaves it.
  void ask(std::string question_json, const std::string& client = {});

  /// Answers a question that is none with the reason, on the worker's thread: for who reads questions in another form.
  /// It counts as ask() does: as refused, or as unanswered where too many such answers wait. From any thread; no
  /// exception leaves it.
  void turn_away(const std::string& id, const core::Status& reason);

  QueryCounts counts() const;

  /// Instead of QueryWorkerSettings::default_seconds and most_seconds, for questions that are read, or begun, from now
  /// on. From any thread.
  void set_default_seconds(double seconds) { default_seconds_ = seconds; }
  void set_most_seconds(double seconds) { most_seconds_ = seconds; }

  /// The stamp of the session's first frame, from which answers to `where` count "learned_s"; they do without before.
  /// From any thread.
  void begin_session(core::TimeNs first_frame_ns) { session_begin_ns_ = first_frame_ns; }

 private:
  /// A question to simulate, and what ends the work on it.
  struct Work {
    std::shared_ptr<const AnyQuestion> question;  ///< Null: none.
    std::shared_ptr<core::Cancellation> end;
  };
  /// What one of the threads that simulate works on, and for whom.
  struct Simulating {
    Work work;
    std::shared_ptr<const std::string> client;  // null where there is no work
  };
  /// Of a question that found no room.
  struct Refusal {
    std::string id;
    core::Status reason;
  };
  // No exception leaves these.
  void read_questions();
  void read(const std::string& question_json, const std::string& client);
  void cancel(const CancelRequest& request);
  void simulate_questions(std::size_t thread);
  void note_no_room(const std::string& question_json, const core::Status& reason);
  void end_threads();
  /// With mutex_ held: the question with that id that waits or is worked on; null: there is none.
  const Work* find_work(const std::string& id) const;
  /// With mutex_ held: what comes next to be simulated.
  std::optional<FairQueue<Work>::Entry> take_next();
  /// Answers and counts; no exception leaves it, nor the four below.
  void answer(const AnyQuestion& question, const core::Cancellation& cancelled, core::ThreadPool& pool);
  void refuse(const std::string& id, const core::Status& reason);
  /// In a handler, of an exception while `doing`.
  void refuse_after_exception(const std::string& id, const char* doing);
  /// Counts the question as `fate` (null: it is none), and as unanswered where the answer can't be handed over.
  void send(const std::string& answer, std::uint64_t QueryCounts::*fate);
  /// In a handler: the question got no answer, because of the exception.
  void drop();
  /// In a handler, of an exception while `doing`: counts it as a failure unless the memory ended, and says what to
  /// refuse the question with.
  core::Status note_exception(const char* doing);
  void take(std::string question_json, const std::string& client);

  std::vector<std::unique_ptr<core::ThreadPool>> pools_;  // one for each thread that simulates
  QueryWorkerSettings settings_;                          // but for its seconds
  std::atomic<double> default_seconds_, most_seconds_;
  std::unique_ptr<const QueryReplies> replies_;
  AnswerSink on_answer_;
  core::Cancellation stop_;
  std::atomic<core::TimeNs> session_begin_ns_{0};

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable read_changed_, simulate_changed_;
  FairQueue<std::string> unread_;
  std::deque<Refusal> too_many_;
  FairQueue<Work> waiting_;
  std::vector<Simulating> in_work_;  // of each thread that simulates
  QueryCounts counts_;

  std::thread reader_;  // these last: they use all above
  std::vector<std::thread> simulators_;
};

/// {"id": `id` unless it is empty, "error": why, "code": ...}, see belief::error_to_json.
std::string error_answer(const std::string& id, const core::Status& error);

/// Adds "learned_s" to each item of an answer to `where`, or object of a summary of a belief: when the last motion that
/// it was learned from ended, in seconds after the session's first frame. Negative = in an earlier session, which a
/// learned file contained; null = nothing was learned.
void add_learned_seconds(core::TimeNs first_frame_ns, nlohmann::ordered_json& objects);

}  // namespace prescene::service
