// SPDX-License-Identifier: Apache-2.0
// WebSocket frames [RFC 6455], at a server's end: what a client sends is read whole or refused, what it is sent is
// framed. No extension is spoken.
//
//   WebSocketReader reader(1 << 20);
//   std::vector<WebSocketMessage> messages;
//   if (core::Status read = reader.take(bytes, messages); !read.ok()) ... reader.close_code()
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// Opcodes as on the wire.
enum class WebSocketKind : std::uint8_t { kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10 };

struct WebSocketMessage {
  WebSocketKind kind = WebSocketKind::kText;
  std::string payload;  ///< UTF-8 of a text; of a close two bytes of code, then its reason, or nothing.
  friend bool operator==(const WebSocketMessage&, const WebSocketMessage&) = default;
};

/// The header of an unfragmented, unmasked frame whose payload has so many bytes.
std::string websocket_frame_header(WebSocketKind kind, std::size_t payload_bytes);
std::string websocket_frame(WebSocketKind kind, std::string_view payload);
/// Payload of a close: the code, most significant byte first, and a reason that is cut to what a control frame holds.
std::string websocket_close_payload(int code, std::string_view reason);

/// Value of Sec-WebSocket-Accept for a client's Sec-WebSocket-Key.
std::string websocket_accept(std::string_view key);
/// Whether the key is the Base64 of 16 bytes, as the handshake demands.
bool is_websocket_key(std::string_view key);

/// Reads what a client sends, in pieces of any size. Keeps at most one message of `max_message_bytes` and a frame
/// header, whatever lengths the frames claim.
class WebSocketReader {
 public:
  explicit WebSocketReader(std::size_t max_message_bytes) : max_message_bytes_(max_message_bytes) {}

  /// Appends the messages that are complete. Fails with kInvalidInput for what the protocol forbids (an unmasked frame,
  /// reserved bits, a fragmented or long control frame, a continuation of nothing, a length that is not in its
  /// shortest form, text that is not UTF-8) and kResourceExhausted for a message that is too long. Once it has failed
  /// it takes nothing more.
  core::Status take(std::string_view bytes, std::vector<WebSocketMessage>& messages);
  /// What to close the connection with after a failure: 1002, 1007 or 1009; 1000 before one.
  int close_code() const { return close_code_; }

 private:
  core::Status take_header();
  core::Status finish_frame(std::vector<WebSocketMessage>& messages);
  core::Status fail(int code, core::Status status);

  std::size_t max_message_bytes_;
  int close_code_ = 1000;
  core::Status failure_;
  std::string header_;  // of the frame that is being read, until it is complete
  // Of the frame whose payload is being read.
  bool in_payload_ = false;
  bool is_final_ = false;
  std::uint8_t opcode_ = 0;
  std::uint64_t length_ = 0;
  std::uint64_t read_ = 0;
  std::uint8_t mask_[4] = {};
  std::string control_;  // payload of a control frame, which may come between the fragments of a message
  // Of the message that is being put together.
  bool in_message_ = false;
  WebSocketKind kind_ = WebSocketKind::kText;
  std::string message_;
};

}  // namespace prescene::interfaces
