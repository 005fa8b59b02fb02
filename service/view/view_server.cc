// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_server.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "page_files.h"
#include "prescene/belief/json.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

constexpr const char* kSubprotocol = "prescene.view.v1";
constexpr std::size_t kMostRequestBytes = std::size_t{64} << 10;

void put_u64(std::uint64_t value, std::string& bytes) {
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += static_cast<char>((value >> shift) & 0xffU);
}

}  // namespace

interfaces::WebMessagePtr view_text(const nlohmann::ordered_json& document, interfaces::WebDelivery delivery) {
  return interfaces::make_web_message(interfaces::WebSocketKind::kText, belief::json_text(document), delivery);
}

interfaces::WebMessagePtr view_picture(ViewPictureKind kind, std::uint64_t index, std::string_view jpeg,
                                       interfaces::WebDelivery delivery) {
  std::string payload(1, static_cast<char>(kind));
  payload.append(7, '\0');
  put_u64(index, payload);
  payload.append(jpeg);
  return interfaces::make_web_message(interfaces::WebSocketKind::kBinary, payload, delivery);
}

core::Result<std::unique_ptr<ViewServer>> ViewServer::create(const ViewOptions& options, ViewHandlers handlers,
                                                             const core::LogSink& log) {
  interfaces::WebServerOptions web;
  web.address = options.address;
  web.port = options.port;
  web.token = options.token;
  web.allowed_origins = options.allowed_origins;
  web.subprotocols = {kSubprotocol};
  web.max_message_bytes = kMostRequestBytes;
  if (web.token.empty() && !interfaces::is_loopback(web.address)) {
    PRESCENE_TRY(web.token, interfaces::random_web_token());
  }
  interfaces::WebHandlers web_handlers;
  web_handlers.on_open = [on_open = std::move(handlers.on_open)](interfaces::WebClient client, const std::string&) {
    if (on_open) on_open(client);
  };
  web_handlers.on_close = std::move(handlers.on_close);
  web_handlers.on_message = [on_request = std::move(handlers.on_request)](interfaces::WebClient client,
                                                                          interfaces::WebSocketMessage&& message) {
    try {
      const nlohmann::ordered_json request = parse_or_discard(message.payload, kMostRequestBytes);
      if (!request.is_object() || !request.contains("op") || !request["op"].is_string()) return;
      if (on_request) on_request(client, request["op"].get<std::string>(), request);
    } catch (const std::exception&) {  // of another form than it should be, or no memory: it gets no answer
    }
  };
  PRESCENE_TRY(auto server, interfaces::WebServer::create(web, page_files(), std::move(web_handlers), log));
  return std::unique_ptr<ViewServer>(new ViewServer(std::move(server)));
}

}  // namespace prescene::service
