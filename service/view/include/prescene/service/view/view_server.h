// SPDX-License-Identifier: Apache-2.0
// The page of the live view and the WebSockets to it. What is shown comes from LiveView or RecordingView; this knows
// how it is carried: JSON texts {"op": ...} both ways, pictures as binary messages to the page
// (docs/reference/live_view.md).
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
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
};

/// First byte of a binary message to the page; seven bytes of 0, a little-endian index (u64) and a JPEG follow.
enum class ViewPictureKind : std::uint8_t {
  kFrame = 1,  ///< The camera's picture of the step with this index.
  kStrip = 2,  ///< A small one for the strip beside the timeline.
};

interfaces::WebMessagePtr view_text(const nlohmann::ordered_json& document, interfaces::WebDelivery delivery);
interfaces::WebMessagePtr view_picture(ViewPictureKind kind, std::uint64_t index, std::string_view jpeg,
                                       interfaces::WebDelivery delivery);

/// Called on the server's thread, with a document that is an object whose "op" is a text.
struct ViewHandlers {
  std::function<void(interfaces::WebClient client)> on_open;
  std::function<void(interfaces::WebClient client, const std::string& op, const nlohmann::ordered_json& request)>
      on_request;
  std::function<void(interfaces::WebClient client)> on_close;
};

class ViewServer {
 public:
  /// Errors of WebServer::create, with the address.
  static core::Result<std::unique_ptr<ViewServer>> create(const ViewOptions& options, ViewHandlers handlers,
                                                          const core::LogSink& log);

  std::string url() const { return server_->url(); }
  int port() const { return server_->port(); }
  interfaces::WebCounts counts() const { return server_->counts(); }
  /// Whether anybody looks: what nobody sees need not be made.
  bool has_clients() const { return server_->counts().clients > 0; }
  void send(interfaces::WebClient client, const interfaces::WebMessagePtr& message) { server_->send(client, message); }
  void send_to_all(const interfaces::WebMessagePtr& message) { server_->send_to_all(message); }

 private:
  explicit ViewServer(std::unique_ptr<interfaces::WebServer> server) : server_(std::move(server)) {}
  std::unique_ptr<interfaces::WebServer> server_;
};

}  // namespace prescene::service
