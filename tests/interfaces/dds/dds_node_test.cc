// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/dds/dds_node.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dds_options.h"
#include "prescene/interfaces/ros_messages/cdr.h"

namespace prescene::interfaces {
namespace {

using dds_tests::options;

/// Collects what comes in; waiting ends with the arrival, the limit only guards a hang.
class Inbox {
 public:
  void put(ReceivedMessage&& message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
    changed_.notify_all();
  }
  bool wait_for(std::size_t count, std::chrono::milliseconds at_most = std::chrono::seconds(30)) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, at_most, [&] { return messages_.size() >= count; });
  }
  std::vector<ReceivedMessage> messages() {
    const std::lock_guard lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<ReceivedMessage> messages_;
};

template <class Message>
void expect_round_trip(const Message& message, const std::string& type) {
  auto writer_node = DdsNode::create(options(), {});
  auto reader_node = DdsNode::create(options(), {});
  ASSERT_TRUE(writer_node.ok()) << writer_node.status().message();
  ASSERT_TRUE(reader_node.ok()) << reader_node.status().message();
  Inbox inbox;
  // Latched, so that it does not matter who is there first.
  const auto publisher = (*writer_node)->advertise("/test/round_trip", type, TopicQos::kLatched);
  ASSERT_TRUE(publisher.ok()) << publisher.status().message();
  ASSERT_TRUE((*writer_node)->publish(*publisher, message).ok());
  ASSERT_TRUE((*reader_node)
                  ->subscribe("/test/round_trip", type, TopicQos::kTfStatic,
                              [&](ReceivedMessage&& received) { inbox.put(std::move(received)); })
                  .ok());
  ASSERT_TRUE(inbox.wait_for(1)) << type;
  const ReceivedMessage received = inbox.messages()[0];
  EXPECT_EQ(received.topic, "/test/round_trip");
  EXPECT_EQ(received.type, type);
  const auto decoded = decode_cdr<Message>(received.cdr);
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_TRUE(*decoded == message) << type;
  ASSERT_TRUE((*writer_node)->publish_cdr(*publisher, received.cdr).ok());
  ASSERT_TRUE(inbox.wait_for(2));
  EXPECT_TRUE(decode_cdr<Message>(inbox.messages()[1].cdr).ok());
  reader_node->reset();  // before the inbox goes
}

const RosHeader kHeader{{12, 34}, "camera"};

TEST(DdsNode, CarriesImages) {
  expect_round_trip(RosImage{kHeader, 2, 3, "16UC1", 0, 6, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}},
                    "sensor_msgs/msg/Image");
}

TEST(DdsNode, CarriesLargeImages) {
  RosImage image{kHeader, 720, 1280, "rgb8", 0, 3840, {}};
  for (int i = 0; i < 720 * 3840; ++i) image.data.push_back(static_cast<std::uint8_t>(i * 7));
  expect_round_trip(image, "sensor_msgs/msg/Image");
}

TEST(DdsNode, CarriesPrescenesOwnMessages) {
  RosObjectBelief object;
  object.name = "mug";
  object.model = "mug of clay";
  object.state = 1;
  object.motion = 3;
  object.held_by = "gripper";
  object.confidence = 0.75;
  object.existence = 0.5;
  object.visible_share = 0.25;
  object.pose.pose = {{1.0, 2.0, 3.0}, {0.1, 0.2, 0.3, 0.9}};
  for (std::size_t i = 0; i < 36; ++i) object.pose.covariance[i] = 0.25 * static_cast<double>(i);
  object.twist = {{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}};
  object.parameters = {{"friction", 0.5, 0.1, 0.3, 0.7}, {"mass", 0.2, 0.01, 0.19, 0.21}};
  object.lessons = 7;
  object.learned = {5, 6};
  object.alternatives = {{{{1.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}}, 0.125}};
  object.is_new = true;
  object.size = {0.1, 0.2, 0.3};
  const RosJointBelief joint{"lid", 1, 0.5, 0.1, -0.2, -std::numeric_limits<double>::infinity(), 2.0, 0.75};
  expect_round_trip(RosBelief{kHeader, 41, {object, object}, {joint}}, "prescene_msgs/msg/Belief");
  expect_round_trip(RosEvent{kHeader, 41, "held", "mug", "table", "side", "hand", "gripper", "a release was seen"},
                    "prescene_msgs/msg/Event");
  expect_round_trip(RosQuery{"7", "predict", "mug", 2.0, 0.5, true, {"inputs", "chaos"}, "{\"actions\": []}"},
                    "prescene_msgs/msg/Query");
  expect_round_trip(RosCancel{"7", "c"}, "prescene_msgs/msg/Cancel");
  expect_round_trip(RosAnswer{"7",
                              41,
                              "predict",
                              1,
                              "none",
                              "not_found",
                              {{"in_bin", "ends", "milk", "bin", 0.5, 0.25, 0.75}},
                              {object},
                              384,
                              true,
                              {"a remark", "another"},
                              "{}"},
                    "prescene_msgs/msg/Answer");
  expect_round_trip(RosProgress{"7", 0.5, "simulating", -1.0}, "prescene_msgs/msg/Progress");
}

TEST(DdsNode, CarriesEveryFieldOfTheOtherTypes) {
  RosCameraInfo info;
  info.header = kHeader;
  info.height = 480;
  info.width = 640;
  info.distortion_model = "plumb_bob";
  info.d = {0.1, -0.2, 0.3, 0.4, 0.5};
  for (std::size_t i = 0; i < 9; ++i) info.k[i] = 1.5 + static_cast<double>(i);
  for (std::size_t i = 0; i < 9; ++i) info.r[i] = 2.5 + static_cast<double>(i);
  for (std::size_t i = 0; i < 12; ++i) info.p[i] = 3.5 + static_cast<double>(i);
  info.binning_x = 1;
  info.binning_y = 2;
  info.roi = {1, 2, 3, 4, true};
  expect_round_trip(info, "sensor_msgs/msg/CameraInfo");

  RosTfMessage tf;
  tf.transforms.push_back({kHeader, "hand", {{1.0, 2.0, 3.0}, {0.1, 0.2, 0.3, 0.9}}});
  tf.transforms.push_back({kHeader, "finger", {{-1.0, -2.0, -3.0}, {0.0, 0.0, 0.0, 1.0}}});
  expect_round_trip(tf, "tf2_msgs/msg/TFMessage");
  expect_round_trip(RosCompressedImage{kHeader, "16UC1; compressedDepth png", {9, 8, 7}},
                    "sensor_msgs/msg/CompressedImage");
  expect_round_trip(RosPointCloud2{kHeader,
                                   1,
                                   2,
                                   {{"x", 0, 7, 1}, {"z", 4, 7, 1}},
                                   false,
                                   8,
                                   16,
                                   {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16},
                                   true},
                    "sensor_msgs/msg/PointCloud2");
  expect_round_trip(RosString{"{\"where\": {}}"}, "std_msgs/msg/String");
  expect_round_trip(RosClock{{5, 6}}, "rosgraph_msgs/msg/Clock");

  RosPoseWithCovarianceStamped pose;
  pose.header = kHeader;
  pose.pose.pose = {{1.0, 2.0, 3.0}, {0.1, 0.2, 0.3, 0.9}};
  for (std::size_t i = 0; i < 36; ++i) pose.pose.covariance[i] = 0.25 * static_cast<double>(i);
  expect_round_trip(pose, "geometry_msgs/msg/PoseWithCovarianceStamped");

  expect_round_trip(RosPoseArray{kHeader, {pose.pose.pose, {{-1.0, -2.0, -3.0}, {0.0, 0.0, 0.0, 1.0}}}},
                    "geometry_msgs/msg/PoseArray");

  RosDetection3dArray detections{kHeader,
                                 {{kHeader, {{{"carton", 0.75}, pose.pose}}, {pose.pose.pose, {0.1, 0.2, 0.3}}, "7"}}};
  expect_round_trip(detections, "vision_msgs/msg/Detection3DArray");

  RosCollisionObject object;
  object.header = kHeader;
  object.pose = pose.pose.pose;
  object.id = "prescene/mug";
  object.type = {"mug", "models"};
  object.primitives = {{2, {0.1}, {}}, {5, {0.2}, {{{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}}}}};
  object.primitive_poses = {pose.pose.pose, {}};
  object.meshes = {{{{{0, 1, 2}}, {{2, 1, 0}}}, {{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}, {7.0, 8.0, 9.0}}}};
  object.mesh_poses = {{}};
  object.planes = {{{1.0, 2.0, 3.0, 4.0}}};
  object.plane_poses = {pose.pose.pose};
  object.subframe_names = {"handle", "rim"};
  object.subframe_poses = {{}, pose.pose.pose};
  object.operation = 3;
  expect_round_trip(object, "moveit_msgs/msg/CollisionObject");

  RosMarker marker;
  marker.header = kHeader;
  marker.ns = "belief";
  marker.id = 3;
  marker.type = 11;
  marker.pose = pose.pose.pose;
  marker.scale = {1.0, 1.0, 1.0};
  marker.color = {0.1F, 0.2F, 0.3F, 0.4F};
  marker.lifetime = {1, 2};
  marker.frame_locked = true;
  marker.points = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  marker.colors = {{0.5F, 0.5F, 0.5F, 1.0F}};
  marker.texture = {kHeader, "png", {1, 2, 3}};
  marker.uv_coordinates = {{0.25F, 0.75F}};
  marker.text = "carton";
  marker.mesh_resource = "file:///nowhere";
  marker.mesh_file = {"a.ply", {9, 8}};
  marker.mesh_use_embedded_materials = true;
  expect_round_trip(RosMarkerArray{{marker, marker}}, "visualization_msgs/msg/MarkerArray");

  expect_round_trip(
      RosDiagnosticArray{kHeader, {{1, "tracker", "late frames", "cpu", {{"skipped", "3"}, {"steps", "40"}}}}},
      "diagnostic_msgs/msg/DiagnosticArray");
}

TEST(DdsNode, BestEffortAndReliableReadersBothMatchAnImageWriter) {
  auto node = DdsNode::create(options(), {});
  auto other = DdsNode::create(options(), {});
  ASSERT_TRUE(node.ok() && other.ok());
  Inbox sensor;
  Inbox reliable;
  const std::string type = "sensor_msgs/msg/Image";
  ASSERT_TRUE((*other)
                  ->subscribe("/image", type, TopicQos::kSensor, [&](ReceivedMessage&& m) { sensor.put(std::move(m)); })
                  .ok());
  ASSERT_TRUE(
      (*other)
          ->subscribe("/image", type, TopicQos::kReliable, [&](ReceivedMessage&& m) { reliable.put(std::move(m)); })
          .ok());
  const auto publisher = (*node)->advertise("/image", type, TopicQos::kImages);
  ASSERT_TRUE(publisher.ok());
  // Volatile topics reach only who has been found: publish until both have heard one.
  const RosImage image{kHeader, 1, 1, "mono8", 0, 1, {5}};
  for (int attempt = 0; attempt < 3000 && (sensor.messages().empty() || reliable.messages().empty()); ++attempt) {
    ASSERT_TRUE((*node)->publish(*publisher, image).ok());
    (sensor.messages().empty() ? sensor : reliable).wait_for(1, std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(sensor.messages().empty());
  EXPECT_FALSE(reliable.messages().empty());
  EXPECT_EQ((*other)->matched_writers("/image"), 1);
  other->reset();
}

TEST(DdsNode, CountsWhatNewerSamplesPushOutBeforeItIsRead) {
  auto writer = DdsNode::create(options(), {});
  auto reader = DdsNode::create(options(), {});
  ASSERT_TRUE(writer.ok() && reader.ok());
  Inbox inbox;
  std::mutex gate;
  ASSERT_TRUE((*reader)
                  ->subscribe("/many", "std_msgs/msg/String", TopicQos::kReliable,
                              [&](ReceivedMessage&& message) {
                                const std::lock_guard wait(gate);
                                inbox.put(std::move(message));
                              })
                  .ok());
  const auto publisher = (*writer)->advertise("/many", "std_msgs/msg/String", TopicQos::kReliable);
  ASSERT_TRUE(publisher.ok());
  std::size_t sent = 0;
  const auto send = [&] {
    ASSERT_TRUE((*writer)->publish(*publisher, RosString{std::to_string(sent)}).ok());
    ++sent;
  };
  while (inbox.messages().empty()) {  // until the two have found each other
    send();
    inbox.wait_for(1, std::chrono::milliseconds(10));
  }
  {
    const std::lock_guard closed(gate);
    for (int i = 0; i < 1000; ++i) send();
  }
  // The last one comes in any case; what came before it was read or is counted.
  const std::string last = std::to_string(sent - 1);
  for (std::size_t known = inbox.messages().size();; known = inbox.messages().size()) {
    const auto text = decode_cdr<RosString>(inbox.messages().back().cdr);
    ASSERT_TRUE(text.ok());
    if (text->data == last) break;
    ASSERT_TRUE(inbox.wait_for(known + 1));
  }
  const auto first = decode_cdr<RosString>(inbox.messages().front().cdr);
  ASSERT_TRUE(first.ok());
  const std::size_t unheard = static_cast<std::size_t>(std::stoul(first->data));  // sent before they had met
  // What was pushed out is counted after what is left was read.
  while (inbox.messages().size() + (*reader)->dropped_samples() < sent - unheard) std::this_thread::yield();
  (*reader)->stop_receiving();
  const std::vector<ReceivedMessage> read = inbox.messages();
  EXPECT_LT(read.size(), 500u);
  EXPECT_EQ(read.size() + (*reader)->dropped_samples(), sent - unheard);
}

/// Two nodes, and what the second one hears of the first.
class TwoNodes : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(writer_.ok()) << writer_.status().message();
    ASSERT_TRUE(reader_.ok()) << reader_.status().message();
  }
  DdsPublisher text_publisher(const std::string& topic) {
    const auto publisher = (*writer_)->advertise(topic, "std_msgs/msg/String", TopicQos::kReliable);
    EXPECT_TRUE(publisher.ok()) << publisher.status().message();
    return *publisher;
  }
  void listen(const std::string& topic, const std::function<void(ReceivedMessage&&)>& on_message) {
    const core::Status done = (*reader_)->subscribe(topic, "std_msgs/msg/String", TopicQos::kCommands, on_message);
    ASSERT_TRUE(done.ok()) << done.message();
  }
  void meet(DdsPublisher publisher) {
    while ((*writer_)->matched_readers(publisher) == 0) std::this_thread::yield();
  }
  void send(DdsPublisher publisher, const std::string& text) {
    const core::Status sent = (*writer_)->publish(publisher, RosString{text});
    EXPECT_TRUE(sent.ok()) << sent.message();
  }

  static DdsOptions small_messages() {
    DdsOptions small = options();
    small.max_message_bytes = 100'000;
    return small;
  }
  Inbox inbox_;
  core::Result<std::unique_ptr<DdsNode>> writer_ = DdsNode::create(small_messages(), {});
  core::Result<std::unique_ptr<DdsNode>> reader_ = DdsNode::create(small_messages(), {});
};

TEST_F(TwoNodes, ReadersThatLeftCountAmongThoseSoFar) {
  const DdsPublisher publisher = text_publisher("/counted");
  EXPECT_EQ((*writer_)->readers_so_far(publisher), 0U);
  listen("/counted", [](ReceivedMessage&&) {});
  meet(publisher);
  EXPECT_EQ((*writer_)->readers_so_far(publisher), 1U);
  reader_->reset();
  while ((*writer_)->matched_readers(publisher) > 0) std::this_thread::yield();
  EXPECT_EQ((*writer_)->readers_so_far(publisher), 1U);
}

TEST_F(TwoNodes, AnExceptionEndsTheWorkOnItsSampleOnly) {
  const DdsPublisher publisher = text_publisher("/thrown");
  listen("/thrown", [&](ReceivedMessage&& message) {
    const auto text = decode_cdr<RosString>(message.cdr);
    if (text->data == "memory") throw std::bad_alloc();
    if (text->data == "other") throw std::runtime_error("a library gave up");
    inbox_.put(std::move(message));
  });
  meet(publisher);
  for (int i = 0; i < 3; ++i)
    for (const char* text : {"memory", "good", "other"}) send(publisher, text);
  send(publisher, "last");
  EXPECT_TRUE(inbox_.wait_for(4));
  EXPECT_EQ((*reader_)->dropped_samples(), 6u);
}

TEST_F(TwoNodes, AFloodKeepsNeitherOtherTopicsNorTheEndWaiting) {
  const DdsPublisher flood = text_publisher("/flood");
  const DdsPublisher other = text_publisher("/other");
  std::mutex gate;
  // Each sample that is read brings the next: there is always a full batch of them.
  listen("/flood", [&](ReceivedMessage&&) {
    const std::lock_guard wait(gate);
    send(flood, "again");
  });
  listen("/other", [&](ReceivedMessage&& message) { inbox_.put(std::move(message)); });
  meet(flood);
  meet(other);
  {
    const std::lock_guard closed(gate);
    for (int i = 0; i < 64; ++i) send(flood, "first");
  }
  send(other, "now");
  EXPECT_TRUE(inbox_.wait_for(1));
  (*reader_)->stop_receiving();
}

TEST_F(TwoNodes, ASampleJustBeyondTheLimitIsCounted) {
  const DdsPublisher publisher = text_publisher("/large");
  listen("/large", [&](ReceivedMessage&& message) { inbox_.put(std::move(message)); });
  meet(publisher);
  send(publisher, std::string(100'001, 'x'));
  send(publisher, std::string(99'900, 'x'));
  EXPECT_TRUE(inbox_.wait_for(1));
  EXPECT_EQ((*reader_)->dropped_samples(), 1u);
  EXPECT_LT(inbox_.messages()[0].cdr.size(), 100'000u);
}

TEST_F(TwoNodes, WritersOfOthersAreCountedAndOwnOnesAreNot) {
  const auto others = [&](auto& node, int wanted) {
    while ((*node)->other_writers("/census") != wanted) std::this_thread::yield();
  };
  EXPECT_EQ((*reader_)->other_writers("/census"), 0);
  text_publisher("/census");
  text_publisher("/elsewhere");
  others(reader_, 1);
  EXPECT_EQ((*writer_)->other_writers("/census"), 0);
  ASSERT_TRUE((*reader_)->advertise("/census", "std_msgs/msg/String", TopicQos::kState).ok());
  others(writer_, 1);
  EXPECT_EQ((*reader_)->other_writers("/census"), 1);
  EXPECT_EQ((*reader_)->other_writers("not a topic"), 0);
  writer_->reset();
  others(reader_, 0);
}

TEST_F(TwoNodes, TopicsOfOthersAreListedWithTheirTypes) {
  text_publisher("/listed/text");
  ASSERT_TRUE((*writer_)->advertise("/listed/depth", "sensor_msgs/msg/Image", TopicQos::kImages).ok());
  ASSERT_TRUE((*writer_)->subscribe("/listed/wanted", "std_msgs/msg/String", TopicQos::kReliable, {}).ok());
  ASSERT_TRUE((*reader_)->advertise("/own", "std_msgs/msg/String", TopicQos::kState).ok());
  const std::vector<DomainTopic> expected = {{"/listed/depth", "sensor_msgs/msg/Image", 1, 0},
                                             {"/listed/text", "std_msgs/msg/String", 1, 0},
                                             {"/listed/wanted", "std_msgs/msg/String", 0, 1}};
  while ((*reader_)->domain_topics() != expected) std::this_thread::yield();
  // What a node of an earlier test sent before it ended may be read now: then it is there until its farewell is, too.
  while ((*reader_)->other_participants() != 1) std::this_thread::yield();
  writer_->reset();
  while (!(*reader_)->domain_topics().empty() || (*reader_)->other_participants() > 0) std::this_thread::yield();
}

}  // namespace
}  // namespace prescene::interfaces
