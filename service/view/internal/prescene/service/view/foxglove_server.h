// SPDX-License-Identifier: Apache-2.0
// The server's side of the Foxglove WebSocket protocol, version 1 [https://github.com/foxglove/ws-protocol]: topics are
// advertised, and whoever subscribes to one gets its messages as ROS 2 would have them.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/interfaces/web/web_server.h"
#include "prescene/service/view/view_content.h"

namespace prescene::service {

/// Thread-safe.
class FoxgloveServer {
 public:
  using Send = std::function<void(interfaces::WebClient client, const interfaces::WebMessagePtr& message)>;

  /// `cameras`: the names of several, of which the others' pictures have topics of their own; empty = there is one.
  explicit FoxgloveServer(std::vector<std::string> cameras) : cameras_(std::move(cameras)) {}

  /// The newest name first: clients choose.
  static const std::vector<std::string>& subprotocols();
  static bool speaks(const std::string& subprotocol);

  /// Says who it is and what there is.
  void open(interfaces::WebClient client, const Send& send);
  void close(interfaces::WebClient client);
  /// A text of the client's: subscribe, unsubscribe; others are answered with a warning, what is no JSON with an error.
  void take(interfaces::WebClient client, const std::string& text, const Send& send);
  /// Sends a step to those who subscribed; what nobody wants is not made.
  void publish(const ShownStep& step, const BeliefSummary& summary, const std::string& world_frame, const Send& send);

 private:
  /// Then two of each camera after the first: its picture and its camera info.
  enum Channel : std::uint32_t { kBelief, kMarkers, kTf, kDetections, kPicture, kCameraInfo, kChannels };
  std::uint32_t channels() const;
  nlohmann::ordered_json channel_list() const;
  std::string payload_of(std::uint32_t channel, const ShownStep& step, const BeliefSummary& summary,
                         const std::string& world_frame);
  interfaces::RosTfMessage tf_of(const ShownStep& step, const BeliefSummary& summary,
                                 const std::string& world_frame) const;
  void subscribe(interfaces::WebClient client, const nlohmann::ordered_json& request, const Send& send);
  void unsubscribe(interfaces::WebClient client, const nlohmann::ordered_json& request);

  std::mutex mutex_;  // guards the subscriptions
  /// By client: the client's numbers of its subscriptions, with their channels.
  std::map<interfaces::WebClient, std::map<std::uint32_t, std::uint32_t>> subscriptions_;
  const std::vector<std::string> cameras_;
  // Of the thread that publishes.
  std::shared_ptr<const belief::Scene> scene_of_meshes_;
  MarkerMeshes meshes_;
  std::map<std::uint32_t, core::TimeNs> sent_ns_;  // by channel: the stamp of the frame of a camera that was sent last
};

}  // namespace prescene::service
