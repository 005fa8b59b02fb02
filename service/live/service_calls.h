// SPDX-License-Identifier: Apache-2.0
// The live service's services of ROS 2: questions and commands as `ros2 service call` sends them.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// Of type std_srvs/srv/Trigger, whose reply's text is an answer as JSON, or says what was done; and kAskService, of
/// type prescene_msgs/srv/Ask, which takes any question.
inline constexpr const char* kWhereService = "/prescene/where";
inline constexpr const char* kRelationsService = "/prescene/relations";
inline constexpr const char* kRestartService = "/prescene/restart";
inline constexpr const char* kSaveService = "/prescene/save_learned";
inline constexpr const char* kAskService = "/prescene/ask";

/// Thread-safe but for offer().
class ServiceCalls {
 public:
  struct Hooks {
    /// Called on the bus's thread, as the next; `client` is another one for each caller.
    std::function<void(const std::string& question, const std::string& client)> ask;
    std::function<void()> restart;  ///< Has the belief begin anew.
    bool keeps_learned = false;     ///< Else nothing can be saved.
  };
  /// `node` must outlive this; `hooks` hand over what is asked.
  ServiceCalls(interfaces::DdsNode& node, Hooks hooks, core::LogSink log)
      : node_(node), hooks_(std::move(hooks)), log_(std::move(log)) {}

  core::Status offer();
  /// An answer of the query worker: one to a call is its reply.
  void note_answer(const std::string& answer_json);
  /// Calls of kSaveService that came since this was called last; each needs a reply().
  std::vector<interfaces::ServiceRequest> take_saves();
  /// A reply that can't be sent is logged.
  void reply(const interfaces::ServiceRequest& request, bool success, const std::string& text);

  /// Calls since the start, and those that were given up because too many waited for answers.
  std::uint64_t calls() const;
  std::uint64_t given_up() const;

 private:
  /// Has a question answered by note_answer(); `question` is JSON.
  void ask(const interfaces::ServiceRequest& request, const std::string& question);
  /// With mutex_ held: gives up the oldest call of the caller where too many of it wait, or of whoever
  /// has most where too many wait in all.
  std::vector<interfaces::ServiceRequest> give_up_old(std::uint64_t client);

  interfaces::DdsNode& node_;
  Hooks hooks_;
  core::LogSink log_;
  mutable std::mutex mutex_;                                                // guards all below
  std::deque<std::pair<std::string, interfaces::ServiceRequest>> waiting_;  // by the ids of their questions
  std::vector<interfaces::ServiceRequest> saves_;
  std::uint64_t calls_ = 0, given_up_ = 0;
};

}  // namespace prescene::service
