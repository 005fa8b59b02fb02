// SPDX-License-Identifier: Apache-2.0
// Answers to questions about any step of a recording.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "prescene/service/view/question_ids.h"
#include "prescene/service/view/recording_view.h"

namespace prescene::service {

/// Beliefs of some steps, so many that they fit: of a long run those of every second step, then of every fourth, ...
/// Not thread-safe.
class KeptBeliefs {
 public:
  explicit KeptBeliefs(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  void add(std::uint64_t index, std::shared_ptr<const belief::Belief> belief);
  /// The belief of the step, or of the nearest one before it; null before the first.
  std::shared_ptr<const belief::Belief> at(std::uint64_t index) const;
  std::size_t size() const { return beliefs_.size(); }

 private:
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::uint64_t stride_ = 1;
  std::map<std::uint64_t, std::shared_ptr<const belief::Belief>> beliefs_;
};

/// One thread that answers, one question after the other.
class RecordingAnswers {
 public:
  using Send = std::function<void(const PageQuestion& asked, const std::string& answer)>;
  RecordingAnswers(const RecordingViewOptions& options, Backends& backends, Send send);
  ~RecordingAnswers() { stop(); }
  /// Stops what is being answered, drops what waits and ends the thread; what is asked from then on gets no answer.
  void stop();
  /// Returns at once; where too many wait, with an error as the answer.
  void ask(const PageQuestion& asked, std::string question, std::shared_ptr<const belief::Belief> belief);

 private:
  struct Waiting {
    PageQuestion asked;
    std::string question;
    std::shared_ptr<const belief::Belief> belief;
  };
  void work();
  std::string answer_to(const Waiting& waiting);

  RecordingViewOptions options_;
  Backends& backends_;
  Send send_;
  core::Cancellation stop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  std::thread thread_;
};

}  // namespace prescene::service
