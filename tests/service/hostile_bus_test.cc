// SPDX-License-Identifier: Apache-2.0
// What a hostile peer can send to the service on each topic that it reads, in its own process: messages of random
// fields, sound ones with damaged bytes, and bytes that are no message. It answers as before and counts what it
// refused.
//
// PRESCENE_HOSTILE_ROUNDS (default 30) is the number of rounds of one message a topic, PRESCENE_HOSTILE_SEED (1) what
// they are drawn from.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <limits>
#include <map>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "prescene/service/tracking/waiting_controls.h"
#include "tests/interfaces/dds/raw_writer.h"
#include "tests/interfaces/ros_messages/schema_walk.h"
#include "tests/service/live_service_fixture.h"

namespace prescene::service::hostile_bus_test {
namespace {

using interfaces::DdsNode;
using interfaces::DdsPublisher;
using Bytes = std::vector<std::uint8_t>;

std::uint64_t number_of(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Damages messages: fields at the ends of what they can be, and single bytes.
class Damage {
 public:
  explicit Damage(core::RandomStream stream) : stream_(stream) {}

  std::size_t below(std::size_t n) { return static_cast<std::size_t>(stream_.uniform_below(n)); }

  /// Of a CDR message; its first four bytes stay.
  Bytes damaged(Bytes cdr) {
    constexpr std::size_t kHeader = 4;
    for (std::size_t i = below(5); i > 0 && cdr.size() > kHeader; --i) {
      const std::size_t at = kHeader + below(cdr.size() - kHeader);
      if (below(3) == 0) {
        put(std::bit_cast<std::array<std::uint8_t, 8>>(number()), at & ~std::size_t{7}, cdr);
      } else if (below(2) == 0) {
        put(std::bit_cast<std::array<std::uint8_t, 4>>(count()), at & ~std::size_t{3}, cdr);
      } else {
        cdr[at] = static_cast<std::uint8_t>(stream_.next_u32());
      }
    }
    return cdr;
  }
  std::string damaged_text(std::string text) {
    for (std::size_t i = 1 + below(4); i > 0 && !text.empty(); --i) {
      const std::size_t at = below(text.size());
      if (below(2) == 0) {
        text[at] = static_cast<char>(stream_.next_u32());
      } else {
        const std::size_t length = below(20);
        text.insert(at, text.substr(below(text.size()), length));
      }
    }
    return text;
  }
  core::RandomStream& stream() { return stream_; }

 private:
  static void put(std::span<const std::uint8_t> word, std::size_t at, Bytes& cdr) {
    for (std::size_t i = 0; i < word.size() && at + i < cdr.size(); ++i) cdr[at + i] = word[i];
  }
  double number() {
    constexpr double kNumbers[] = {0.0,     -0.0, -1.0, 1e308, -1e308, 5e-324, std::numeric_limits<double>::quiet_NaN(),
                                   HUGE_VAL};
    return kNumbers[below(std::size(kNumbers))];
  }
  std::uint32_t count() {
    constexpr std::uint32_t kCounts[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x00ffffff};
    return kCounts[below(std::size(kCounts))];
  }

  core::RandomStream stream_;
};

class HostileBus : public LiveServiceTest {
 protected:
  void SetUp() override {
    LiveServiceTest::SetUp();
    interfaces::DdsOptions options;
    options.domain = tests::own_domain();
    options.node_name = "hostile";
    auto node = DdsNode::create(options, {});
    ASSERT_TRUE(node.ok()) << node.status().message();
    node_ = *std::move(node);
  }

  /// What the service reads from its robot: every topic but that of answers, which it writes.
  static std::vector<BusTopic> read_topics() {
    InputTopics topics;
    topics.clock = kClockTopic;
    std::vector<BusTopic> read = bus_topics(topics);
    std::erase_if(read, [](const BusTopic& topic) { return topic.name == kAnswerTopic; });
    return read;
  }

  /// A sound message of the topic, of which damaged ones come near to being used; empty where a sound one would tell
  /// the service something that is false for good (transforms) or is nothing (joints, clock).
  Bytes sound(const std::string& topic, Damage& damage) const {
    const InputTopics topics;
    const interfaces::RosTime now = interfaces::to_ros_time(kNoon);
    const auto stamped = [&now](auto message) {
      message.header.stamp = now;
      return interfaces::encode_cdr(message);
    };
    if (topic == topics.depth || topic == topics.color) return stamped(robot_.depth());
    if (topic == topics.camera_info) return stamped(robot_.camera_info());
    if (topic == kControlTopic)
      return interfaces::encode_cdr(interfaces::RosString{damage.damaged_text(
          R"({"stamp_ns": 1700000000000000000, "actions": [{"time": 0.1, "release": {"object": "box"}}]})")});
    if (topic == kQueryTopic)
      return interfaces::encode_cdr(interfaces::RosString{damage.damaged_text(R"({"id": "h", "where": {}})")});
    return {};
  }

  /// Counted values of the diagnostics; 0 before the first.
  std::uint64_t told(const std::string& key) const {
    const std::map<std::string, std::string> values = robot_.diagnostics();
    const auto found = values.find(key);
    return found == values.end() ? 0 : std::stoull("0" + found->second);
  }

  /// Whether an answer with this question's id comes, which is asked again where the bus is full.
  bool answers_where(const std::string& id, core::TimeNs stamp_ns) {
    std::size_t read = robot_.answers().size();
    return robot_.send_until(
        [&] {
          robot_.ask(R"({"id": ")" + id + R"(", "where": {}})");
          const std::vector<std::string> answers = robot_.answers_since(read);
          read += answers.size();
          return std::any_of(answers.begin(), answers.end(), [&](const std::string& text) {
            return text.find("\"" + id + "\"") != std::string::npos && text.find("\"where\"") != std::string::npos;
          });
        },
        stamp_ns);
  }

  std::unique_ptr<DdsNode> node_;
};

TEST_F(HostileBus, AnyMessageOnAnyTopicLeavesTheServiceAnswering) {
  start(nullptr, kClockTopic);
  ASSERT_TRUE(tracks_from(kNoon));
  const std::vector<BusTopic> topics = read_topics();
  std::map<std::string, tests::Schema> schemas;
  std::map<std::string, DdsPublisher> publishers;
  std::map<std::string, std::unique_ptr<tests::RawWriter>> raw;
  for (const BusTopic& topic : topics) {
    const interfaces::RosType* type = interfaces::find_ros_type(topic.type);
    ASSERT_NE(type, nullptr) << topic.type;
    schemas[topic.name] = tests::parse_schema(type->name, interfaces::ros2msg_schema(*type));
    const auto publisher = node_->advertise(topic.name, topic.type, topic.write);
    ASSERT_TRUE(publisher.ok()) << publisher.status().message();
    publishers[topic.name] = *publisher;
    raw[topic.name] =
        std::make_unique<tests::RawWriter>(tests::own_domain(), "rt" + topic.name, std::string(type->dds_name));
    ASSERT_TRUE(raw[topic.name]->wait_for_reader()) << topic.name;
  }
  const std::uint64_t rounds = number_of("PRESCENE_HOSTILE_ROUNDS", 30);
  const core::RandomStream stream(number_of("PRESCENE_HOSTILE_SEED", 1), core::Purpose::kTest);
  std::uint64_t sound_ones = 0, broken = 0;
  for (std::uint64_t round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < topics.size(); ++i) {
      const std::string& topic = topics[i].name;
      Damage damage(stream.at(round, static_cast<std::uint32_t>(i)));
      Bytes cdr = damage.below(2) == 0 ? sound(topic, damage) : Bytes{};
      if (cdr.empty()) cdr = tests::random_cdr(schemas[topic], damage.stream(), std::endian::little);
      cdr = damage.damaged(std::move(cdr));
      // What is a message goes as one, with all of its bytes; what is none as no library would send it.
      if (node_->publish_cdr(publishers[topic], cdr).ok()) {
        ++sound_ones;
      } else {
        ++broken;
        raw[topic]->write(std::span(cdr).subspan(4));
      }
    }
    robot_.send_frame(kNoon + static_cast<core::TimeNs>(round + 100) * 33'000'000);
    robot_.wait(std::chrono::milliseconds(10));
  }
  RecordProperty("messages", std::to_string(sound_ones));
  RecordProperty("broken", std::to_string(broken));
  EXPECT_GT(sound_ones, rounds);
  EXPECT_GT(broken, 0u);
  EXPECT_TRUE(answers_where("after", kNoon + 1000 * kSecond)) << robot_.diagnosis();
  EXPECT_TRUE(tracks_from(kNoon + 2000 * kSecond)) << robot_.diagnosis();
  EXPECT_GT(told("refused messages"), 0u);
  EXPECT_EQ(told("failures"), 0u) << robot_.diagnostics()["last failure"];
  EXPECT_TRUE(stop().ok());
}

// Controls come over a reliable topic, so that none is lost where they wait for one another.
TEST_F(HostileBus, EachControlThatMakesNoSenseIsCounted) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  const auto settled = [this](std::uint64_t expected) {
    return robot_.send_until([&] { return told("refused messages") >= expected; }, kNoon + 10 * kSecond);
  };
  const std::uint64_t before = told("refused messages");
  Damage damage(core::RandomStream(number_of("PRESCENE_HOSTILE_SEED", 1), core::Purpose::kTest, 1));
  std::uint64_t expected = before;
  for (std::uint64_t sent = 0; sent < 10 * number_of("PRESCENE_HOSTILE_ROUNDS", 30);) {
    const std::string text = damage.damaged_text(R"({"actions": [{"time": 0.1, "push": {"object": "box"}}]})");
    if (parse_control(text).ok() || text.find('\0') != std::string::npos) continue;
    robot_.control(text);
    ++expected;
    if (++sent % 10 == 0) {
      ASSERT_TRUE(settled(expected)) << expected - told("refused messages") << " are missing";
    }
  }
  // No more than those.
  EXPECT_TRUE(answers_where("after", kNoon + 1000 * kSecond));
  EXPECT_EQ(told("refused messages"), expected);
  EXPECT_TRUE(stop().ok());
}

// Behind their fields, which say that there are no names, are bytes that no reader of the type asked for.
TEST_F(HostileBus, RequestsForParametersThatMakeNoSenseAreCountedAndSaid) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  tests::RawWriter requests(tests::own_domain(), "rq/prescene/get_parametersRequest",
                            "rcl_interfaces::srv::dds_::GetParameters_Request_");
  ASSERT_TRUE(requests.wait_for_reader());
  EXPECT_EQ(told("requests for parameters refused"), 0u);
  for (std::uint64_t count = 1; count <= 3; ++count) {
    requests.write({});
    ASSERT_TRUE(
        robot_.send_until([&] { return told("requests for parameters refused") == count; }, kNoon + 10 * kSecond))
        << count;
  }
  {
    const std::lock_guard lock(log_mutex_);
    EXPECT_THAT(log_, ::testing::Contains(::testing::HasSubstr("/get_parameters: a request was refused: ")));
  }
  EXPECT_TRUE(answers_where("after", kNoon + 1000 * kSecond));
  EXPECT_TRUE(stop().ok());
}

}  // namespace
}  // namespace prescene::service::hostile_bus_test
