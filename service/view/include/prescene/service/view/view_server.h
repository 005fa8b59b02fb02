// SPDX-License-Identifier: Apache-2.0
// The page of the live view and the WebSockets to it. What is shown comes from LiveView or RecordingView; this knows
// how it is carried: JSON texts {"op": ...} both ways, pictures as binary messages to the page
// (docs/reference/live_view.md).
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/web/web_server.h"

namespace prescene::service {

/// Where Foxglove's own server listens, so that its programs offer it.
inline constexpr int kViewPort = 8765;

struct ViewOptions {
  std::string address = "127.0.0.1";  ///< Other machines reach others, 0.0.0.0 above all; they need a token.
  int port = kViewPort;               ///< 0 = any that is free.
  std::string token;                  ///< Empty: one is made up where the address needs it.
  std::vector<std::string> allowed_origins;
  std::string world_frame = "world";  ///< As messages of ROS name it.
  std::vector<std::string> cameras;   ///< Names of several; empty = there is one.
};

class FoxgloveServer;
struct BeliefSummary;
struct ShownStep;

/// First byte of a binary message to the page; the number of the camera (one byte), six bytes of 0, a little-endian
/// index (u64) and a JPEG follow.
enum class ViewPictureKind : std::uint8_t {
  kFrame = 1,  ///< The camera's picture at the step with this index.
  kStrip = 2,  ///< A small one for the strip beside the timeline.
};

interfaces::WebMessagePtr view_text(const nlohmann::ordered_json& document, interfaces::WebDelivery delivery);
interfaces::WebMessagePtr view_picture(ViewPictureKind kind, std::uint64_t index, std::string_view jpeg,
                                       interfaces::WebDelivery delivery, int camera = 0);

/// Called on the server's thread, with a document that is an object whose "op" is a text.
struct ViewHandlers {
  std::function<void(interfaces::WebClient client)> on_open;
  std::function<void(interfaces::WebClient client, const std::string& op, const nlohmann::ordered_json& request)>
      on_request;
  std::function<void(interfaces::WebClient client)> on_close;
};

class ViewServer {
 public:
  /// Errors of WebServer::create. With `foxglove`, whoever speaks its protocol is served too, by publish_step().
  static core::Result<std::unique_ptr<ViewServer>> create(const ViewOptions& options, bool foxglove,
                                                          ViewHandlers handlers, const core::LogSink& log);
  ~ViewServer();

  std::string url() const { return server_->url(); }
  int port() const { return server_->port(); }
  interfaces::WebCounts counts() const { return server_->counts(); }
  /// Whether anybody looks: what nobody sees need not be made.
  bool has_clients() const { return server_->counts().clients > 0; }
  void send(interfaces::WebClient client, const interfaces::WebMessagePtr& message) { server_->send(client, message); }
  /// To all pages.
  void send_to_all(const interfaces::WebMessagePtr& message);
  /// To those who speak Foxglove's protocol and subscribed; always from the same thread.
  void publish_step(const ShownStep& step, const BeliefSummary& summary);

 private:
  ViewServer() = default;
  void open(interfaces::WebClient client, const std::string& subprotocol);
  void take(interfaces::WebClient client, const std::string& text);
  void close(interfaces::WebClient client);

  ViewHandlers handlers_;
  std::string world_frame_;
  std::unique_ptr<FoxgloveServer> foxglove_;
  std::mutex mutex_;                       // guards who is which,
  std::set<interfaces::WebClient> pages_;  // as steps are sent from other threads
  std::set<interfaces::WebClient> foxgloves_;
  std::mutex starting_;                            // held until server_ is set: a client may come before
  std::unique_ptr<interfaces::WebServer> server_;  // last: its thread ends first
};

}  // namespace prescene::service
