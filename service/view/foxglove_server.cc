// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/foxglove_server.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "json_fields.h"
#include "picture_pace.h"
#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using interfaces::WebClient;
using interfaces::WebDelivery;
using nlohmann::ordered_json;

constexpr std::size_t kMostSubscriptions = 100;  // of one client
constexpr const char* kCameraFrame = "prescene_camera";
constexpr std::uint8_t kMessageData = 1;
enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// Of BeliefSummary's JSON, for those who lay out panels by it. Viewers such as Foxglove refuse a channel whose schema
/// gives a key several types or the type null, so what may be null (held_by, limits) has the type that it has
/// otherwise.
constexpr const char* kBeliefSchema = R"({"type": "object", "properties": {
  "step": {"type": "integer"}, "stamp_ns": {"type": "integer"},
  "objects": {"type": "array", "items": {"type": "object", "properties": {
    "name": {"type": "string"}, "model": {"type": "string"}, "state": {"type": "string"},
    "confidence": {"type": "number"}, "existence": {"type": "number"},
    "pose": {"type": "object", "properties": {
      "position": {"type": "array", "items": {"type": "number"}},
      "rotation": {"type": "object", "properties": {
        "quaternion_wxyz": {"type": "array", "items": {"type": "number"}}}}}},
    "covariance": {"type": "array", "items": {"type": "number"}},
    "twist": {"type": "object", "properties": {
      "angular": {"type": "array", "items": {"type": "number"}},
      "linear": {"type": "array", "items": {"type": "number"}}}},
    "evidence_per_pixel": {"type": "number"}, "visible_share": {"type": "number"},
    "parameters": {"type": "array", "items": {"type": "object", "properties": {
      "name": {"type": "string"}, "mean": {"type": "number"}, "standard_deviation": {"type": "number"},
      "low": {"type": "number"}, "high": {"type": "number"}}}},
    "lessons": {"type": "integer"}, "learned_ns": {"type": "integer"},
    "alternatives": {"type": "array", "items": {"type": "object", "properties": {
      "pose": {"type": "object", "properties": {
        "position": {"type": "array", "items": {"type": "number"}},
        "rotation": {"type": "object", "properties": {
          "quaternion_wxyz": {"type": "array", "items": {"type": "number"}}}}}},
      "probability": {"type": "number"}}}},
    "motion": {"type": "string"}, "held_by": {"type": "string"},
    "size": {"type": "array", "items": {"type": "number"}}}}},
  "joints": {"type": "array", "items": {"type": "object", "properties": {
    "joint": {"type": "string"}, "type": {"type": "string"}, "unit": {"type": "string"},
    "position": {"type": "number"}, "standard_deviation": {"type": "number"}, "velocity": {"type": "number"},
    "limits": {"type": "array", "items": {"type": "number"}}, "confidence": {"type": "number"}}}}}})";

template <class Message>
std::string cdr_text(const Message& message) {
  const std::vector<std::uint8_t> bytes = interfaces::encode_cdr(message);
  return {bytes.begin(), bytes.end()};
}

interfaces::WebMessagePtr text_of(const ordered_json& document) {
  return interfaces::make_web_message(interfaces::WebSocketKind::kText, belief::json_text(document),
                                      WebDelivery::kEach);
}

ordered_json status_document(StatusLevel level, const std::string& text) {
  return JsonFields()
      .text("op", "status")
      .count("level", static_cast<std::uint64_t>(level))
      .text("message", text)
      .take();
}

std::string camera_frame(std::size_t camera, const std::vector<std::string>& names) {
  return camera == 0 ? kCameraFrame : "prescene_camera_" + names.at(camera);
}

/// Of that camera, the newest frame; null where it has given none.
const belief::Observation* frame_of(const ShownStep& step, std::size_t camera) {
  if (step.frames.empty()) return camera == 0 ? &step.observation : nullptr;
  const auto found = step.frames.find(static_cast<int>(camera));
  return found == step.frames.end() ? nullptr : &found->second;
}

bool is_u32(const ordered_json& number) {
  return number.is_number_unsigned() && number.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
}

}  // namespace

const std::vector<std::string>& FoxgloveServer::subprotocols() {
  static const std::vector<std::string> kNames = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
  return kNames;
}

bool FoxgloveServer::speaks(const std::string& subprotocol) {
  return std::find(subprotocols().begin(), subprotocols().end(), subprotocol) != subprotocols().end();
}

std::uint32_t FoxgloveServer::channels() const {
  return kChannels + 2 * static_cast<std::uint32_t>(cameras_.empty() ? 0 : cameras_.size() - 1);
}

interfaces::RosTfMessage FoxgloveServer::tf_of(const ShownStep& step, const BeliefSummary& summary,
                                               const std::string& world_frame) const {
  interfaces::RosTfMessage tf;
  const auto add = [&](const std::string& child, const geometry::Pose& X_WF) {
    tf.transforms.push_back(
        interfaces::to_ros_transform(interfaces::FrameTransform{world_frame, child, summary.stamp_ns, X_WF}));
  };
  for (std::size_t i = 0; i < std::max<std::size_t>(1, cameras_.size()); ++i)
    if (const belief::Observation* frame = frame_of(step, i)) add(camera_frame(i, cameras_), frame->X_WC);
  for (const ObjectSummary& object : summary.objects)
    if (object.state != belief::TrackState::kLost) add("prescene/" + object.name, object.X_WO);
  return tf;
}

ordered_json FoxgloveServer::channel_list() const {
  ordered_json channels = ordered_json::array();
  const auto add = [&](std::uint32_t channel, const std::string& topic, const char* encoding,
                       const std::string& schema_name, const char* schema_encoding, const std::string& schema) {
    channels.push_back(JsonFields()
                           .count("id", channel)
                           .text("topic", topic)
                           .text("encoding", encoding)
                           .text("schemaName", schema_name)
                           .text("schema", schema)
                           .text("schemaEncoding", schema_encoding)
                           .take());
  };
  const auto add_ros = [&](std::uint32_t channel, const std::string& topic, const interfaces::RosType& type) {
    add(channel, topic, "cdr", std::string(type.name), "ros2msg", interfaces::ros2msg_schema(type));
  };
  add(kBelief, kBeliefTopic, "json", "prescene.Belief", "jsonschema", kBeliefSchema);
  add_ros(kMarkers, kMarkersTopic, interfaces::ros_type<interfaces::RosMarkerArray>());
  add_ros(kTf, "/tf", interfaces::ros_type<interfaces::RosTfMessage>());
  add_ros(kDetections, kDetectionsTopic, interfaces::ros_type<interfaces::RosDetection3dArray>());
  const auto add_camera = [&](std::uint32_t channel, const std::string& topics) {
    add_ros(channel, topics + "/image/compressed", interfaces::ros_type<interfaces::RosCompressedImage>());
    add_ros(channel + 1, topics + "/camera_info", interfaces::ros_type<interfaces::RosCameraInfo>());
  };
  add_camera(kPicture, "/prescene/camera");
  for (std::uint32_t i = 1; i < cameras_.size(); ++i)
    add_camera(kChannels + 2 * (i - 1), "/prescene/camera_" + cameras_[i]);
  return channels;
}

void FoxgloveServer::open(WebClient client, const Send& send) {
  {
    const std::lock_guard lock(mutex_);
    subscriptions_[client];
  }
  send(client, text_of(JsonFields()
                           .text("op", "serverInfo")
                           .text("name", "prescene")
                           .field("capabilities", ordered_json::array())
                           .texts("supportedEncodings", {"cdr", "json"})
                           .field("metadata", ordered_json::object())
                           .text("sessionId", std::to_string(core::wall_now_ns()))
                           .take()));
  send(client, text_of(JsonFields().text("op", "advertise").field("channels", channel_list()).take()));
}

void FoxgloveServer::close(WebClient client) {
  const std::lock_guard lock(mutex_);
  subscriptions_.erase(client);
}

void FoxgloveServer::take(WebClient client, const std::string& text, const Send& send) {
  const ordered_json request = parse_or_discard(text);
  if (!request.is_object() || !request.contains("op") || !request["op"].is_string())
    return send(client, text_of(status_document(StatusLevel::kError, "not a JSON object with \"op\"")));
  const std::string op = request["op"].get<std::string>();
  if (op == "subscribe") return subscribe(client, request, send);
  if (op == "unsubscribe") return unsubscribe(client, request);
  send(client,
       text_of(status_document(StatusLevel::kWarning, "this server only publishes: there is no such operation")));
}

void FoxgloveServer::subscribe(WebClient client, const ordered_json& request, const Send& send) {
  const auto wanted = request.find("subscriptions");
  std::string problem = wanted != request.end() && wanted->is_array() ? "" : "subscribe: \"subscriptions\" is no list";
  if (problem.empty()) {
    const std::lock_guard lock(mutex_);
    auto& known = subscriptions_[client];
    for (const ordered_json& one : *wanted) {
      const bool good = one.is_object() && one.contains("id") && is_u32(one["id"]) && one.contains("channelId") &&
                        is_u32(one["channelId"]) && one["channelId"].get<std::uint32_t>() < channels();
      if (!good) {
        problem = "subscribe: not {\"id\", \"channelId\"} of a channel that is advertised";
      } else if (known.size() >= kMostSubscriptions) {
        problem = "subscribe: no more than " + std::to_string(kMostSubscriptions) + " subscriptions";
      } else {
        known[one["id"].get<std::uint32_t>()] = one["channelId"].get<std::uint32_t>();
      }
    }
  }
  if (!problem.empty()) send(client, text_of(status_document(StatusLevel::kError, problem)));
}

void FoxgloveServer::unsubscribe(WebClient client, const ordered_json& request) {
  const auto ids = request.find("subscriptionIds");
  if (ids == request.end() || !ids->is_array()) return;
  const std::lock_guard lock(mutex_);
  auto& known = subscriptions_[client];
  for (const ordered_json& id : *ids)
    if (is_u32(id)) known.erase(id.get<std::uint32_t>());
}

std::string FoxgloveServer::payload_of(std::uint32_t channel, const ShownStep& step, const BeliefSummary& summary,
                                       const std::string& world_frame) {
  const belief::Scene& scene = *step.belief->scene;
  switch (channel) {
    case kBelief:
      return belief::json_text(to_json(summary));
    case kMarkers:
      if (scene_of_meshes_ != step.belief->scene) {
        meshes_ = marker_meshes(scene);
        scene_of_meshes_ = step.belief->scene;
      }
      return cdr_text(markers_of(summary, scene, meshes_, world_frame));
    case kTf:
      return cdr_text(tf_of(step, summary, world_frame));
    case kDetections:
      return cdr_text(detections_of(summary, scene, world_frame));
    default:
      break;
  }
  const bool is_first = channel < kChannels;
  const std::uint32_t part = is_first ? channel - kPicture : (channel - kChannels) % 2;
  const std::size_t camera = is_first ? 0 : 1 + (channel - kChannels) / 2;
  const belief::Observation* frame = frame_of(step, camera);
  if (frame == nullptr || (!step.frames.empty() && sent_ns_[channel] == frame->stamp_ns)) return "";
  sent_ns_[channel] = frame->stamp_ns;
  const interfaces::RosHeader header{interfaces::to_ros_time(step.frames.empty() ? summary.stamp_ns : frame->stamp_ns),
                                     camera_frame(camera, cameras_)};
  if (part != 0) return cdr_text(interfaces::to_ros_camera_info(frame->frame.camera, header));
  // Whole: the camera info is of this size.
  const std::string jpeg = picture_jpeg(*frame, frame->frame.camera.width, kPictureQuality);
  return cdr_text(interfaces::RosCompressedImage{header, "jpeg", {jpeg.begin(), jpeg.end()}});
}

void FoxgloveServer::publish(const ShownStep& step, const BeliefSummary& summary, const std::string& world_frame,
                             const Send& send) {
  std::vector<std::pair<WebClient, std::map<std::uint32_t, std::uint32_t>>> wanted;
  {
    const std::lock_guard lock(mutex_);
    wanted.assign(subscriptions_.begin(), subscriptions_.end());
  }
  std::map<std::uint32_t, std::string> payloads;  // "" = nothing new
  const core::TimeNs now_ns = core::wall_now_ns();
  for (const auto& [client, subscriptions] : wanted) {
    for (const auto& [id, channel] : subscriptions) {
      const auto [known, is_new] = payloads.try_emplace(channel);
      std::string& payload = known->second;
      if (is_new) payload = payload_of(channel, step, summary, world_frame);
      if (payload.empty()) continue;
      std::string message(1, static_cast<char>(kMessageData));
      for (unsigned shift = 0; shift < 32; shift += 8) message += static_cast<char>((id >> shift) & 0xffU);
      for (unsigned shift = 0; shift < 64; shift += 8)
        message += static_cast<char>((static_cast<std::uint64_t>(now_ns) >> shift) & 0xffU);
      message += payload;
      send(client, interfaces::make_web_message(interfaces::WebSocketKind::kBinary, message, WebDelivery::kNewest));
    }
  }
}

}  // namespace prescene::service
