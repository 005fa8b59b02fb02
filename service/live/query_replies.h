// SPDX-License-Identifier: Apache-2.0
// What a QueryWorker says to a question: how the answer is worked out, what is told of it on the way, and how it is
// written. It knows of no queue and no thread.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "prescene/service/live/query_worker.h"

namespace prescene::service {

inline const std::string& id_in(const AnyQuestion& question) {
  return std::visit([](const auto& one) -> const std::string& { return one.id; }, question);
}

/// What holds when work on a question begins.
struct ReplyTerms {
  double most_seconds = 0.0;          ///< QueryWorkerSettings::most_seconds of now.
  core::TimeNs session_begin_ns = 0;  ///< The stamp of the session's first frame; 0 = none came.
  bool tells_progress = false;        ///< Else the question is answered at once.
};

/// Safe to call from several threads. Exceptions of what it calls leave it.
class QueryReplies {
 public:
  /// All must outlive it.
  QueryReplies(Backends& backends, const QueryWorkerSettings& settings,
               std::function<std::shared_ptr<const belief::Belief>()> snapshot);

  struct Reply {
    std::string text;
    bool is_answer = false;  ///< Else the reason why there is none.
  };
  Reply reply_to(const AnyQuestion& question, const ReplyTerms& terms, const core::Cancellation& cancelled,
                 core::ThreadPool& pool) const;

 private:
  /// Of the question with that id; empty where nobody is told.
  core::ProgressSink progress_of(const std::string& id) const;
  std::function<void(const belief::Answer&)> so_far_of(const belief::Query& query) const;
  Reply reply_to_query(const belief::Query& query, const ReplyTerms& terms, const queries::QueryContext& context) const;
  /// Of what is asked about frames; `answer_it`: QueryWorkerSettings' for this kind.
  template <class FrameQuestion, class AnswerIt>
  Reply reply_from_frames(const FrameQuestion& question, const AnswerIt& answer_it, queries::QueryContext context,
                          const core::Cancellation& cancelled) const;

  Backends& backends_;
  const QueryWorkerSettings& settings_;
  std::function<std::shared_ptr<const belief::Belief>()> snapshot_;
};

}  // namespace prescene::service
