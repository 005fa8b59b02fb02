// SPDX-License-Identifier: Apache-2.0
// A small web server inside the program: a handful of files for a browser, and WebSockets to talk with them. One thread
// of its own serves all clients; whoever sends only hands a message over and never waits for a client.
//
//   PRESCENE_TRY(const auto server, WebServer::create({.port = 8765}, files, handlers, log));
//   ... server->url()
//   server->send_to_all(make_web_message(WebSocketKind::kText, text, WebDelivery::kNewest));
//
// Nothing from outside is believed: a request's head, a message and what waits for a client are bounded, as is the
// number of clients. A client that breaks the protocol is closed with the protocol's own code, one that takes nothing
// any more is dropped. Only GET and HEAD are answered. Pages of other origins are refused (no CORS), and a strict
// Content-Security-Policy keeps ours from loading anything from elsewhere.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/web/http_request.h"
#include "prescene/interfaces/web/websocket.h"

namespace prescene::interfaces {

/// A file of the page: what a GET of its path returns.
struct WebFile {
  std::string path;        ///< "/view.js"; "/" is the page itself.
  std::string media_type;  ///< "text/javascript; charset=utf-8"
  std::string body;
};

enum class WebDelivery {
  kEach,    ///< Every one arrives; a client for whom too many wait is dropped.
  kNewest,  ///< State that the next message replaces: where too many wait, the oldest are dropped and counted.
};

/// One message, framed once for all clients; made by make_web_message, never changed.
struct WebMessage {
  std::string frame;
  WebDelivery delivery = WebDelivery::kEach;
};
using WebMessagePtr = std::shared_ptr<const WebMessage>;
WebMessagePtr make_web_message(WebSocketKind kind, std::string_view payload, WebDelivery delivery);

struct WebServerOptions {
  std::string address = "127.0.0.1";  ///< A numeric IPv4 or IPv6 address, or "localhost".
  int port = 0;                       ///< 0 = any that is free.
  /// Whoever gives it, as `?token=`, as a cookie that the page then sets, or as `Authorization: Bearer`, is served;
  /// empty = everybody who reaches the port. Letters, digits, '-' and '_' only.
  std::string token;
  /// Origins of pages that may open a WebSocket though they are not ours ("https://app.example.org", "file://").
  std::vector<std::string> allowed_origins;
  /// Subprotocols that are spoken; the first of the client's that is among them is chosen, and where there is none the
  /// WebSocket is refused.
  std::vector<std::string> subprotocols;
  int max_clients = 64;
  HttpLimits request;
  std::size_t max_message_bytes = std::size_t{1} << 20;   ///< Of a client's message.
  std::size_t max_newest_waiting = 8;                     ///< Messages of kNewest that may wait for a client.
  std::size_t max_bytes_waiting = std::size_t{32} << 20;  ///< For one client; with more of kEach it is dropped.
  double request_seconds = 10.0;                          ///< For a request to come, and for a response to be taken.
  double stall_seconds = 10.0;  ///< A client that takes nothing for so long while something waits is dropped.
  double ping_seconds = 20.0;   ///< One from whom nothing comes for so long is pinged, after thrice that dropped.
};

using WebClient = std::uint64_t;  ///< Number of a WebSocket, from 1 on, never used twice.

/// Called on the server's thread; they may send. No exception may leave them.
struct WebHandlers {
  std::function<void(WebClient client, const std::string& subprotocol)> on_open;
  std::function<void(WebClient client, WebSocketMessage&& message)> on_message;  ///< Text or binary.
  std::function<void(WebClient client)> on_close;
};

struct WebCounts {
  int clients = 0;             ///< WebSockets that are open now.
  std::uint64_t opened = 0;    ///< WebSockets since the start.
  std::uint64_t requests = 0;  ///< Answered with 200 or 101.
  std::uint64_t refused = 0;   ///< Answered with an error, or closed for one in the protocol.
  std::uint64_t left_out = 0;  ///< Messages of kNewest that a client was too slow for.
  std::uint64_t dropped = 0;   ///< Clients that took nothing, or for whom too much waited.
  friend bool operator==(const WebCounts&, const WebCounts&) = default;
};

/// Whether only this machine reaches the address; false for what is no numeric address.
bool is_loopback(const std::string& address);
/// A token that nobody guesses: 32 hexadecimal digits of the system's random numbers; kUnavailable without them.
core::Result<std::string> random_web_token();

class WebServer {
 public:
  /// Listens. kUnavailable where the port is in use or may not be taken; kInvalidInput for an address that is none, a
  /// token with other characters, or an address beyond this machine without a token.
  static core::Result<std::unique_ptr<WebServer>> create(const WebServerOptions& options, std::vector<WebFile> files,
                                                         WebHandlers handlers, const core::LogSink& log);
  /// Closes all connections. No handler runs once it has returned.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  /// "http://127.0.0.1:8765/", with the token where there is one.
  std::string url() const;

  /// Hand the message over; from any thread, also where the client is gone.
  void send(WebClient client, const WebMessagePtr& message);
  void send_to_all(const WebMessagePtr& message);
  /// Messages that wait for a client; 0 where it is gone.
  std::size_t waiting(WebClient client) const;
  WebCounts counts() const;

 private:
  struct Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
