// SPDX-License-Identifier: Apache-2.0
// What the service publishes besides the belief, as a subscriber gets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/live/overlay_publisher.h"
#include "tests/service/live_service_fixture.h"
#include "tests/support/paths.h"

namespace prescene::service::live_outputs_test {
namespace {

using interfaces::TopicQos;

class LiveOutputsTest : public LiveServiceTest {
 protected:
  void SetUp() override {
    LiveServiceTest::SetUp();
    interfaces::DdsOptions options;
    options.domain = tests::own_domain();
    options.node_name = "listener";
    auto node = interfaces::DdsNode::create(options, {});
    ASSERT_TRUE(node.ok()) << node.status().message();
    node_ = *std::move(node);
  }
  void TearDown() override {
    LiveServiceTest::TearDown();
    node_.reset();
  }
  void listen(const std::string& topic, const std::string& type) {
    ASSERT_TRUE(node_
                    ->subscribe(topic, type, TopicQos::kReliable,
                                [this](interfaces::ReceivedMessage&& message) {
                                  const std::lock_guard lock(mutex_);
                                  received_[message.topic].push_back(message.cdr);
                                })
                    .ok());
  }
  template <class Message>
  std::vector<Message> heard(const std::string& topic) {
    const std::lock_guard lock(mutex_);
    std::vector<Message> messages;
    for (const auto& cdr : received_[topic]) {
      const auto message = interfaces::decode_cdr<Message>(cdr);
      EXPECT_TRUE(message.ok()) << message.status().message();
      if (message) messages.push_back(*message);
    }
    return messages;
  }
  std::vector<nlohmann::ordered_json> events() {
    std::vector<nlohmann::ordered_json> events;
    for (const auto& text : heard<interfaces::RosString>(kEventsTopic))
      events.push_back(nlohmann::ordered_json::parse(text.data));
    return events;
  }

  std::mutex mutex_;
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> received_;
  std::unique_ptr<interfaces::DdsNode> node_;  // last: its thread ends before what it fills
};

TEST_F(LiveOutputsTest, PosesAreThoseOfTheBelief) {
  listen(kPosesTopic, "geometry_msgs/msg/PoseArray");
  start();
  ASSERT_TRUE(robot_.send_until([&] { return heard<interfaces::RosPoseArray>(kPosesTopic).size() > 2; }, kNoon));
  const auto poses = heard<interfaces::RosPoseArray>(kPosesTopic);
  EXPECT_EQ(poses.back().header.frame_id, "world");
  ASSERT_EQ(poses.back().poses.size(), 1U);
  EXPECT_NEAR(poses.back().poses[0].position.z, 0.05, 0.03);
}

TEST_F(LiveOutputsTest, EventsTellOfTheObjectAndOfTheClock) {
  listen(kEventsTopic, "std_msgs/msg/String");
  start();
  // Whoever comes late misses the first events; a belief that begins anew tells them again.
  ASSERT_TRUE(tracks_from(kNoon));
  std::vector<nlohmann::ordered_json> all;
  auto began = all.end();
  const auto has_begun_anew = [&] {
    all = events();
    began = std::find_if(all.begin(), all.end(), [](const auto& e) { return e.at("event") == "clock_set_back"; });
    return all.end() - began >= 2;  // the events of one step come one by one
  };
  ASSERT_TRUE(robot_.send_until(has_begun_anew, kNoon - 3600 * kSecond));
  EXPECT_EQ((began + 1)->at("event"), "found");
  EXPECT_EQ((began + 1)->at("object"), "box");
  EXPECT_TRUE((began + 1)->at("from").is_null());
  EXPECT_EQ((began + 1)->at("to"), "tracked");
  EXPECT_EQ((began + 1)->at("stamp_ns"), began->at("stamp_ns"));
}

TEST_F(LiveOutputsTest, TheOverlayIsTheFrameWithTheBeliefDrawnOverIt) {
  listen(kOverlayTopic, "sensor_msgs/msg/Image");
  listen(kOverlayCompressedTopic, "sensor_msgs/msg/CompressedImage");
  listen(kOverlayInfoTopic, "sensor_msgs/msg/CameraInfo");
  adjust_ = [](LiveSettings& settings) { settings.overlay_rate = 100.0; };
  start();
  ASSERT_TRUE(robot_.send_until(
      [&] {
        return heard<interfaces::RosImage>(kOverlayTopic).size() > 1 &&
               heard<interfaces::RosCompressedImage>(kOverlayCompressedTopic).size() > 1 &&
               heard<interfaces::RosCameraInfo>(kOverlayInfoTopic).size() > 1;
      },
      kNoon));
  const auto image = heard<interfaces::RosImage>(kOverlayTopic).back();
  const auto info = heard<interfaces::RosCameraInfo>(kOverlayInfoTopic).back();
  const interfaces::RosImage& depth = robot_.depth();
  EXPECT_EQ(image.encoding, "rgb8");
  EXPECT_EQ(image.width, depth.width);
  EXPECT_EQ(image.height, depth.height);
  EXPECT_EQ(image.header.frame_id, depth.header.frame_id);
  EXPECT_EQ(info.header.frame_id, depth.header.frame_id);
  EXPECT_EQ(info.width, depth.width);
  EXPECT_EQ(info.k, robot_.camera_info().k);
  // The outline of the box is drawn in a colour that a camera's picture of it does not have: saturated.
  int saturated = 0;
  for (std::size_t i = 0; i + 2 < image.data.size(); i += 3) {
    const auto [least, most] = std::minmax({image.data[i], image.data[i + 1], image.data[i + 2]});
    saturated += most - least > 120 ? 1 : 0;
  }
  EXPECT_GT(saturated, 20);
  const auto packed = heard<interfaces::RosCompressedImage>(kOverlayCompressedTopic).back();
  const auto picture = interfaces::decode_jpeg(packed.data);
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_EQ(picture->width(), static_cast<int>(depth.width));
  EXPECT_THAT(packed.format, ::testing::HasSubstr("jpeg"));
}

TEST_F(LiveOutputsTest, BeliefAndEventsComeAsMessages) {
  listen(kTypedBeliefTopic, "prescene_msgs/msg/Belief");
  listen(kTypedEventsTopic, "prescene_msgs/msg/Event");
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  const auto began = [&] {
    const auto events = heard<interfaces::RosEvent>(kTypedEventsTopic);
    return std::any_of(events.begin(), events.end(), [](const auto& event) { return event.event == "clock_set_back"; });
  };
  ASSERT_TRUE(robot_.send_until([&] { return began() && !heard<interfaces::RosBelief>(kTypedBeliefTopic).empty(); },
                                kNoon - 3600 * kSecond));
  const interfaces::RosBelief belief = heard<interfaces::RosBelief>(kTypedBeliefTopic).back();
  EXPECT_EQ(belief.header.frame_id, "world");
  EXPECT_GT(belief.step, 0U);
  ASSERT_EQ(belief.objects.size(), 1U);
  EXPECT_EQ(belief.objects[0].name, "box");
  EXPECT_EQ(belief.objects[0].state, static_cast<std::uint8_t>(interfaces::RosObjectState::kTracked));
  EXPECT_NEAR(belief.objects[0].pose.pose.position.z, 0.05, 0.03);
  for (const auto& event : heard<interfaces::RosEvent>(kTypedEventsTopic)) {
    EXPECT_EQ(event.header.frame_id, "world");
    if (event.event == "found") {
      EXPECT_EQ(event.object, "box");
      EXPECT_EQ(event.current, "tracked");
    }
  }
}

TEST_F(LiveOutputsTest, BeliefsAreRecordedAsMessagesThoughNobodyListens) {
  const tests::ScratchDir folder;
  auto recording = RollingRecording::create(folder.path() / "run.mcap", {});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  start(*std::move(recording));
  ASSERT_TRUE(tracks_from(kNoon));
  ASSERT_TRUE(stop().ok());
  interfaces::McapReaderOptions options;
  options.topics = {kTypedBeliefTopic};
  auto reader = interfaces::McapReader::open(folder.path() / "run.mcap", options);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::uint64_t last_step = 0;
  for (;;) {
    const auto message = (*reader)->next();
    ASSERT_TRUE(message.ok()) << message.status().message();
    if (!*message) break;
    const auto belief = interfaces::decode_cdr<interfaces::RosBelief>((*message)->data);
    ASSERT_TRUE(belief.ok()) << belief.status().message();
    EXPECT_EQ(belief->step, last_step + 1);
    last_step = belief->step;
    ASSERT_EQ(belief->objects.size(), 1U);
    EXPECT_EQ(belief->objects[0].name, "box");
  }
  EXPECT_GE(last_step, 3U);
}

TEST_F(LiveOutputsTest, AQuestionAsAMessageIsAnsweredAsMessageAndAsJson) {
  listen(kTypedAnswerTopic, "prescene_msgs/msg/Answer");
  listen(kAnswerTopic, "std_msgs/msg/String");
  start();
  const auto queries = node_->advertise(kTypedQueryTopic, "prescene_msgs/msg/Query", TopicQos::kReliable);
  const auto cancels = node_->advertise(kTypedCancelTopic, "prescene_msgs/msg/Cancel", TopicQos::kReliable);
  ASSERT_TRUE(queries.ok() && cancels.ok());
  const auto answer_to = [&](const std::string& id) {
    for (const auto& answer : heard<interfaces::RosAnswer>(kTypedAnswerTopic))
      if (answer.id == id) return std::optional(answer);
    return std::optional<interfaces::RosAnswer>();
  };
  // Asked again until answered: who comes late to the bus misses what was said before.
  const auto answered = [&](const std::string& id, const std::function<void()>& ask) {
    return robot_.send_until(
        [&] {
          ask();
          return answer_to(id).has_value();
        },
        kNoon);
  };
  const auto asked = [&](const interfaces::RosQuery& query) {
    return answered(query.id, [&] { static_cast<void>(node_->publish(*queries, query)); });
  };
  ASSERT_TRUE(asked({"w", "where", "box", 0.0, 0.0, false, {}, ""}));
  const interfaces::RosAnswer where = *answer_to("w");
  EXPECT_EQ(where.kind, "where");
  EXPECT_EQ(where.state, static_cast<std::uint8_t>(interfaces::RosAnswerState::kAnswered));
  ASSERT_EQ(where.objects.size(), 1U);
  EXPECT_EQ(where.objects[0].name, "box");
  const auto texts = heard<interfaces::RosString>(kAnswerTopic);
  EXPECT_TRUE(std::any_of(texts.begin(), texts.end(), [&](const auto& text) { return text.data == where.json; }));

  // However long so many instances take: a busy machine may not have simulated one in a time that is given.
  ASSERT_TRUE(asked({"s", "stability", "box", 0.5, 0.0, false, {}, R"({"effort": {"exact_instances": 8}})"}));
  ASSERT_EQ(answer_to("s")->estimates.size(), 1U);
  EXPECT_EQ(answer_to("s")->estimates[0].subject, "box");

  const auto is_refused = [&](const std::string& id, const std::string& reason) {
    const interfaces::RosAnswer refused = *answer_to(id);
    EXPECT_EQ(refused.state, static_cast<std::uint8_t>(interfaces::RosAnswerState::kRefused));
    EXPECT_EQ(refused.code, "invalid_input");
    EXPECT_THAT(refused.error, ::testing::HasSubstr(reason));
  };
  ASSERT_TRUE(asked({"a", "where", "box", 0.0, 0.0, false, {}, "[]"}));
  is_refused("a", "arguments: this is not a JSON object");
  ASSERT_TRUE(asked({"k", "levitate", "box", 0.0, 0.0, false, {}, ""}));
  is_refused("k", "one of the keys where, predict");
  ASSERT_TRUE(answered("c", [&] { static_cast<void>(node_->publish(*cancels, interfaces::RosCancel{"none", "c"})); }));
  EXPECT_EQ(answer_to("c")->code, "not_found");
}

TEST_F(LiveOutputsTest, NoOverlayIsWantedWhereNobodyLooks) {
  auto overlay = OverlayPublisher::create(*node_, backends_, 5.0, [](const core::Status&) {});
  ASSERT_TRUE(overlay.ok()) << overlay.status().message();
  EXPECT_FALSE((*overlay)->wants({}));
  EXPECT_EQ((*overlay)->drawn(), 0U);
  overlay->reset();
}

TEST_F(LiveOutputsTest, MoveItHearsWhereTheObjectIs) {
  listen(kCollisionTopic, "moveit_msgs/msg/CollisionObject");
  adjust_ = [](LiveSettings& settings) { settings.planning_scene = settings.planning_supports = true; };
  start();
  const auto find = [&](const std::string& id) {
    for (const auto& object : heard<interfaces::RosCollisionObject>(kCollisionTopic))
      if (object.id == id && object.operation == static_cast<std::uint8_t>(interfaces::RosCollisionOperation::kAdd))
        return std::optional(object);
    return std::optional<interfaces::RosCollisionObject>();
  };
  ASSERT_TRUE(robot_.send_until([&] { return find("prescene/box") && find("prescene/table"); }, kNoon));
  const auto box = *find("prescene/box");
  EXPECT_EQ(box.header.frame_id, "world");
  EXPECT_NEAR(box.pose.position.z, 0.05, 0.03);
  ASSERT_EQ(box.primitives.size(), 1U);
  EXPECT_EQ(box.primitives[0].dimensions, (std::vector<double>{0.12, 0.08, 0.1}));
}

}  // namespace
}  // namespace prescene::service::live_outputs_test
