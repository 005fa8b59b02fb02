// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/bus_replay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <iterator>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/log_limiter.h"
#include "prescene/service/live/question_client.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using interfaces::DdsPublisher;
using interfaces::TopicQos;
using std::chrono::steady_clock;

// How late a request to cancel is seen.
constexpr std::chrono::milliseconds kSlice(50);
// s; a recording of one instant is not played again and again as fast as can be.
constexpr double kShortestRound = 0.1;
// s; a recording whose times are years apart is played until someone stops it.
constexpr double kLongestWait = 1e9;

steady_clock::duration seconds(double value) {
  return std::chrono::duration_cast<steady_clock::duration>(
      std::chrono::duration<double>(std::clamp(value, -kLongestWait, kLongestWait)));
}

/// What comes back from the service; filled by the bus's thread.
class Listener {
 public:
  void add_belief(const std::string& json) {
    if (auto summary = belief_summary_from_json(json)) {
      const std::lock_guard lock(mutex_);
      beliefs_.push_back(*std::move(summary));
      changed_.notify_all();
    }
  }
  void add_answer(const std::string& text) {
    const auto answer = parse_or_discard(text);
    if (!answer.is_object() || !answer.contains("id") || !answer["id"].is_string()) return;
    const std::lock_guard lock(mutex_);
    const auto asked = asked_.find(answer["id"].get<std::string>());
    if (asked == asked_.end() || !answers_[asked->second.first].answer.empty()) return;
    answers_[asked->second.first].answer = text;
    answers_[asked->second.first].seconds =
        std::chrono::duration<double>(steady_clock::now() - asked->second.second).count();
    changed_.notify_all();
  }
  void expect(const std::string& id, double at, const std::string& question, double wait) {
    const std::lock_guard lock(mutex_);
    const auto now = steady_clock::now();
    asked_[id] = {answers_.size(), now};
    answers_.push_back({at, question, "", 0.0});
    answers_until_ = std::max(answers_until_, now + seconds(wait));
  }
  /// Until a belief at or after `stamp_ns` came or `until`, and every question has its answer or had its time.
  void wait_for_rest(core::TimeNs stamp_ns, steady_clock::time_point until, const core::Cancellation& cancellation) {
    std::unique_lock lock(mutex_);
    const auto has_beliefs = [&] { return !beliefs_.empty() && beliefs_.back().stamp_ns >= stamp_ns; };
    const auto has_answers = [&] {
      return std::all_of(answers_.begin(), answers_.end(), [](const auto& a) { return !a.answer.empty(); });
    };
    while (!cancellation.requested()) {
      const auto now = steady_clock::now();
      if ((has_beliefs() || now >= until) && (has_answers() || now >= answers_until_)) return;
      changed_.wait_for(lock, kSlice);
    }
  }
  void wait_until(steady_clock::time_point until, const core::Cancellation& cancellation) {
    std::unique_lock lock(mutex_);
    while (!cancellation.requested() && steady_clock::now() < until) {
      changed_.wait_until(lock, std::min(until, steady_clock::now() + kSlice));
    }
  }
  /// A loop may go on for days: only the beliefs of its last round are kept.
  void forget_beliefs() {
    const std::lock_guard lock(mutex_);
    beliefs_.clear();
  }
  void move_to(BusReplayResult& result) {
    const std::lock_guard lock(mutex_);
    result.beliefs = std::move(beliefs_);
    result.answers = std::move(answers_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<BeliefSummary> beliefs_;
  std::vector<BusReplayResult::Answered> answers_;
  std::map<std::string, std::pair<std::size_t, steady_clock::time_point>> asked_;
  steady_clock::time_point answers_until_;
};

class BusPlayer {
 public:
  BusPlayer(interfaces::DdsNode& node, Listener& listener) : node_(node), listener_(listener) {}

  /// What comes back goes to the listener, which outlives the node; the player does not.
  core::Status open() {
    const auto text_of = [](const interfaces::ReceivedMessage& message) {
      const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
      return text ? text->data : std::string();
    };
    PRESCENE_RETURN_IF_ERROR(
        node_.subscribe(kBeliefTopic, "std_msgs/msg/String", TopicQos::kReliable,
                        [&listener = listener_, text_of](auto&& message) { listener.add_belief(text_of(message)); }));
    for (const BusTopic& topic : bus_topics({})) {
      if (topic.name == kQueryTopic) {
        PRESCENE_TRY(questions_, node_.advertise(topic.name, topic.type, topic.write));
      } else if (topic.name == kAnswerTopic) {
        PRESCENE_RETURN_IF_ERROR(
            node_.subscribe(topic.name, topic.type, topic.read, [&listener = listener_, text_of](auto&& message) {
              if (const std::string answer = text_of(message); !text_is_so_far(answer)) listener.add_answer(answer);
            }));
      }
    }
    return core::ok_status();
  }

  core::Result<DdsPublisher> publisher_of(const interfaces::ReceivedMessage& message) {
    auto found = publishers_.find(message.topic);
    if (found == publishers_.end()) {
      PRESCENE_TRY(const DdsPublisher publisher,
                   node_.advertise(message.topic, message.type, offered_as(message.topic, message.type)));
      found = publishers_.emplace(message.topic, publisher).first;
    }
    return found->second;
  }

  core::Status ask(std::size_t number, double at, const TimedQuestion& question) {
    auto json = parse_or_discard(question.json);
    const std::string id = "replay-" + std::to_string(core::wall_now_ns()) + "-" + std::to_string(number);
    json["id"] = id;
    listener_.expect(id, at, question.json, seconds_to_wait(json));
    return node_.publish(questions_, interfaces::RosString{belief::json_text(json)});
  }

  /// The topics are found one by one: every one that is listened to must be, before the first message.
  bool wait_for_listeners(double limit, const core::Cancellation& cancellation) {
    const auto until = steady_clock::now() + seconds(limit);
    while (steady_clock::now() < until && !cancellation.requested()) {
      const bool all = node_.matched_readers(questions_) > 0 && node_.matched_writers(kBeliefTopic) > 0 &&
                       std::all_of(publishers_.begin(), publishers_.end(),
                                   [&](const auto& entry) { return node_.matched_readers(entry.second) > 0; });
      if (all) return true;
      listener_.wait_until(steady_clock::now() + std::chrono::milliseconds(20), cancellation);
    }
    return false;
  }

 private:
  interfaces::DdsNode& node_;
  Listener& listener_;
  DdsPublisher questions_;
  std::map<std::string, DdsPublisher> publishers_;
};

core::Status validate(const BusReplayOptions& options) {
  PRESCENE_RETURN_IF_ERROR(belief::check_number(options.speed, kReplaySpeeds).at("speed"));
  if (options.loop && !options.questions.empty())
    return core::invalid_input("questions are not asked in a loop: leave them out, or play once");
  for (const TimedQuestion& question : options.questions) {
    if (!(question.at >= 0.0) || !std::isfinite(question.at))
      return core::invalid_input("the time of a question is " + core::fixed_text(question.at, 2) +
                                 ": give seconds from 0 on");
    if (!parse_or_discard(question.json).is_object())
      return core::invalid_input("a question is not a JSON object: " + question.json);
  }
  return core::ok_status();
}

/// Robot topics only: what a service said, and what it was set to, is not said again. A bag that others recorded of a
/// service does not tell its topics apart, but by their names.
bool is_robots(const RecordedEntry& entry) {
  const std::string& topic = entry.message.topic;
  return !entry.is_json && (topic == kControlTopic || !topic.starts_with("/prescene/")) &&
         !are_of_objects(entry.message);
}

/// Whether a service of ours reads messages of the type from robots.
bool is_read(const std::string& type) {
  static constexpr std::string_view kRead[] = {"sensor_msgs/msg/Image",       "sensor_msgs/msg/CompressedImage",
                                               "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CameraInfo",
                                               "sensor_msgs/msg/JointState",  "tf2_msgs/msg/TFMessage",
                                               "std_msgs/msg/String",         "rosgraph_msgs/msg/Clock"};
  return std::find(std::begin(kRead), std::end(kRead), type) != std::end(kRead);
}

/// The publisher of a topic; none of a type that no service of ours reads, as bags of robots have many: nobody would
/// listen, or somebody else's planner would.
core::Result<std::optional<DdsPublisher>> publisher_for(const interfaces::ReceivedMessage& message, BusPlayer& player,
                                                        std::set<std::string>& passed_over) {
  if (passed_over.contains(message.topic)) return std::optional<DdsPublisher>();
  if (!is_read(message.type)) {
    passed_over.insert(message.topic);
    return std::optional<DdsPublisher>();
  }
  const auto publisher = player.publisher_of(message);
  if (publisher) return std::optional<DdsPublisher>(*publisher);
  if (publisher.status().code() != core::StatusCode::kUnsupported) return publisher.status();
  passed_over.insert(message.topic);
  return std::optional<DdsPublisher>();
}

/// Plays the recording once.
struct Round {
  const BusReplayOptions& options;
  const core::Cancellation& cancellation;
  const core::ProgressSink& progress;
  const core::LogSink& log;
  const std::function<void(const RecordedEntry&)>& on_entry;
  interfaces::DdsNode& node;
  BusPlayer& player;
  Listener& listener;

  core::Status play(const std::filesystem::path& path, std::set<std::string>& passed_over, BusReplayResult& result) {
    RecordingReadOptions again = options.read;
    again.check_data = options.read.salvage;  // It was just now, but what is salvaged has its loss told.
    PRESCENE_TRY(const auto reader, RecordingReader::open(path, again));
    const auto start = steady_clock::now();
    core::TimeNs last_stamp_ns = 0;
    double at = 0.0;
    std::size_t asked = 0;
    std::uint64_t entries = 0;
    const double total = static_cast<double>(reader->message_count().value_or(0));
    while (!cancellation.requested()) {
      PRESCENE_TRY(const auto entry, reader->next());
      if (!entry) break;
      at = reader->seconds_into(*entry);
      // What is needed from before goes first.
      const double after = std::max(0.0, at - options.read.from);
      listener.wait_until(start + seconds(after / options.speed), cancellation);
      if (cancellation.requested()) break;
      for (; asked < options.questions.size() && options.questions[asked].at <= at; ++asked)
        PRESCENE_RETURN_IF_ERROR(player.ask(asked, options.questions[asked].at, options.questions[asked]));
      if (on_entry) on_entry(*entry);
      if (progress && total > 0.0) progress({static_cast<double>(++entries) / total, {}, ""});
      if (!is_robots(*entry)) continue;
      PRESCENE_TRY(const auto publisher, publisher_for(entry->message, player, passed_over));
      if (!publisher) continue;
      const core::Status published = node.publish_cdr(*publisher, entry->message.cdr);
      if (!published.ok()) core::log(log, core::LogLevel::kWarning, entry->message.topic + ": " + published.message());
      last_stamp_ns = std::max(last_stamp_ns, is_image_type(entry->message.type) ? entry->message.source_ns : 0);
      ++result.messages;
    }
    for (; asked < options.questions.size() && !cancellation.requested(); ++asked) {
      core::log(log, core::LogLevel::kWarning,
                "the recording ends at " + core::fixed_text(at, 2) + " s, before the question for " +
                    core::fixed_text(options.questions[asked].at, 2) + " s: it is asked now");
      PRESCENE_RETURN_IF_ERROR(player.ask(asked, at, options.questions[asked]));
    }
    if (options.loop) {
      listener.wait_until(start + seconds(kShortestRound), cancellation);
    } else {
      listener.wait_for_rest(last_stamp_ns, steady_clock::now() + seconds(options.wait_at_end), cancellation);
    }
    result.loss = reader->loss_text();
    result.missing = reader->missing_text();
    result.unchecked = reader->unchecked_text();
    return core::ok_status();
  }
};

}  // namespace

core::Result<BusReplayResult> replay_over_bus(const std::filesystem::path& path, const BusReplayOptions& options,
                                              const core::Cancellation& cancellation,
                                              const core::ProgressSink& progress, const core::LogSink& log,
                                              const std::function<void(const RecordedEntry&)>& on_entry) {
  PRESCENE_RETURN_IF_ERROR(validate(options));
  Listener listener;
  interfaces::DdsOptions dds = options.dds;
  dds.node_name = "prescene_replay";
  LogLimiter bus_log(log, {});
  PRESCENE_TRY(const auto node, interfaces::DdsNode::create(dds, bus_log.sink()));
  BusPlayer player(*node, listener);
  PRESCENE_RETURN_IF_ERROR(player.open());

  std::set<std::string> passed_over;
  {  // Advertise everything first, so that the service has found it all before the first frame.
    PRESCENE_TRY(const auto reader, RecordingReader::open(path, options.read));
    while (!cancellation.requested()) {
      PRESCENE_TRY(const auto entry, reader->next());
      if (!entry) break;
      if (is_robots(*entry)) PRESCENE_RETURN_IF_ERROR(publisher_for(entry->message, player, passed_over).status());
    }
  }
  for (const std::string& topic : passed_over)
    core::log(log, core::LogLevel::kInfo, topic + " is not played: no service reads messages of its type");
  const bool heard =
      options.wait_for_service <= 0.0 || player.wait_for_listeners(options.wait_for_service, cancellation);
  if (cancellation.requested()) return core::cancelled("stopped on request, before anything was played");
  if (!heard) {
    std::string read;
    for (const interfaces::DomainTopic& topic : node->domain_topics())
      if (topic.readers > 0 && is_image_type(topic.type)) read += (read.empty() ? "" : ", ") + topic.name;
    return core::unavailable("no service listens to the recording's topics" +
                             (read.empty() ? "" : ", though images are read on " + read) +
                             ": start `prescene serve` in domain " + std::to_string(options.dds.domain) +
                             ", with topic names as in the recording");
  }

  BusReplayResult result;
  const std::function<void(const RecordedEntry&)> none;
  do {
    listener.forget_beliefs();
    // What is recorded is the same each time.
    Round round{options, cancellation, progress, log, result.rounds++ == 0 ? on_entry : none, *node, player, listener};
    PRESCENE_RETURN_IF_ERROR(round.play(path, passed_over, result));
  } while (options.loop && result.messages > 0 && !cancellation.requested());
  node->stop_receiving();
  listener.move_to(result);
  return result;
}

std::string unused_frames_text(std::size_t frames, std::size_t beliefs) {
  if (2 * beliefs >= frames) return {};
  return "beliefs of " + std::to_string(beliefs) + " of " + std::to_string(frames) +
         " frames came back, so objects may be lost and answers worse than they could be: the machine is too slow or "
         "too busy for frames at this rate; play them more slowly (--speed 0.2)";
}

}  // namespace prescene::service
