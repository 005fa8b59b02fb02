// SPDX-License-Identifier: Apache-2.0
// The service's topics that carry messages of prescene_msgs, beside those with JSON. A topic that nobody reads costs no
// more than asking whether somebody does.
#include <exception>
#include <string>
#include <utility>

#include "live_service_impl.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/typed_messages.h"

namespace prescene::service {

using interfaces::TopicQos;

void LiveService::Impl::advertise_typed() {
  typed_beliefs = advertised_if_allowed(kTypedBeliefTopic, kTypedBeliefType, "");
  typed_events = advertised_if_allowed(kTypedEventsTopic, kTypedEventType, "", TopicQos::kChanges);
  typed_answers = advertised_if_allowed(kTypedAnswerTopic, "prescene_msgs/msg/Answer", "", TopicQos::kReliable);
  // As of the answers in JSON: whoever does not read what is known so far keeps nobody's answer.
  typed_answers_so_far = advertised_if_allowed(kTypedAnswerTopic, "prescene_msgs/msg/Answer", "");
  typed_progress = advertised_if_allowed(kTypedProgressTopic, "prescene_msgs/msg/Progress", "");
}

template <class Message>
void LiveService::Impl::publish_typed(const std::optional<interfaces::DdsPublisher>& publisher,
                                      Message (*made)(const std::string&), const std::string& json) noexcept {
  try {
    if (is_read(publisher)) check_sent(node->publish(*publisher, made(json)));
  } catch (const std::exception&) {  // of the answer as JSON, which was sent, nothing is lost
    unsent.fetch_add(1, std::memory_order_relaxed);
  }
}

void LiveService::Impl::tell_typed_answer(const std::string& json) noexcept {
  publish_typed(typed_answers, &answer_message, json);
}
void LiveService::Impl::tell_typed_answer_so_far(const std::string& json) noexcept {
  publish_typed(typed_answers_so_far, &answer_message, json);
}
void LiveService::Impl::tell_typed_progress(const std::string& json) noexcept {
  publish_typed(typed_progress, &progress_message, json);
}

void LiveService::Impl::take_typed(const core::Result<std::string>& json, const std::string& id, std::uint64_t writer) {
  if (!json) return worker->turn_away(id, json.status());
  // Recorded as the JSON that it is answered as.
  put_text(kQueryTopic, *json);
  worker->ask(*json, "writer " + std::to_string(writer));
}

std::function<void(interfaces::ReceivedMessage&&)> LiveService::Impl::typed_taker(const std::string& topic) {
  if (topic == kTypedQueryTopic) {
    return [this](interfaces::ReceivedMessage&& message) {
      const auto query = interfaces::decode_cdr<interfaces::RosQuery>(message.cdr, interfaces::kSmallMessage);
      if (!query) return static_cast<void>(++unreadable_questions);
      take_typed(question_json(*query), query->id, message.writer);
    };
  }
  if (topic == kTypedCancelTopic) {
    return [this](interfaces::ReceivedMessage&& message) {
      const auto cancel = interfaces::decode_cdr<interfaces::RosCancel>(message.cdr, interfaces::kSmallMessage);
      if (!cancel) return static_cast<void>(++unreadable_questions);
      take_typed(cancel_json(*cancel), cancel->id, message.writer);
    };
  }
  return {};
}

}  // namespace prescene::service
