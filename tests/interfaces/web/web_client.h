// SPDX-License-Identifier: Apache-2.0
// A client of the web server that knows nothing of its code: sockets, and frames as RFC 6455 draws them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace prescene::interfaces {

class WebClientSocket {
 public:
  /// Connects to a port of this machine; a test fails where it can't. A small receive buffer (bytes) makes the server
  /// feel soon that nothing is read.
  explicit WebClientSocket(int port, int receive_buffer = 0);
  ~WebClientSocket();
  WebClientSocket(const WebClientSocket&) = delete;
  WebClientSocket& operator=(const WebClientSocket&) = delete;

  /// False where the connection is closed.
  bool send(std::string_view bytes);
  /// So many bytes; fewer where the connection ends first. Waits at most a minute.
  std::string read(std::size_t bytes);
  /// Up to the end of the connection.
  std::string read_all();
  /// Up to and with the empty line behind headers.
  std::string read_head();

  struct Frame {
    int opcode = 0;
    bool is_final = false;
    std::string payload;
  };
  /// Empty at the connection's end.
  std::optional<Frame> read_frame();
  /// The next text or binary message; pings are answered.
  std::optional<Frame> read_message();
  /// Of a close: its code; 0 where the connection just ends. Other frames before it are passed over.
  int read_close();

 private:
  int socket_ = -1;
};

/// "GET /path HTTP/1.1" with a Host and these headers, each "Name: value".
std::string get_request(const std::string& path, const std::vector<std::string>& headers = {});
/// A handshake with the key of RFC 6455's own example.
std::string handshake(const std::string& subprotocol, const std::vector<std::string>& headers = {},
                      const std::string& path = "/");
/// A masked frame; `length` may lie about the payload's.
std::string client_frame(int opcode, std::string_view payload, bool is_final = true,
                         std::optional<std::uint64_t> length = {});

}  // namespace prescene::interfaces
