// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/web/web_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>

#include "tests/interfaces/web/web_client.h"

namespace prescene::interfaces::web_server_test {
namespace {

using core::StatusCode;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// What the handlers saw, to be waited for.
class Seen {
 public:
  WebHandlers handlers() {
    return {[this](WebClient client, const std::string& protocol) { note([&] { open[client] = protocol; }); },
            [this](WebClient client, WebSocketMessage&& message) {
              note([&] { messages.emplace_back(client, message.payload); });
            },
            [this](WebClient client) {
              note([&] {
                open.erase(client);
                ++closed;
              });
            }};
  }
  void note(const std::function<void()>& what) {
    const std::lock_guard lock(mutex_);
    what();
    changed_.notify_all();
  }
  void wait(const std::function<bool()>& holds) {
    std::unique_lock lock(mutex_);
    ASSERT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), holds));
  }
  WebClient only_client() {
    const std::lock_guard lock(mutex_);
    return open.size() == 1 ? open.begin()->first : 0;
  }
  std::map<WebClient, std::string> open;
  std::vector<std::pair<WebClient, std::string>> messages;
  int closed = 0;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
};

const std::vector<WebFile> kFiles = {{"/", "text/html; charset=utf-8", "<p>hello"},
                                     {"/a.js", "text/javascript; charset=utf-8", "let a;"}};

WebServerOptions speaking() {
  WebServerOptions options;
  options.subprotocols = {"one", "two"};
  return options;
}

std::unique_ptr<WebServer> serve(Seen& seen, const WebServerOptions& options = speaking()) {
  auto server = WebServer::create(options, kFiles, seen.handlers(), {});
  EXPECT_TRUE(server.ok()) << server.status().message();
  return *std::move(server);
}

std::string answer_to(const WebServer& server, const std::string& request) {
  WebClientSocket client(server.port());
  client.send(request);
  return client.read_all();
}

TEST(WebServer, ServesItsFilesWithStrictHeaders) {
  Seen seen;
  const auto server = serve(seen);
  EXPECT_EQ(server->url(), "http://127.0.0.1:" + std::to_string(server->port()) + "/");
  const std::string page = answer_to(*server, get_request("/"));
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(page, HasSubstr("\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: 8\r\n"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self';"));
  EXPECT_THAT(page, HasSubstr("frame-ancestors 'none'"));
  EXPECT_EQ(page.find("Access-Control"), std::string::npos);
  EXPECT_TRUE(page.ends_with("\r\n\r\n<p>hello"));
  std::string head = get_request("/a.js");
  const std::string only_head = answer_to(*server, head.replace(0, 3, "HEAD"));
  EXPECT_THAT(only_head, HasSubstr("Content-Length: 6\r\n"));
  EXPECT_TRUE(only_head.ends_with("\r\n\r\n"));
  EXPECT_THAT(answer_to(*server, get_request("/../etc/passwd")), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(answer_to(*server, "POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"), StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(answer_to(*server, "hello\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(answer_to(*server, get_request("/", {"A: " + std::string(20'000, 'a')})), StartsWith("HTTP/1.1 431 "));
}

TEST(WebServer, ServesNoNameThatWasMadeToPointHere) {
  Seen seen;
  const auto server = serve(seen);
  EXPECT_THAT(answer_to(*server, get_request("/", {"Host: evil.example:8765"})), StartsWith("HTTP/1.1 421 "));
  for (const char* host : {"Host: localhost:1", "Host: 127.0.0.1", "Host: [::1]:8765"})
    EXPECT_THAT(answer_to(*server, get_request("/", {host})), StartsWith("HTTP/1.1 200 ")) << host;
  EXPECT_THAT(answer_to(*server, get_request("/", {"Host: a\" b"})), StartsWith("HTTP/1.1 400 "));
}

TEST(WebServer, ShakesHands) {
  Seen seen;
  const auto server = serve(seen);
  WebClientSocket client(server->port());
  client.send(handshake("zero, two, one") + client_frame(1, "early"));
  const std::string head = client.read_head();
  EXPECT_THAT(head, StartsWith("HTTP/1.1 101 "));
  EXPECT_THAT(head, HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"));
  EXPECT_THAT(head, HasSubstr("Sec-WebSocket-Protocol: two\r\n"));
  seen.wait([&] { return seen.messages.size() == 1; });
  EXPECT_EQ(seen.messages[0].second, "early");
  server->send(seen.only_client(),
               make_web_message(WebSocketKind::kText, std::string(70'000, 'x'), WebDelivery::kEach));
  const auto frame = client.read_message();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, std::string(70'000, 'x'));
  client.send(client_frame(9, "are you there"));
  const auto pong = client.read_frame();
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->opcode, 10);
  EXPECT_EQ(pong->payload, "are you there");
  client.send(client_frame(8, std::string("\x03\xe8", 2)));
  EXPECT_EQ(client.read_close(), 1000);
  seen.wait([&] { return seen.closed == 1; });
}

TEST(WebServer, RefusesOtherHandshakes) {
  Seen seen;
  WebServerOptions options = speaking();
  options.allowed_origins = {"https://friend.example"};
  const auto server = serve(seen, options);
  const auto status = [&](const std::string& request) { return answer_to(*server, request).substr(9, 3); };
  EXPECT_EQ(status(handshake("three")), "400");
  EXPECT_EQ(status(handshake("")), "400");
  EXPECT_EQ(status(handshake("one", {"Origin: https://evil.example"})), "403");
  EXPECT_EQ(status(handshake("one", {"Origin: null"})), "403");
  std::string old = handshake("one");
  old.replace(old.find("Version: 13"), 11, "Version: 12");
  EXPECT_EQ(status(old), "426");
  std::string keyless = handshake("one");
  keyless.replace(keyless.find("-Key:"), 5, "-Kez:");
  EXPECT_EQ(status(keyless), "400");
  for (const char* origin : {"Origin: http://localhost", "Origin: https://friend.example"}) {
    WebClientSocket client(server->port());
    client.send(handshake("one", {origin}));
    EXPECT_THAT(client.read_head(), StartsWith("HTTP/1.1 101 ")) << origin;
  }
  EXPECT_EQ(server->counts().refused, 6U);
}

TEST(WebServer, AsksForTheToken) {
  Seen seen;
  WebServerOptions options = speaking();
  options.token = "s3cret";
  const auto server = serve(seen, options);
  EXPECT_THAT(server->url(), ::testing::EndsWith("/?token=s3cret"));
  EXPECT_THAT(answer_to(*server, get_request("/")), StartsWith("HTTP/1.1 401 "));
  EXPECT_THAT(answer_to(*server, get_request("/?token=s3cre")), StartsWith("HTTP/1.1 401 "));
  EXPECT_THAT(answer_to(*server, get_request("/?token=s3crets")), StartsWith("HTTP/1.1 401 "));
  EXPECT_THAT(answer_to(*server, handshake("one")), StartsWith("HTTP/1.1 401 "));
  const std::string page = answer_to(*server, get_request("/?token=s3cret"));
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(page, HasSubstr("Set-Cookie: prescene_token=s3cret; HttpOnly; SameSite=Strict"));
  EXPECT_THAT(answer_to(*server, get_request("/a.js", {"Cookie: x=y; prescene_token=s3cret"})),
              StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(answer_to(*server, get_request("/", {"Authorization: Bearer s3cret"})), StartsWith("HTTP/1.1 200 "));
  WebClientSocket client(server->port());
  client.send(handshake("one", {}, "/?token=s3cret"));
  EXPECT_THAT(client.read_head(), StartsWith("HTTP/1.1 101 "));
}

TEST(WebServer, NamesWhatItCannotListenOn) {
  Seen seen;
  const auto server = serve(seen);
  WebServerOptions options = speaking();
  options.port = server->port();
  const auto second = WebServer::create(options, {}, {}, {});
  EXPECT_EQ(second.status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(second.status().message(), HasSubstr("is in use: give another port"));
  options.address = "0.0.0.0";
  EXPECT_THAT(WebServer::create(options, {}, {}, {}).status().message(), HasSubstr("a token is needed"));
  options.address = "my-robot";
  EXPECT_EQ(WebServer::create(options, {}, {}, {}).status().code(), StatusCode::kInvalidInput);
  options = speaking();
  options.token = "a b";
  EXPECT_EQ(WebServer::create(options, {}, {}, {}).status().code(), StatusCode::kInvalidInput);
  const auto token = random_web_token(), other = random_web_token();
  ASSERT_TRUE(token.ok() && other.ok());
  EXPECT_EQ((*token).size(), 32U);
  EXPECT_NE(*token, *other);
}

// A frame that claims more than may come closes the connection before any of it is kept.
TEST(WebServer, ClosesClientsThatLie) {
  Seen seen;
  const auto server = serve(seen);
  const std::vector<std::pair<std::string, int>> lies = {{client_frame(2, "", true, std::uint64_t{1} << 40), 1009},
                                                         {client_frame(1, "\xff\xfe"), 1007},
                                                         {"\x81\x05Hello", 1002},
                                                         {client_frame(0, "of nothing"), 1002}};
  for (const auto& [bytes, code] : lies) {
    WebClientSocket client(server->port());
    client.send(handshake("one") + bytes);
    client.read_head();
    EXPECT_EQ(client.read_close(), code);
    EXPECT_EQ(client.read_all(), "");
  }
  EXPECT_TRUE(seen.messages.empty());
}

TEST(WebServer, ManyPingsFillNoQueue) {
  Seen seen;
  const auto server = serve(seen);
  WebClientSocket client(server->port());
  std::string pings;
  for (int i = 0; i < 5000; ++i) pings += client_frame(9, "ping");
  client.send(handshake("one") + pings + client_frame(1, "the end"));
  seen.wait([&] { return !seen.messages.empty(); });
  EXPECT_LE(server->waiting(seen.only_client()), 2U);
}

// Twenty clients, one of which takes nothing: the others miss nothing, what waits for the frozen one stays bounded,
// and it is dropped in the end.
TEST(WebServer, TwentyClientsAndAFrozenOne) {
  Seen seen;
  WebServerOptions options = speaking();
  options.stall_seconds = 0.3;
  const auto server = serve(seen, options);
  constexpr int kClients = 20, kMessages = 100;
  std::vector<std::unique_ptr<WebClientSocket>> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<WebClientSocket>(server->port(), 4096));
    clients.back()->send(handshake("one"));
    ASSERT_THAT(clients.back()->read_head(), StartsWith("HTTP/1.1 101 "));
  }
  seen.wait([&] { return seen.open.size() == kClients; });
  for (int n = 0; n < kMessages; ++n) {
    // The clients read at once, so that none of them is too slow; the last one never does.
    const std::string payload = std::to_string(n) + std::string(20'000, '.');
    server->send_to_all(make_web_message(WebSocketKind::kBinary, payload, WebDelivery::kNewest));
    for (int i = 0; i + 1 < kClients; ++i) {
      const auto frame = clients[static_cast<std::size_t>(i)]->read_message();
      ASSERT_TRUE(frame) << n << " " << i;
      ASSERT_EQ(frame->payload, payload);
    }
    for (WebClient client = 1; client <= kClients; ++client)
      EXPECT_LE(server->waiting(client), options.max_newest_waiting + 1);
  }
  seen.wait([&] { return seen.closed == 1; });
  EXPECT_EQ(server->counts().dropped, 1U);
  EXPECT_EQ(server->counts().clients, kClients - 1);
}

// What is left out is the oldest: the last message comes, whatever came before.
TEST(WebServer, LeavesOutTheOldestForWhoIsSlow) {
  Seen seen;
  const auto server = serve(seen);
  WebClientSocket client(server->port(), 4096);
  client.send(handshake("one"));
  client.read_head();
  seen.wait([&] { return seen.open.size() == 1; });
  constexpr int kMessages = 300;
  for (int n = 0; n < kMessages; ++n) {
    const std::string payload = std::to_string(n) + " " + std::string(20'000, '.');
    server->send_to_all(make_web_message(WebSocketKind::kBinary, payload, WebDelivery::kNewest));
  }
  EXPECT_LE(server->waiting(seen.only_client()), 9U);
  int last = -1, received = 0;
  while (last + 1 < kMessages) {
    const auto frame = client.read_message();
    ASSERT_TRUE(frame);
    const int number = std::stoi(frame->payload);
    ASSERT_GT(number, last);
    last = number;
    ++received;
  }
  EXPECT_EQ(server->counts().left_out, static_cast<std::uint64_t>(kMessages - received));
  EXPECT_LT(received, kMessages);
}

TEST(WebServer, DropsWhoTakesTooLittleOfWhatMustArrive) {
  Seen seen;
  WebServerOptions options = speaking();
  options.max_bytes_waiting = 1 << 20;
  const auto server = serve(seen, options);
  WebClientSocket client(server->port(), 4096);
  client.send(handshake("one"));
  client.read_head();
  seen.wait([&] { return seen.open.size() == 1; });
  const auto message = make_web_message(WebSocketKind::kBinary, std::string(100'000, 'x'), WebDelivery::kEach);
  for (int i = 0; i < 100; ++i) server->send_to_all(message);
  seen.wait([&] { return seen.closed == 1; });
  EXPECT_EQ(server->counts().dropped, 1U);
}

TEST(WebServer, TurnsAwayMoreThanItServes) {
  Seen seen;
  WebServerOptions options = speaking();
  options.max_clients = 3;
  const auto server = serve(seen, options);
  std::vector<std::unique_ptr<WebClientSocket>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<WebClientSocket>(server->port()));
    clients.back()->send(handshake("one"));
    ASSERT_THAT(clients.back()->read_head(), StartsWith("HTTP/1.1 101 "));
  }
  EXPECT_THAT(WebClientSocket(server->port()).read_all(), StartsWith("HTTP/1.1 503 "));
  clients.pop_back();
  seen.wait([&] { return seen.closed == 1; });
  clients.push_back(std::make_unique<WebClientSocket>(server->port()));
  clients.back()->send(handshake("one"));
  EXPECT_THAT(clients.back()->read_head(), StartsWith("HTTP/1.1 101 "));
}

TEST(WebServer, WaitsForNoRequestForEver) {
  Seen seen;
  WebServerOptions options = speaking();
  options.request_seconds = 0.2;
  const auto server = serve(seen, options);
  WebClientSocket client(server->port());
  client.send("GET / HT");
  EXPECT_THAT(client.read_all(), StartsWith("HTTP/1.1 408 "));
}

}  // namespace
}  // namespace prescene::interfaces::web_server_test
