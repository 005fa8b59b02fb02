// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_server.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "page_files.h"
#include "prescene/belief/json.h"
#include "prescene/service/view/foxglove_server.h"
#include "prescene/service/view/question_ids.h"

namespace prescene::service {
namespace {

using interfaces::WebClient;

constexpr const char* kSubprotocol = "prescene.view.v1";

void put_u64(std::uint64_t value, std::string& bytes) {
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += static_cast<char>((value >> shift) & 0xffU);
}

}  // namespace

interfaces::WebMessagePtr view_text(const nlohmann::ordered_json& document, interfaces::WebDelivery delivery) {
  return interfaces::make_web_message(interfaces::WebSocketKind::kText, belief::json_text(document), delivery);
}

interfaces::WebMessagePtr view_picture(ViewPictureKind kind, std::uint64_t index, std::string_view jpeg,
                                       interfaces::WebDelivery delivery, int camera) {
  std::string payload(1, static_cast<char>(kind));
  payload.push_back(static_cast<char>(camera));
  payload.append(6, '\0');
  put_u64(index, payload);
  payload.append(jpeg);
  return interfaces::make_web_message(interfaces::WebSocketKind::kBinary, payload, delivery);
}

core::Result<std::unique_ptr<ViewServer>> ViewServer::create(const ViewOptions& options, bool foxglove,
                                                             ViewHandlers handlers, const core::LogSink& log) {
  interfaces::WebServerOptions web;
  web.address = options.address;
  web.port = options.port;
  web.token = options.token;
  web.allowed_origins = options.allowed_origins;
  web.subprotocols = {kSubprotocol};
  web.max_message_bytes = kMostPageRequestBytes;
  if (web.token.empty() && !interfaces::is_loopback(web.address)) {
    PRESCENE_TRY(web.token, interfaces::random_web_token());
  }
  std::unique_ptr<ViewServer> view(new ViewServer());
  ViewServer* raw = view.get();
  view->handlers_ = std::move(handlers);
  view->world_frame_ = options.world_frame;
  if (foxglove) {
    view->foxglove_ = std::make_unique<FoxgloveServer>(options.cameras);
    const auto& names = FoxgloveServer::subprotocols();
    web.subprotocols.insert(web.subprotocols.end(), names.begin(), names.end());
  }
  const std::lock_guard starting(view->starting_);
  interfaces::WebHandlers web_handlers;
  web_handlers.on_open = [raw](WebClient client, const std::string& subprotocol) { raw->open(client, subprotocol); };
  web_handlers.on_message = [raw](WebClient client, interfaces::WebSocketMessage&& message) {
    try {
      if (message.kind == interfaces::WebSocketKind::kText) raw->take(client, message.payload);
    } catch (const std::exception&) {  // of another form than it should be, or no memory: it gets no answer
    }
  };
  web_handlers.on_close = [raw](WebClient client) { raw->close(client); };
  PRESCENE_TRY(view->server_, interfaces::WebServer::create(web, page_files(), std::move(web_handlers), log));
  return view;
}

ViewServer::~ViewServer() = default;

void ViewServer::open(WebClient client, const std::string& subprotocol) {
  { const std::lock_guard started(starting_); }
  const bool is_page = !FoxgloveServer::speaks(subprotocol);
  {
    const std::lock_guard lock(mutex_);  // before it is told how things are, so that it misses no news
    (is_page ? pages_ : foxgloves_).insert(client);
  }
  if (is_page && handlers_.on_open) handlers_.on_open(client);
  if (!is_page) foxglove_->open(client, [this](WebClient to, const auto& message) { send(to, message); });
}

void ViewServer::take(WebClient client, const std::string& text) {
  bool is_page = false;
  {
    const std::lock_guard lock(mutex_);
    is_page = pages_.contains(client);
  }
  if (!is_page) return foxglove_->take(client, text, [this](WebClient to, const auto& message) { send(to, message); });
  const auto request = page_request(text);
  if (request && handlers_.on_request) handlers_.on_request(client, request->at("op").get<std::string>(), *request);
}

void ViewServer::close(WebClient client) {
  bool was_page = false;
  {
    const std::lock_guard lock(mutex_);
    was_page = pages_.erase(client) > 0;
    foxgloves_.erase(client);
  }
  if (!was_page) foxglove_->close(client);
}

void ViewServer::send_to_all(const interfaces::WebMessagePtr& message) {
  const std::lock_guard lock(mutex_);
  for (const WebClient page : pages_) server_->send(page, message);
}

void ViewServer::publish_step(const ShownStep& step, const BeliefSummary& summary) {
  {
    const std::lock_guard lock(mutex_);
    if (foxgloves_.empty()) return;
  }
  foxglove_->publish(step, summary, world_frame_, [this](WebClient to, const auto& message) { send(to, message); });
}

}  // namespace prescene::service
