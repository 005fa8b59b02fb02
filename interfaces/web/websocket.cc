// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/web/websocket.h"

#include <algorithm>
#include <array>
#include <bit>

#include "prescene/core/text.h"
#include "prescene/core/utf8.h"

namespace prescene::interfaces {
namespace {

constexpr std::size_t kMostControlBytes = 125;
constexpr int kProtocolError = 1002, kNotUtf8 = 1007, kTooBig = 1009;

/// SHA-1 [FIPS 180-4]. The handshake demands it; nothing relies on its strength.
std::array<std::uint8_t, 20> sha1(std::string_view text) {
  std::array<std::uint32_t, 5> h{0x67452301U, 0xefcdab89U, 0x98badcfeU, 0x10325476U, 0xc3d2e1f0U};
  std::string padded(text);
  padded += '\x80';
  while (padded.size() % 64 != 56) padded += '\0';
  const std::uint64_t bits = std::uint64_t{text.size()} * 8U;
  for (int shift = 56; shift >= 0; shift -= 8) padded += static_cast<char>((bits >> shift) & 0xffU);
  for (std::size_t block = 0; block < padded.size(); block += 64) {
    std::array<std::uint32_t, 80> w{};
    for (std::size_t i = 0; i < 64; ++i) w[i / 4] = (w[i / 4] << 8U) | static_cast<std::uint8_t>(padded[block + i]);
    for (std::size_t i = 16; i < 80; ++i) w[i] = std::rotl(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
    auto [a, b, c, d, e] = h;
    for (std::size_t i = 0; i < 80; ++i) {
      std::uint32_t f = 0, k = 0;
      if (i < 20) {
        f = (b & c) | (~b & d);
        k = 0x5a827999U;
      } else if (i < 40) {
        f = b ^ c ^ d;
        k = 0x6ed9eba1U;
      } else if (i < 60) {
        f = (b & c) | (b & d) | (c & d);
        k = 0x8f1bbcdcU;
      } else {
        f = b ^ c ^ d;
        k = 0xca62c1d6U;
      }
      const std::uint32_t next = std::rotl(a, 5) + f + e + k + w[i];
      e = d;
      d = c;
      c = std::rotl(b, 30);
      b = a;
      a = next;
    }
    h[0] += a;
    h[1] += b;
    h[2] += c;
    h[3] += d;
    h[4] += e;
  }
  std::array<std::uint8_t, 20> digest{};
  for (std::size_t i = 0; i < digest.size(); ++i)
    digest[i] = static_cast<std::uint8_t>(h[i / 4] >> (24U - 8U * (i % 4)));
  return digest;
}

bool is_control(std::uint8_t opcode) { return (opcode & 8U) != 0; }

/// Bytes of a frame's header, by its second byte.
std::size_t header_bytes(std::uint8_t second) {
  const std::uint8_t length = second & 0x7fU;
  return 2U + (length == 126 ? 2U : length == 127 ? 8U : 0U) + ((second & 0x80U) != 0 ? 4U : 0U);
}

}  // namespace

std::string websocket_frame_header(WebSocketKind kind, std::size_t payload_bytes) {
  std::string header(1, static_cast<char>(0x80U | static_cast<std::uint8_t>(kind)));
  const auto add_bytes = [&](int count) {
    for (int shift = 8 * (count - 1); shift >= 0; shift -= 8)
      header += static_cast<char>((static_cast<std::uint64_t>(payload_bytes) >> shift) & 0xffU);
  };
  if (payload_bytes < 126) {
    add_bytes(1);
  } else if (payload_bytes < 65536) {
    header += '\x7e';
    add_bytes(2);
  } else {
    header += '\x7f';
    add_bytes(8);
  }
  return header;
}

std::string websocket_frame(WebSocketKind kind, std::string_view payload) {
  std::string frame = websocket_frame_header(kind, payload.size());
  frame.append(payload);
  return frame;
}

std::string websocket_close_payload(int code, std::string_view reason) {
  std::string payload;
  payload += static_cast<char>((static_cast<unsigned>(code) >> 8U) & 0xffU);
  payload += static_cast<char>(static_cast<unsigned>(code) & 0xffU);
  payload.append(reason.substr(0, kMostControlBytes - 2));
  return payload;
}

std::string websocket_accept(std::string_view key) {
  return core::base64(sha1(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"));
}

bool is_websocket_key(std::string_view key) {
  const auto is_digit = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
  };
  return key.size() == 24 && key.substr(22) == "==" && std::all_of(key.begin(), key.begin() + 22, is_digit);
}

core::Status WebSocketReader::fail(int code, core::Status status) {
  close_code_ = code;
  failure_ = std::move(status);
  header_.clear();
  control_.clear();
  message_ = std::string();
  return failure_;
}

core::Status WebSocketReader::take(std::string_view bytes, std::vector<WebSocketMessage>& messages) {
  if (!failure_.ok()) return failure_;
  while (!bytes.empty() || (in_payload_ && read_ == length_)) {
    if (!in_payload_) {
      const std::size_t wanted = header_.size() < 2 ? 2 : header_bytes(static_cast<std::uint8_t>(header_[1]));
      const std::size_t taken = std::min(bytes.size(), wanted - header_.size());
      header_.append(bytes.substr(0, taken));
      bytes.remove_prefix(taken);
      if (header_.size() < 2 || header_.size() < header_bytes(static_cast<std::uint8_t>(header_[1]))) continue;
      PRESCENE_RETURN_IF_ERROR(take_header());
      continue;
    }
    std::string& to = is_control(opcode_) ? control_ : message_;
    const auto taken = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), length_ - read_));
    for (std::size_t i = 0; i < taken; ++i)
      to += static_cast<char>(static_cast<std::uint8_t>(bytes[i]) ^ mask_[(read_ + i) % 4]);
    bytes.remove_prefix(taken);
    read_ += taken;
    if (read_ == length_) PRESCENE_RETURN_IF_ERROR(finish_frame(messages));
  }
  return core::ok_status();
}

core::Status WebSocketReader::take_header() {
  const auto byte = [this](std::size_t i) { return static_cast<std::uint8_t>(header_[i]); };
  const auto protocol_error = [this](const char* what) { return fail(kProtocolError, core::invalid_input(what)); };
  is_final_ = (byte(0) & 0x80U) != 0;
  opcode_ = byte(0) & 0x0fU;
  if ((byte(0) & 0x70U) != 0) return protocol_error("a frame has reserved bits set");
  if ((byte(1) & 0x80U) == 0) return protocol_error("a client's frame is not masked");
  const std::uint8_t short_length = byte(1) & 0x7fU;
  const std::size_t length_bytes = short_length == 126 ? 2 : short_length == 127 ? 8 : 0;
  length_ = length_bytes == 0 ? short_length : 0;
  for (std::size_t i = 0; i < length_bytes; ++i) length_ = (length_ << 8U) | byte(2 + i);
  if ((length_bytes == 2 && length_ < 126) || (length_bytes == 8 && length_ < 65536))
    return protocol_error("a frame's length is not in its shortest form");
  for (std::size_t i = 0; i < 4; ++i) mask_[i] = byte(2 + length_bytes + i);
  header_.clear();
  read_ = 0;
  in_payload_ = true;
  if (is_control(opcode_)) {
    if (opcode_ > 10) return protocol_error("a control frame of an unknown kind");
    if (!is_final_ || length_ > kMostControlBytes) return protocol_error("a control frame is fragmented or too long");
    control_.clear();
    return core::ok_status();
  }
  if (opcode_ > 2) return protocol_error("a frame of an unknown kind");
  if ((opcode_ == 0) != in_message_) return protocol_error("fragments of two messages are mixed");
  if (opcode_ != 0) kind_ = static_cast<WebSocketKind>(opcode_);
  in_message_ = true;
  if (length_ > max_message_bytes_ - std::min(max_message_bytes_, message_.size()))
    return fail(kTooBig,
                core::resource_exhausted("a message is longer than " + std::to_string(max_message_bytes_) + " bytes"));
  return core::ok_status();
}

core::Status WebSocketReader::finish_frame(std::vector<WebSocketMessage>& messages) {
  in_payload_ = false;
  if (is_control(opcode_)) {
    if (opcode_ == 8 && control_.size() == 1)
      return fail(kProtocolError, core::invalid_input("a close holds half a code"));
    messages.push_back({static_cast<WebSocketKind>(opcode_), std::move(control_)});
    control_ = std::string();
    return core::ok_status();
  }
  if (!is_final_) return core::ok_status();
  in_message_ = false;
  if (kind_ == WebSocketKind::kText && core::not_utf8_at(message_))
    return fail(kNotUtf8, core::invalid_input("a text is not UTF-8"));
  messages.push_back({kind_, std::move(message_)});
  message_ = std::string();
  return core::ok_status();
}

}  // namespace prescene::interfaces
