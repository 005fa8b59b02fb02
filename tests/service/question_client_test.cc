// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/question_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"
#include "tests/support/bus_domain.h"

namespace prescene::service::question_client_test {
namespace {

using ::testing::HasSubstr;

constexpr double kPatience = 60.0;  // s

interfaces::DdsOptions options() {
  interfaces::DdsOptions options;
  options.domain = tests::own_domain();
  return options;
}

class QuestionClientTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(client_.ok()) << client_.status().message(); }
  std::string error_of(const std::string& question, double timeout) {
    return core::to_string((*client_)->ask(question, timeout, never_).status());
  }

  core::Cancellation never_;
  core::Result<std::unique_ptr<QuestionClient>> client_ = QuestionClient::create(options(), {});
};

TEST(SecondsToWait, AreMoreThanTheServiceMayTake) {
  const auto wait = [](const char* question) { return seconds_to_wait(nlohmann::ordered_json::parse(question)); };
  EXPECT_EQ(wait(R"({"where": {}})"), 15.0);
  EXPECT_EQ(wait(R"({"predict": {"effort": {"max_seconds": 2}}})"), 15.0);
  EXPECT_EQ(wait(R"({"predict": {"effort": {"max_seconds": 60}}})"), 63.0);
  for (const char* odd : {"3", "[]", R"({"predict": 7})", R"({"predict": {"effort": {"max_seconds": "x"}}})"})
    EXPECT_EQ(wait(odd), 15.0) << odd;
  EXPECT_EQ(wait(R"({"predict": {"effort": {"max_seconds": 1e300}}})"), 1e6);
}

TEST_F(QuestionClientTest, RefusesWhatIsNoQuestionAtOnce) {
  EXPECT_THAT(error_of("[1]", kPatience), HasSubstr("invalid input"));
  EXPECT_THAT(error_of(R"({"id": 7, "where": {}})", kPatience), HasSubstr("invalid input: id: "));
  EXPECT_THAT(error_of(R"({"id": null, "where": {}})", kPatience), HasSubstr("invalid input: id: "));
  EXPECT_THAT(error_of(R"({"id": "", "where": {}})", 0.01), HasSubstr("no service was found"));
}

TEST_F(QuestionClientTest, SeveralThreadsGetEachItsOwnAnswer) {
  // A service that answers when it has heard both, the last one first.
  auto service = interfaces::DdsNode::create(options(), {});
  ASSERT_TRUE(service.ok()) << service.status().message();
  const auto answers = (*service)->advertise(kAnswerTopic, "std_msgs/msg/String", interfaces::TopicQos::kReliable);
  ASSERT_TRUE(answers.ok());
  std::vector<std::string> heard;
  ASSERT_TRUE((*service)
                  ->subscribe(kQueryTopic, "std_msgs/msg/String", interfaces::TopicQos::kCommands,
                              [&](interfaces::ReceivedMessage&& message) {
                                const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
                                heard.push_back(id_of(text->data));
                                if (heard.size() < 2) return;
                                for (auto id = heard.rbegin(); id != heard.rend(); ++id)
                                  EXPECT_TRUE((*service)
                                                  ->publish(*answers, interfaces::RosString{R"({"id": ")" + *id +
                                                                                            R"(", "step": 1})"})
                                                  .ok());
                              })
                  .ok());
  std::vector<std::string> got(2);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 2; ++i) {
    threads.emplace_back([&, i] {
      const auto answer = (*client_)->ask(R"({"id": "q)" + std::to_string(i) + R"(", "where": {}})", kPatience, never_);
      got[i] = answer ? id_of(*answer) : answer.status().message();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(got, (std::vector<std::string>{"q0", "q1"}));
  (*service)->stop_receiving();
}

TEST_F(QuestionClientTest, WhatIsKnownSoFarComesBeforeTheAnswer) {
  auto service = interfaces::DdsNode::create(options(), {});
  ASSERT_TRUE(service.ok()) << service.status().message();
  const auto answers = (*service)->advertise(kAnswerTopic, "std_msgs/msg/String", interfaces::TopicQos::kReliable);
  ASSERT_TRUE(answers.ok());
  ASSERT_TRUE((*service)
                  ->subscribe(kQueryTopic, "std_msgs/msg/String", interfaces::TopicQos::kCommands,
                              [&](interfaces::ReceivedMessage&& message) {
                                const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
                                const std::string begin = R"({"id": ")" + id_of(text->data) + R"(", "final": )";
                                for (const char* rest : {"false, \"n\": 1}", "false, \"n\": 2}", "true, \"n\": 3}"})
                                  EXPECT_TRUE((*service)->publish(*answers, interfaces::RosString{begin + rest}).ok());
                              })
                  .ok());
  std::vector<int> told;
  const auto so_far = [&told](const std::string& text) { told.push_back(parse_or_discard(text).value("n", 0)); };
  const auto answer = (*client_)->ask(R"({"stream": true, "where": {}})", kPatience, never_, {{}, so_far});
  ASSERT_TRUE(answer.ok()) << answer.status().message();
  EXPECT_EQ(parse_or_discard(*answer).value("n", 0), 3);
  EXPECT_EQ(told, (std::vector<int>{1, 2}));
  const auto unasked = (*client_)->ask(R"({"where": {}})", kPatience, never_);
  ASSERT_TRUE(unasked.ok()) << unasked.status().message();
  EXPECT_EQ(parse_or_discard(*unasked).value("n", 0), 3) << "what is known so far is taken for no answer";
  (*service)->stop_receiving();
}

TEST_F(QuestionClientTest, AnIdThatWaitsAlreadyIsRefused) {
  core::Cancellation enough;
  std::thread first([&] {
    while (!enough.requested()) EXPECT_FALSE((*client_)->ask(R"({"id": "same", "where": {}})", 1e6, enough).ok());
  });
  // Until the first one waits, nobody answers this.
  std::string error;
  do {
    error = error_of(R"({"id": "same", "where": {}})", 0.0);
  } while (error.find("choose another id") == std::string::npos);
  enough.request();
  first.join();
  EXPECT_THAT(error, HasSubstr("invalid input: id: "));
}

}  // namespace
}  // namespace prescene::service::question_client_test
