// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/web/web_server.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "client_queue.h"
#include "listening_socket.h"
#include "web_response.h"

namespace prescene::interfaces {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kReadBytes = std::size_t{16} << 10;  // of a client at once; the others wait as long
constexpr int kSendBufferBytes = 256 << 10;                // what the system keeps for a client is old when it is seen
constexpr std::size_t kMostReasonsLogged = 50;
constexpr std::chrono::milliseconds kAcceptPause(200);  // without descriptors for another client
constexpr double kCloseSeconds = 2.0;                   // for a client to take the reason why it is closed

std::chrono::nanoseconds duration_of(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

WebMessagePtr raw_message(std::string bytes) {
  return std::make_shared<const WebMessage>(WebMessage{std::move(bytes), WebDelivery::kEach});
}

core::Status check_options(const WebServerOptions& options) {
  const auto is_token_character = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  if (!std::all_of(options.token.begin(), options.token.end(), is_token_character))
    return core::invalid_input("the token: only letters, digits, '-' and '_' may be in it");
  if (!is_loopback(options.address) && options.token.empty())
    return core::invalid_input(options.address +
                               " is reached from other machines: a token is needed, so that not everybody is served");
  return core::ok_status();
}

}  // namespace

WebMessagePtr make_web_message(WebSocketKind kind, std::string_view payload, WebDelivery delivery) {
  return std::make_shared<const WebMessage>(WebMessage{websocket_frame(kind, payload), delivery});
}

struct WebServer::Impl {
  struct Connection {
    Connection(core::FileDescriptor&& of, const WebServerOptions& options)
        : socket(std::move(of)),
          queue(options.max_newest_waiting, options.max_bytes_waiting),
          reader(options.max_message_bytes) {}
    core::FileDescriptor socket;
    ClientQueue queue;
    WebSocketReader reader;
    std::string head;         // of the request, until it is complete
    WebClient client = 0;     // 0: not a WebSocket
    bool is_dropped = false;  // at the next turn
    bool is_closing = false;  // once the queue is empty; nothing is read any more
    bool was_announced = false;
    bool pong_waits = false;
    bool has_said_goodbye = false;  // the client closed: once it has our answer, so do we
    Clock::time_point opened = Clock::now(), last_read = opened, last_sent = opened, last_ping = opened;
    Clock::time_point close_by = Clock::time_point::max();
  };
  using Number = std::uint64_t;

  WebServerOptions options;
  bool loopback = true;
  std::vector<WebFile> files;
  WebHandlers handlers;
  core::LogSink log;
  ListeningSocket listening;
  core::FileDescriptor wake;

  mutable std::mutex mutex;  // guards the two below, and of connections what others than the server's thread change
  std::map<Number, Connection> connections;
  WebCounts counts;

  // Of the server's thread.
  Number next_number = 1;
  std::set<std::string> logged;
  Clock::time_point accept_again;
  std::atomic<bool> stop{false};
  std::thread thread;

  void run();
  void turn();
  void accept_clients();
  void read_from(Connection& connection, std::vector<WebSocketMessage>& messages, bool& opened, std::string& protocol);
  void take_request(Connection& connection, bool& opened, std::string& protocol);
  void take_frames(Connection& connection, std::string_view bytes, std::vector<WebSocketMessage>& messages);
  void send_to(Connection& connection);
  void close_with(Connection& connection, int code, const std::string& why);
  void look_at_times(Connection& connection, Clock::time_point now);
  void serve(Number number, short events);
  void refuse(const std::string& why);
  void enqueue(Connection& connection, const WebMessagePtr& message);
  void wake_up() const {
    const std::uint64_t one = 1;
    static_cast<void>(!write(wake.number(), &one, sizeof one));  // full: it is awake
  }
};

core::Result<std::unique_ptr<WebServer>> WebServer::create(const WebServerOptions& options, std::vector<WebFile> files,
                                                           WebHandlers handlers, const core::LogSink& log) {
  PRESCENE_RETURN_IF_ERROR(check_options(options));
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->loopback = is_loopback(options.address);
  impl->files = std::move(files);
  impl->handlers = std::move(handlers);
  impl->log = log;
  PRESCENE_TRY(impl->listening, listen_on(options.address, options.port));
  impl->wake = core::FileDescriptor(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (impl->wake.number() < 0) return core::unavailable(std::string("an event descriptor: ") + std::strerror(errno));
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

WebServer::~WebServer() {
  impl_->stop = true;
  impl_->wake_up();
  impl_->thread.join();
}

int WebServer::port() const { return impl_->listening.port; }

std::string WebServer::url() const {
  const std::string& token = impl_->options.token;
  return "http://" + impl_->listening.host + ":" + std::to_string(impl_->listening.port) + "/" +
         (token.empty() ? "" : "?token=" + token);
}

void WebServer::send(WebClient client, const WebMessagePtr& message) {
  {
    const std::lock_guard lock(impl_->mutex);
    const auto found = impl_->connections.find(client);
    if (found == impl_->connections.end() || found->second.client != client) return;
    impl_->enqueue(found->second, message);
  }
  impl_->wake_up();
}

void WebServer::send_to_all(const WebMessagePtr& message) {
  {
    const std::lock_guard lock(impl_->mutex);
    for (auto& [number, connection] : impl_->connections)
      if (connection.client != 0) impl_->enqueue(connection, message);
  }
  impl_->wake_up();
}

std::size_t WebServer::waiting(WebClient client) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->connections.find(client);
  return found == impl_->connections.end() ? 0 : found->second.queue.size();
}

WebCounts WebServer::counts() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counts;
}

void WebServer::Impl::enqueue(Connection& connection, const WebMessagePtr& message) {
  if (connection.is_closing || connection.is_dropped) return;
  if (connection.queue.empty()) connection.last_sent = Clock::now();  // the time of stalling begins now
  counts.left_out += connection.queue.add(message);
  if (!connection.queue.is_overfull()) return;
  connection.is_dropped = true;
  ++counts.dropped;
}

void WebServer::Impl::refuse(const std::string& why) {
  {
    const std::lock_guard lock(mutex);
    ++counts.refused;
  }
  // Who asks wrongly asks again and again.
  if (logged.size() < kMostReasonsLogged && logged.insert(why).second)
    core::log(log, core::LogLevel::kWarning, "a web client was refused: " + why);
}

void WebServer::Impl::run() {
  while (!stop) turn();
  const std::lock_guard lock(mutex);
  connections.clear();
}

void WebServer::Impl::turn() {
  std::vector<pollfd> polled;
  std::vector<Number> numbers;
  const Clock::time_point now = Clock::now();
  polled.push_back({wake.number(), POLLIN, 0});
  const bool accepting = now >= accept_again;
  polled.push_back({accepting ? listening.descriptor.number() : -1, POLLIN, 0});
  {
    const std::lock_guard lock(mutex);
    for (auto& [number, connection] : connections) {
      // One that is closing is read too, and what comes is thrown away: else its end would not be seen.
      const short events = static_cast<short>(POLLIN | (connection.queue.empty() ? 0 : POLLOUT));
      polled.push_back({connection.socket.number(), events, 0});
      numbers.push_back(number);
    }
  }
  constexpr int kTick = 100;  // ms, in which times are looked at
  if (poll(polled.data(), polled.size(), kTick) < 0 && errno != EINTR) std::this_thread::sleep_for(kAcceptPause);
  if ((polled[0].revents & POLLIN) != 0) {
    std::uint64_t count = 0;
    static_cast<void>(!read(wake.number(), &count, sizeof count));
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) serve(numbers[i], polled[i + 2].revents);
  if ((polled[1].revents & POLLIN) != 0) accept_clients();
}

void WebServer::Impl::accept_clients() {
  constexpr int kMostAtOnce = 16;
  for (int i = 0; i < kMostAtOnce; ++i) {
    core::FileDescriptor socket(accept4(listening.descriptor.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.number() < 0) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS)
        accept_again = Clock::now() + kAcceptPause;
      return;
    }
    const int yes = 1;
    setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    setsockopt(socket.number(), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
    {
      const std::lock_guard lock(mutex);
      if (connections.size() < static_cast<std::size_t>(std::max(1, options.max_clients))) {
        Connection connection(std::move(socket), options);
        connections.emplace(next_number++, std::move(connection));
        continue;
      }
    }
    refuse("there are " + std::to_string(options.max_clients) + " connections already: close one");
    const std::string response = error_response(503, "too many clients: close another one, or try later").head;
    static_cast<void>(!::send(socket.number(), response.data(), response.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }
}

void WebServer::Impl::serve(Number number, short events) {
  // Entries are only erased here, on this thread: references stay good without the lock.
  Connection* connection = nullptr;
  {
    const std::lock_guard lock(mutex);
    const auto found = connections.find(number);
    if (found == connections.end()) return;
    connection = &found->second;
  }
  std::vector<WebSocketMessage> messages;
  bool opened = false;
  std::string protocol;
  if ((events & (POLLIN | POLLHUP | POLLERR)) != 0) read_from(*connection, messages, opened, protocol);
  if (opened) {
    {
      const std::lock_guard lock(mutex);
      connection->client = number;
      connection->was_announced = true;
      ++counts.clients;
      ++counts.opened;
    }
    if (handlers.on_open) handlers.on_open(number, protocol);
  }
  for (WebSocketMessage& message : messages)
    if (handlers.on_message) handlers.on_message(number, std::move(message));
  {
    const std::lock_guard lock(mutex);
    if (!connection->is_dropped) send_to(*connection);
    look_at_times(*connection, Clock::now());
    if (!connection->is_dropped) return;
    if (connection->was_announced) --counts.clients;
  }
  if (connection->was_announced && handlers.on_close) handlers.on_close(number);
  const std::lock_guard lock(mutex);
  connections.erase(number);
}

void WebServer::Impl::read_from(Connection& connection, std::vector<WebSocketMessage>& messages, bool& opened,
                                std::string& protocol) {
  std::array<char, kReadBytes> buffer;
  const ssize_t count = recv(connection.socket.number(), buffer.data(), buffer.size(), 0);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (count <= 0) {
    const std::lock_guard lock(mutex);
    connection.is_dropped = true;
    return;
  }
  connection.last_read = Clock::now();
  if (connection.is_closing) return;
  std::string_view bytes(buffer.data(), static_cast<std::size_t>(count));
  if (connection.client != 0) return take_frames(connection, bytes, messages);
  connection.head.append(bytes);
  take_request(connection, opened, protocol);
  if (!opened || connection.head.empty()) return;
  const std::string rest = std::exchange(connection.head, {});
  take_frames(connection, rest, messages);
}

void WebServer::Impl::take_request(Connection& connection, bool& opened, std::string& protocol) {
  auto head = read_http_head(connection.head, options.request);
  if (head && !*head) return;
  const WebResponse response =
      !head ? error_response(head.status().code() == core::StatusCode::kResourceExhausted ? 431 : 400,
                             head.status().message())
            : respond((*head)->request, options, loopback, listening.port, files);
  connection.head.erase(0, head ? (*head)->bytes : connection.head.size());
  if (!response.refusal.empty()) refuse(response.refusal);
  const std::lock_guard lock(mutex);
  if (response.refusal.empty()) ++counts.requests;
  enqueue(connection, raw_message(response.head));
  if (response.body != nullptr) enqueue(connection, raw_message(*response.body));
  opened = response.status == 101;
  protocol = response.subprotocol;
  if (opened) return;
  connection.is_closing = true;
  connection.close_by = Clock::now() + duration_of(options.request_seconds);
}

void WebServer::Impl::take_frames(Connection& connection, std::string_view bytes,
                                  std::vector<WebSocketMessage>& messages) {
  std::vector<WebSocketMessage> read;
  const core::Status status = connection.reader.take(bytes, read);
  for (WebSocketMessage& message : read) {
    switch (message.kind) {
      case WebSocketKind::kText:
      case WebSocketKind::kBinary:
        messages.push_back(std::move(message));
        break;
      case WebSocketKind::kPing: {
        const std::lock_guard lock(mutex);
        // Of many that wait one is answered: nobody fills the queue with pings.
        if (!connection.pong_waits)
          enqueue(connection, raw_message(websocket_frame(WebSocketKind::kPong, message.payload)));
        connection.pong_waits = true;
        break;
      }
      case WebSocketKind::kPong:
        break;
      case WebSocketKind::kClose:
        connection.has_said_goodbye = true;
        return close_with(connection, 1000, "");
    }
  }
  if (status.ok()) return;
  refuse(status.message());
  close_with(connection, connection.reader.close_code(), status.message());
}

void WebServer::Impl::close_with(Connection& connection, int code, const std::string& why) {
  const std::lock_guard lock(mutex);
  if (connection.is_closing) return;
  enqueue(connection, raw_message(websocket_frame(WebSocketKind::kClose, websocket_close_payload(code, why))));
  connection.is_closing = true;
  connection.close_by = Clock::now() + duration_of(kCloseSeconds);
}

void WebServer::Impl::send_to(Connection& connection) {
  while (!connection.queue.empty()) {
    const std::string_view bytes = connection.queue.front();
    const ssize_t count = ::send(connection.socket.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0) {
      if (errno != EAGAIN && errno != EINTR) connection.is_dropped = true;
      return;
    }
    connection.last_sent = Clock::now();
    connection.queue.sent(static_cast<std::size_t>(count));
  }
  connection.pong_waits = false;
  if (!connection.is_closing) return;
  connection.is_dropped = connection.has_said_goodbye;
  // Who still has something to say must not lose what was said to him: he closes, or the time ends.
  if (connection.client == 0 || connection.close_by != Clock::time_point::max())
    shutdown(connection.socket.number(), SHUT_WR);
}

void WebServer::Impl::look_at_times(Connection& connection, Clock::time_point now) {
  if (connection.is_dropped) return;
  if (connection.is_closing) {
    connection.is_dropped = now >= connection.close_by;
    return;
  }
  if (connection.client == 0) {
    if (now < connection.opened + duration_of(options.request_seconds)) return;
    enqueue(connection, raw_message(error_response(408, "no request came in time").head));
    ++counts.refused;
    connection.is_closing = true;
    connection.close_by = now + duration_of(kCloseSeconds);
    return;
  }
  const bool stalls = !connection.queue.empty() && now >= connection.last_sent + duration_of(options.stall_seconds);
  const bool silent = now >= connection.last_read + duration_of(3.0 * options.ping_seconds);
  if (stalls || silent) {
    connection.is_dropped = true;
    ++counts.dropped;
    return;
  }
  const auto interval = duration_of(options.ping_seconds);
  if (now < connection.last_read + interval || now < connection.last_ping + interval) return;
  connection.last_ping = now;
  enqueue(connection, raw_message(websocket_frame(WebSocketKind::kPing, "")));
}

}  // namespace prescene::interfaces
