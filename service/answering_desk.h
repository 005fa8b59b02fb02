// SPDX-License-Identifier: Apache-2.0
// Answers questions that come in as JSON, one after the other on a thread of its own, from snapshots of the belief.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "prescene/belief/belief.h"
#include "prescene/core/progress.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/backends.h"

namespace prescene::service {

struct DeskSettings {
  std::size_t max_waiting = 16;  ///< More questions are answered with an error at once.
  double default_seconds = 0.8;  ///< Time that a question without limits of its own may take.
  double most_seconds = 10.0;    ///< Time that any question may take: questions are answered one after the other.
};

/// In the error of a question that came when too many waited.
inline constexpr const char* kQuestionsWait = "questions wait already";

/// A question's text as JSON and its answer's. Called on the desk's thread.
using AnswerSink = std::function<void(const std::string& question, const std::string& answer)>;

class AnsweringDesk {
 public:
  /// `threads` of its own for simulating; `snapshot` gives the belief to ask. All must outlive the desk.
  AnsweringDesk(Backends& backends, int threads, const DeskSettings& settings,
                std::function<std::shared_ptr<const belief::Belief>()> snapshot, AnswerSink on_answer);
  /// Cancels what is being answered and drops what waits.
  ~AnsweringDesk();
  AnsweringDesk(const AnsweringDesk&) = delete;
  AnsweringDesk& operator=(const AnsweringDesk&) = delete;

  /// Takes a question. `where` comes before what has to be simulated. One that is not understood or comes when too many
  /// wait gets an answer that says so. A question that waits or is being answered is not taken again under the same id:
  /// clients ask again when an answer is late.
  void ask(std::string question_json);

 private:
  void work();
  std::string answer(const std::string& question_json);

  Backends& backends_;
  core::ThreadPool pool_;
  DeskSettings settings_;
  std::function<std::shared_ptr<const belief::Belief>()> snapshot_;
  AnswerSink on_answer_;
  core::Cancellation stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  struct Waiting {
    std::string id;
    std::string question;
    bool is_quick = false;
  };
  std::deque<Waiting> waiting_;
  std::string id_in_work_;
  std::thread thread_;
};

/// {"id": the question's if it can be read, "error": why, "code": ...}, see belief::error_to_json.
std::string error_answer(const std::string& question_json, const core::Status& error);

}  // namespace prescene::service
