// SPDX-License-Identifier: Apache-2.0
// The Foxglove WebSocket protocol as a client of it sees it: written by its specification, with none of our code but
// the decoder of ROS messages.
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/view/live_view.h"
#include "tests/service/view/page_client.h"

namespace prescene::service::foxglove_test {
namespace {

using interfaces::WebClientSocket;
using nlohmann::ordered_json;
using ::testing::HasSubstr;

std::uint64_t little_endian(const std::string& bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes.at(at + i));
  return value;
}

class Foxglove {
 public:
  explicit Foxglove(int port, const std::string& protocols = "foxglove.websocket.v1") : socket_(port) {
    socket_.send(interfaces::handshake(protocols));
    head = socket_.read_head();
  }
  void say(const ordered_json& document) { socket_.send(interfaces::client_frame(1, belief::json_text(document))); }
  ordered_json next_text() {
    for (auto message = socket_.read_message(); message; message = socket_.read_message())
      if (message->opcode == 1) return ordered_json::parse(message->payload, nullptr, false);
    return {};
  }
  /// Number of the subscription and the bytes of the next message.
  std::pair<std::uint64_t, std::string> next_message() {
    for (auto message = socket_.read_message(); message; message = socket_.read_message()) {
      if (message->opcode != 2) continue;
      EXPECT_EQ(message->payload.at(0), 1);
      EXPECT_GT(little_endian(message->payload, 5, 8), 1'500'000'000'000'000'000U) << "ns since 1970";
      return {little_endian(message->payload, 1, 4), message->payload.substr(13)};
    }
    return {};
  }
  std::string head;

 private:
  WebClientSocket socket_;
};

template <class Message>
Message decoded(const std::string& bytes) {
  auto message = interfaces::decode_cdr<Message>({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  EXPECT_TRUE(message.ok()) << message.status().message();
  return message.ok() ? *std::move(message) : Message{};
}

std::unique_ptr<LiveView> live_view() {
  ViewOptions options;
  options.port = 0;
  options.world_frame = "map";
  auto view = LiveView::create(tests::shown_step(1).belief->scene, options, {});
  EXPECT_TRUE(view.ok()) << view.status().message();
  return *std::move(view);
}

TEST(Foxglove, AdvertisesAndPublishesWhatIsSubscribed) {
  const auto view = live_view();
  Foxglove client(view->port(), "foxglove.sdk.v1, foxglove.websocket.v1");
  EXPECT_THAT(client.head, HasSubstr("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n"));
  const ordered_json info = client.next_text();
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_TRUE(info["capabilities"].empty());
  const ordered_json advertised = client.next_text();
  EXPECT_EQ(advertised["op"], "advertise");
  std::map<std::string, ordered_json> channels;
  for (const ordered_json& channel : advertised["channels"]) channels[channel["topic"].get<std::string>()] = channel;
  const ordered_json& markers = channels.at("/prescene/markers");
  EXPECT_EQ(markers["encoding"], "cdr");
  EXPECT_EQ(markers["schemaName"], "visualization_msgs/msg/MarkerArray");
  EXPECT_EQ(markers["schemaEncoding"], "ros2msg");
  EXPECT_THAT(markers["schema"].get<std::string>(), HasSubstr("MSG: visualization_msgs/Marker"));
  EXPECT_TRUE(ordered_json::parse(channels.at("/prescene/belief")["schema"].get<std::string>()).is_object());
  ordered_json subscriptions = ordered_json::array();
  std::map<std::uint64_t, std::string> topics;
  for (const auto& [topic, channel] : channels) {
    const std::uint64_t id = 100 + topics.size();
    subscriptions.push_back({{"id", id}, {"channelId", channel["id"]}});
    topics[id] = topic;
  }
  client.say({{"op", "subscribe"}, {"subscriptions", subscriptions}});
  client.say({{"op", "getParameters"}});  // its answer says that the subscriptions were read
  EXPECT_EQ(client.next_text()["level"], 1);
  view->show(tests::shown_step(7));
  std::map<std::string, std::string> received;
  while (received.size() < topics.size()) {
    const auto [id, bytes] = client.next_message();
    ASSERT_TRUE(topics.contains(id));
    received[topics[id]] = bytes;
  }
  EXPECT_EQ(ordered_json::parse(received["/prescene/belief"])["step"], 7);
  const auto tf = decoded<interfaces::RosTfMessage>(received["/tf"]);
  ASSERT_EQ(tf.transforms.size(), 2U);
  EXPECT_EQ(tf.transforms[0].header.frame_id, "map");
  EXPECT_EQ(tf.transforms[0].child_frame_id, "prescene_camera");
  EXPECT_EQ(tf.transforms[1].child_frame_id, "prescene/box");
  EXPECT_DOUBLE_EQ(tf.transforms[1].transform.translation.x, 0.07);
  const auto drawn = decoded<interfaces::RosMarkerArray>(received["/prescene/markers"]);
  EXPECT_EQ(std::count_if(drawn.markers.begin(), drawn.markers.end(),
                          [](const auto& marker) {
                            return marker.action == static_cast<std::int32_t>(interfaces::RosMarkerAction::kAdd);
                          }),
            2);
  EXPECT_EQ(decoded<interfaces::RosDetection3dArray>(received["/prescene/detections"]).detections.size(), 1U);
  const auto picture = decoded<interfaces::RosCompressedImage>(received["/prescene/camera/image/compressed"]);
  const auto info_of_camera = decoded<interfaces::RosCameraInfo>(received["/prescene/camera/camera_info"]);
  EXPECT_EQ(picture.header.frame_id, info_of_camera.header.frame_id);
  const auto image = interfaces::decode_jpeg(picture.data);
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(static_cast<std::uint32_t>((*image).width()), info_of_camera.width);
}

/// Each key of the document is in the schema, with the type that it has there or null, in the part of JSON Schema that
/// Foxglove reads: one type a key, and keys of objects and items of lists named.
void expect_described(const ordered_json& value, const ordered_json& schema, const std::string& path) {
  ASSERT_TRUE(schema.is_object() && schema.contains("type") && schema["type"].is_string()) << path;
  if (value.is_null()) return;
  const std::string type = schema["type"].get<std::string>();
  if (type == "object") {
    ASSERT_TRUE(value.is_object()) << path;
    for (const auto& [key, member] : value.items()) {
      ASSERT_TRUE(schema.at("properties").contains(key)) << path << '.' << key << " is not in the schema";
      expect_described(member, schema["properties"][key], path + '.' + key);
    }
  } else if (type == "array") {
    ASSERT_TRUE(value.is_array()) << path;
    EXPECT_FALSE(value.empty()) << path << ": shows nothing of its items";
    for (const ordered_json& item : value) expect_described(item, schema.at("items"), path + "[]");
  } else if (type == "string") {
    EXPECT_TRUE(value.is_string()) << path;
  } else if (type == "integer") {
    EXPECT_TRUE(value.is_number_integer()) << path;
  } else {
    EXPECT_EQ(type, "number") << path;
    EXPECT_TRUE(value.is_number()) << path;
  }
}

/// The same the other way round: nothing is in the schema that a document of everything lacks.
void expect_no_more(const ordered_json& schema, const ordered_json& value, const std::string& path) {
  if (schema["type"] == "array") return expect_no_more(schema["items"], value[0], path + "[]");
  if (schema["type"] != "object") return;
  for (const auto& [key, member] : schema["properties"].items()) {
    ASSERT_TRUE(value.contains(key)) << path << '.' << key << " is in the schema only";
    expect_no_more(member, value[key], path + '.' + key);
  }
}

TEST(Foxglove, TheSchemaOfBeliefsDescribesAllOfThem) {
  const auto view = live_view();
  Foxglove client(view->port());
  client.next_text();
  const ordered_json advertised = client.next_text();
  ordered_json schema;
  for (const ordered_json& channel : advertised["channels"])
    if (channel["topic"] == "/prescene/belief") schema = ordered_json::parse(channel["schema"].get<std::string>());
  BeliefSummary summary{3, 4, {}};
  ObjectSummary& object = summary.objects.emplace_back();
  object.name = "unknown_1";
  object.parameters.push_back({"friction", 0.5, 0.1, 0.3, 0.7});
  object.alternatives.push_back({geometry::Pose(), 0.25});
  object.held_by = "gripper";
  object.is_new = true;
  summary.objects.push_back(ObjectSummary(object));
  summary.objects.back().held_by.reset();
  belief::JointEstimate& joint = summary.joints.emplace_back();
  joint.joint = "slide";
  joint.low = 0.0;
  joint.high = std::numeric_limits<double>::infinity();  // null in JSON
  const ordered_json document = to_json(summary);
  expect_described(document, schema, "belief");
  expect_no_more(schema, document, "belief");
}

TEST(Foxglove, NothingIsSentAfterUnsubscribing) {
  const auto view = live_view();
  Foxglove client(view->port());
  client.next_text();
  client.next_text();
  client.say({{"op", "subscribe"}, {"subscriptions", {{{"id", 1}, {"channelId", 0}}, {{"id", 2}, {"channelId", 0}}}}});
  client.say({{"op", "unsubscribe"}, {"subscriptionIds", {1, 5}}});
  client.say({{"op", "getParameters"}});
  client.next_text();
  for (std::uint64_t step = 1; step <= 5; ++step) {
    view->show(tests::shown_step(step));
    EXPECT_EQ(client.next_message().first, 2U);
  }
}

TEST(Foxglove, WhatMakesNoSenseIsToldAndDoesNoHarm) {
  const auto view = live_view();
  Foxglove client(view->port());
  client.next_text();
  client.next_text();
  for (const char* text :
       {"3", R"({"op": 3})", R"({"op": "subscribe"})", R"({"op": "subscribe", "subscriptions": [3]})",
        R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]})",
        R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 0}]})",
        R"({"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 0}]})"}) {
    client.say(ordered_json::parse(text));
    const ordered_json status = client.next_text();
    EXPECT_EQ(status["op"], "status") << text;
    EXPECT_EQ(status["level"], 2) << text;
  }
  ordered_json many = ordered_json::array();
  for (int i = 0; i < 1000; ++i) many.push_back({{"id", i}, {"channelId", 0}});
  client.say({{"op", "subscribe"}, {"subscriptions", many}});
  EXPECT_THAT(client.next_text()["message"].get<std::string>(), HasSubstr("no more than 100"));
}

// Pages do not get Foxglove's messages, nor the other way round.
TEST(Foxglove, PagesAndOthersAreKeptApart) {
  const auto view = live_view();
  tests::PageClient page(view->port());
  page.next("history");
  Foxglove client(view->port());
  client.next_text();
  client.next_text();
  view->show(tests::shown_step(3));
  EXPECT_EQ(page.next("step")["step"], 3);
  client.say({{"op", "getParameters"}});
  EXPECT_EQ(client.next_text()["op"], "status");
}

}  // namespace
}  // namespace prescene::service::foxglove_test
