// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/question_client.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using std::chrono::steady_clock;

constexpr double kMostWait = 15.0;  // s, where the question has no limit
// What a question's own limit leaves the service to end and the answer to come.
constexpr double kMoreThanLimit = 3.0;
constexpr std::chrono::milliseconds kAskInterval(20);
// A service that was killed took the question with it: it is asked again after this time.
constexpr std::chrono::seconds kAskAgain(2);

// How long a service is left alone that has too many questions.
constexpr std::chrono::milliseconds kBusyPause(300);

bool says_ask_again(const std::string& answer) {
  const auto json = parse_or_discard(answer);
  return json.is_object() && json.contains("error") && json["error"].is_string() &&
         json["error"].get<std::string>().find(kQuestionsWait) != std::string::npos;
}

std::string new_id() {
  static std::atomic<unsigned> count{0};
  return std::to_string(getpid()) + "-" + std::to_string(core::wall_now_ns()) + "-" + std::to_string(count++);
}

}  // namespace

double seconds_to_wait(const nlohmann::ordered_json& question) {
  double wait = kMostWait;
  if (!question.is_object()) return wait;
  for (const nlohmann::ordered_json& asked : question) {
    if (!asked.is_object() || !asked.contains("effort") || !asked["effort"].is_object()) continue;
    const auto limit = asked["effort"].find("max_seconds");
    if (limit != asked["effort"].end() && limit->is_number())
      wait = std::max(wait, limit->get<double>() + kMoreThanLimit);
  }
  return std::min(wait, belief::kWallSeconds.high);
}

core::Result<std::unique_ptr<QuestionClient>> QuestionClient::create(const interfaces::DdsOptions& dds,
                                                                     const core::LogSink& log) {
  std::unique_ptr<QuestionClient> client(new QuestionClient());
  QuestionClient* raw = client.get();
  interfaces::DdsOptions options = dds;
  options.node_name = "prescene_client";
  // Without the log: a small receive buffer costs a client but time, as its topics are reliable.
  PRESCENE_TRY(client->node_, interfaces::DdsNode::create(options, {}));
  PRESCENE_RETURN_IF_ERROR(
      client->node_->subscribe(kAnswerTopic, "std_msgs/msg/String", interfaces::TopicQos::kCommands,
                               [raw, log](interfaces::ReceivedMessage&& message) {
                                 const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
                                 if (!text) return core::log(log, core::LogLevel::kWarning, text.status().message());
                                 raw->note_answer(text->data);
                               }));
  // Whoever may not read it does without.
  static_cast<void>(client->node_->subscribe(kProgressTopic, "std_msgs/msg/String", interfaces::TopicQos::kReliable,
                                             [raw](interfaces::ReceivedMessage&& message) {
                                               const auto text =
                                                   interfaces::decode_cdr<interfaces::RosString>(message.cdr);
                                               if (text) raw->note_progress(parse_or_discard(text->data));
                                             }));
  PRESCENE_TRY(client->queries_,
               client->node_->advertise(kQueryTopic, "std_msgs/msg/String", interfaces::TopicQos::kReliable));
  return client;
}

QuestionClient::~QuestionClient() { node_.reset(); }

void QuestionClient::note_answer(const std::string& text) {
  const auto answer = parse_or_discard(text);
  if (!answer.is_object() || !answer.contains("id") || !answer["id"].is_string()) return;
  std::shared_ptr<Told> told;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting = answers_.find(answer["id"].get<std::string>());
    if (waiting == answers_.end()) return;  // somebody else's
    if (!is_so_far(answer)) {
      waiting->second.answer = text;
      changed_.notify_all();
      return;
    }
    told = waiting->second.told;
  }
  const std::lock_guard lock(told->mutex);
  if (told->sinks.so_far) told->sinks.so_far(text);
}

void QuestionClient::note_progress(const nlohmann::ordered_json& said) {
  const auto is = [&said](const char* key, bool (nlohmann::ordered_json::*kind)() const noexcept) {
    return said.is_object() && said.contains(key) && (said[key].*kind)();
  };
  if (!is("id", &nlohmann::ordered_json::is_string) || !is("fraction", &nlohmann::ordered_json::is_number)) return;
  core::Progress at;
  at.fraction = said["fraction"].get<double>();
  if (is("text", &nlohmann::ordered_json::is_string)) at.text = said["text"].get<std::string>();
  if (is("seconds_left", &nlohmann::ordered_json::is_number)) at.seconds_left = said["seconds_left"].get<double>();
  std::shared_ptr<Told> told;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting = answers_.find(said["id"].get<std::string>());
    if (waiting == answers_.end()) return;
    told = waiting->second.told;
  }
  const std::lock_guard lock(told->mutex);
  if (told->sinks.progress) told->sinks.progress(at);
}

core::Status QuestionClient::cancel(const std::string& id) {
  return node_->publish(queries_, interfaces::RosString{belief::json_text({{"cancel", id}})});
}

/// Answers with an id are kept while it lives.
class QuestionClient::Waiting {
 public:
  Waiting(QuestionClient& client, std::string id, const Sinks& sinks)
      : client_(client), id_(std::move(id)), told_(std::make_shared<Told>()) {
    told_->sinks = sinks;
    const std::lock_guard lock(client_.mutex_);
    is_first_ = client_.answers_.try_emplace(id_, Waited{{}, told_}).second;
  }
  ~Waiting() {
    {
      const std::lock_guard lock(told_->mutex);
      told_->sinks = {};  // what it refers to may end with this
    }
    if (!is_first_) return;
    const std::lock_guard lock(client_.mutex_);
    client_.answers_.erase(id_);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  /// Whether nobody else waits for an answer with this id.
  bool is_first() const { return is_first_; }
  /// The answer if it comes within the time; asked for again, the next one.
  std::optional<std::string> answer_within(std::chrono::milliseconds time) {
    std::unique_lock lock(client_.mutex_);
    std::optional<std::string>& answer = client_.answers_.at(id_).answer;
    client_.changed_.wait_for(lock, time, [&] { return answer.has_value(); });
    return std::exchange(answer, std::nullopt);
  }

 private:
  QuestionClient& client_;
  std::string id_;
  std::shared_ptr<Told> told_;
  bool is_first_ = false;
};

core::Result<std::string> QuestionClient::ask(const std::string& question_json, double timeout,
                                              const core::Cancellation& cancellation, const Sinks& sinks) {
  auto question = parse_or_discard(question_json);
  if (!question.is_object()) return core::invalid_input("a question is a JSON object (docs/reference/queries.md)");
  if (question.contains("id") && !question["id"].is_string())
    return core::invalid_input("id: a question's id is a text, in quotes; leave it out to have one made");
  if (!question.contains("id") || question["id"] == "") question["id"] = new_id();
  const std::string id = question["id"].get<std::string>();
  Waiting waiting(*this, id, sinks);
  if (!waiting.is_first())
    return core::invalid_input("id: a question with this id waits for its answer already; choose another id");
  const auto deadline =
      steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(timeout));
  auto ask_at = steady_clock::now();
  bool found_service = false;
  bool was_busy = false, was_sent = false;
  core::Status sent;  // of the last try
  while (steady_clock::now() < deadline) {
    if (cancellation.requested()) {
      if (was_sent) static_cast<void>(cancel(id));  // what can't be told costs the service some seconds
      return core::cancelled("stopped on request");
    }
    // Both ways must be open, or the answer would be lost.
    const bool there = node_->matched_readers(queries_) > 0 && node_->matched_writers(kAnswerTopic) > 0;
    found_service = found_service || there;
    if (there && steady_clock::now() >= ask_at) {
      sent = node_->publish(queries_, interfaces::RosString{belief::json_text(question)});
      was_sent = was_sent || sent.ok();
      if (sent.ok()) ask_at = steady_clock::now() + kAskAgain;  // else at once: what holds it up may pass
    }
    std::optional<std::string> answer = waiting.answer_within(kAskInterval);
    if (!answer) continue;
    if (!says_ask_again(*answer)) return *std::move(answer);
    was_busy = true;
    ask_at = steady_clock::now() + kBusyPause;
  }
  if (was_sent) static_cast<void>(cancel(id));
  if (!sent.ok()) return sent;
  const std::string waited = " within " + core::rounded_text(timeout) + " s";
  if (was_busy)
    return core::unavailable("the service had too many questions waiting" + waited + ": ask fewer at a time");
  return core::unavailable(found_service
                               ? "no answer came" + waited + ": raise --timeout, or give the question less effort"
                               : "no service was found" + waited +
                                     ": start `prescene serve` in the same DDS domain (--domain, ROS_DOMAIN_ID)");
}

}  // namespace prescene::service
