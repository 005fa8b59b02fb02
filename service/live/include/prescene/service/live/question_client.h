// SPDX-License-Identifier: Apache-2.0
// Asks a running service over DDS. A client outlives restarts of the service.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prescene/core/progress.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// s to wait for the answer to a question: more than a service without a limit in the question takes (10 s, and 2 s to
/// end), or than its `max_seconds`. At most belief::kWallSeconds.high.
double seconds_to_wait(const nlohmann::ordered_json& question);

class QuestionClient {
 public:
  /// Who is told while the service works on a question, on a thread of the client; each may be empty.
  struct Sinks {
    core::ProgressSink progress;
    /// Of a question with `"stream": true`: the answer so far as JSON, whenever there is more to tell. None comes after
    /// the answer.
    std::function<void(const std::string& answer)> so_far;
  };

  static core::Result<std::unique_ptr<QuestionClient>> create(const interfaces::DdsOptions& dds,
                                                              const core::LogSink& log);
  ~QuestionClient();

  /// Sends a question (JSON; an id is added if it has none) as soon as a service is there, and waits for its answer. A
  /// service that starts again meanwhile is asked again; one whose answer nobody waits for any more is told to cancel
  /// the question. May be
  /// called from several threads at once, with ids of their own. Fails with kUnavailable after `timeout` s (no service,
  /// no answer, or the middleware took no question), kInvalidInput when the question is not a JSON object, its id is no
  /// text, or another thread waits for an answer with its id, kCancelled.
  core::Result<std::string> ask(const std::string& question_json, double timeout,
                                const core::Cancellation& cancellation, const Sinks& sinks = {});

 private:
  QuestionClient() = default;

  class Waiting;
  void note_answer(const std::string& text);
  void note_progress(const nlohmann::ordered_json& said);
  core::Status cancel(const std::string& id);

  std::mutex mutex_;
  std::condition_variable changed_;
  struct Told {
    std::mutex mutex;  // guards what follows; not held while mutex_ is taken
    Sinks sinks;
  };
  struct Waited {
    std::optional<std::string> answer;  // nothing until it came
    std::shared_ptr<Told> told;
  };
  std::map<std::string, Waited> answers_;  // by id, of those waited for
  interfaces::DdsPublisher queries_;
  std::unique_ptr<interfaces::DdsNode> node_;  // last: its thread ends first
};

}  // namespace prescene::service
