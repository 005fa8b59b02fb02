// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/web/web_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace prescene::interfaces {

WebClientSocket::WebClientSocket(int port, int receive_buffer) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
  if (receive_buffer > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  const timeval patience{60, 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool connected = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  EXPECT_TRUE(connected);
}

WebClientSocket::~WebClientSocket() { close(socket_); }

bool WebClientSocket::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

std::string WebClientSocket::read(std::size_t bytes) {
  std::string text(bytes, '\0');
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t count = recv(socket_, text.data() + done, bytes - done, 0);
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  text.resize(done);
  return text;
}

std::string WebClientSocket::read_all() {
  std::string text;
  for (std::string piece = read(1); !piece.empty(); piece = read(1)) text += piece;
  return text;
}

std::string WebClientSocket::read_head() {
  std::string text;
  while (!text.ends_with("\r\n\r\n")) {
    const std::string piece = read(1);
    if (piece.empty()) break;
    text += piece;
  }
  return text;
}

std::optional<WebClientSocket::Frame> WebClientSocket::read_frame() {
  const std::string begin = read(2);
  if (begin.size() < 2) return std::nullopt;
  const auto first = static_cast<std::uint8_t>(begin[0]), second = static_cast<std::uint8_t>(begin[1]);
  EXPECT_EQ(second & 0x80, 0) << "a server masks nothing";
  EXPECT_EQ(first & 0x70, 0);
  std::uint64_t length = second & 0x7f;
  if (length >= 126) {
    const std::string more = read(length == 126 ? 2 : 8);
    length = 0;
    for (const char byte : more) length = length << 8 | static_cast<std::uint8_t>(byte);
  }
  Frame frame{first & 0x0f, (first & 0x80) != 0, read(length)};
  if (frame.payload.size() < length) return std::nullopt;
  return frame;
}

std::optional<WebClientSocket::Frame> WebClientSocket::read_message() {
  for (auto frame = read_frame(); frame; frame = read_frame()) {
    if (frame->opcode == 9 && !send(client_frame(10, frame->payload))) return std::nullopt;
    if (frame->opcode == 1 || frame->opcode == 2) return frame;
  }
  return std::nullopt;
}

int WebClientSocket::read_close() {
  for (auto frame = read_frame(); frame; frame = read_frame()) {
    if (frame->opcode != 8 || frame->payload.size() < 2) continue;
    return static_cast<std::uint8_t>(frame->payload[0]) << 8 | static_cast<std::uint8_t>(frame->payload[1]);
  }
  return 0;
}

std::string get_request(const std::string& path, const std::vector<std::string>& headers) {
  std::string text = "GET " + path + " HTTP/1.1\r\n";
  for (const std::string& header : headers) text += header + "\r\n";
  const bool has_host = text.find("\r\nHost:") != std::string::npos;
  return text + (has_host ? "" : "Host: localhost\r\n") + "\r\n";
}

std::string handshake(const std::string& subprotocol, const std::vector<std::string>& headers,
                      const std::string& path) {
  std::vector<std::string> all = {"Upgrade: websocket", "Connection: keep-alive, Upgrade", "Sec-WebSocket-Version: 13",
                                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="};
  if (!subprotocol.empty()) all.push_back("Sec-WebSocket-Protocol: " + subprotocol);
  all.insert(all.end(), headers.begin(), headers.end());
  return get_request(path, all);
}

std::string client_frame(int opcode, std::string_view payload, bool is_final, std::optional<std::uint64_t> length) {
  const std::uint64_t claimed = length.value_or(payload.size());
  std::string frame(1, static_cast<char>((is_final ? 0x80 : 0) | opcode));
  const int bytes = claimed < 126 ? 0 : claimed < 65536 ? 2 : 8;
  frame += static_cast<char>(0x80 | (bytes == 0 ? static_cast<int>(claimed) : bytes == 2 ? 126 : 127));
  for (int i = bytes - 1; i >= 0; --i) frame += static_cast<char>(claimed >> (8 * i) & 0xff);
  constexpr std::string_view kMask = "\x11\x22\x33\x44";
  frame += kMask;
  for (std::size_t i = 0; i < payload.size(); ++i) frame += static_cast<char>(payload[i] ^ kMask[i % 4]);
  return frame;
}

}  // namespace prescene::interfaces
