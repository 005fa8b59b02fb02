// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>

#include "prescene/interfaces/web/websocket.h"
#include "tests/interfaces/web/web_client.h"

namespace prescene::interfaces::websocket_laws_test {
namespace {

using core::StatusCode;

// The examples of RFC 6455, sections 1.3 and 5.7.
TEST(WebSocket, KnowsTheExamplesOfTheStandard) {
  EXPECT_EQ(websocket_accept("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  EXPECT_TRUE(is_websocket_key("dGhlIHNhbXBsZSBub25jZQ=="));
  EXPECT_FALSE(is_websocket_key("dGhlIHNhbXBsZSBub25jZQ="));
  EXPECT_EQ(websocket_frame(WebSocketKind::kText, "Hello"), "\x81\x05Hello");
  EXPECT_EQ(websocket_frame_header(WebSocketKind::kBinary, 256), std::string("\x82\x7e\x01\x00", 4));
  EXPECT_EQ(websocket_frame_header(WebSocketKind::kBinary, 65536),
            std::string("\x82\x7f\x00\x00\x00\x00\x00\x01\x00\x00", 10));
  WebSocketReader reader(100);
  std::vector<WebSocketMessage> messages;
  ASSERT_TRUE(reader.take("\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58", messages).ok());
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0], (WebSocketMessage{WebSocketKind::kText, "Hello"}));
}

RC_GTEST_PROP(WebSocketLaws, MessagesArriveWhateverTheirPieces, ()) {
  // Messages in fragments with pings between them, cut into pieces anywhere.
  const auto payloads = *rc::gen::container<std::vector<std::string>>(
      rc::gen::container<std::string>(*rc::gen::inRange(0, 300), rc::gen::inRange<char>('a', 'z')));
  std::string bytes;
  std::vector<WebSocketMessage> expected;
  for (const std::string& payload : payloads) {
    const auto cut = *rc::gen::inRange<std::size_t>(0, payload.size() + 1);
    bytes += client_frame(2, payload.substr(0, cut), false) + client_frame(9, "p") +
             client_frame(0, payload.substr(cut), true);
    expected.push_back({WebSocketKind::kPing, "p"});
    expected.push_back({WebSocketKind::kBinary, payload});
  }
  WebSocketReader reader(1000);
  std::vector<WebSocketMessage> messages;
  for (std::size_t at = 0; at < bytes.size();) {
    const auto piece = *rc::gen::inRange<std::size_t>(1, 50);
    RC_ASSERT(reader.take(std::string_view(bytes).substr(at, piece), messages).ok());
    at += piece;
  }
  RC_ASSERT(messages == expected);
}

RC_GTEST_PROP(WebSocketLaws, AnyBytesAreReadOrRefused, (const std::vector<std::uint8_t>& bytes)) {
  WebSocketReader reader(64);
  std::vector<WebSocketMessage> messages;
  const core::Status read = reader.take({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, messages);
  RC_ASSERT(read.ok() == (reader.close_code() == 1000));
  for (const WebSocketMessage& message : messages) RC_ASSERT(message.payload.size() <= 125U);
  if (!read.ok()) RC_ASSERT(reader.take(client_frame(1, "x"), messages) == read);
}

TEST(WebSocket, RefusesWhatTheProtocolForbids) {
  const std::map<std::string, int> refused = {
      {"\x81\x05Hello", 1002},                                               // not masked
      {client_frame(1, "a").replace(0, 1, "\xc1"), 1002},                    // a reserved bit
      {client_frame(3, "a"), 1002},                                          // unknown kinds
      {client_frame(11, ""), 1002},                                          //
      {client_frame(0, "a"), 1002},                                          // continues nothing
      {client_frame(1, "a", false) + client_frame(1, "b"), 1002},            // a message within another
      {client_frame(9, "a", false), 1002},                                   // a ping in fragments
      {client_frame(9, std::string(126, 'a')), 1002},                        // too long for a ping
      {client_frame(8, "a"), 1002},                                          // half a code
      {std::string("\x82\xfe\x00\x05\x00\x00\x00\x00", 8) + "abcde", 1002},  // a length not in its shortest form
      {client_frame(1, "\xff"), 1007},                                       // no text
      {client_frame(2, std::string(101, 'a')), 1009},                        // too long
      {client_frame(2, "", true, std::uint64_t{1} << 62), 1009},             // or so it says
      {client_frame(2, std::string(60, 'a'), false) + client_frame(0, std::string(60, 'a')), 1009}};
  for (const auto& [bytes, code] : refused) {
    WebSocketReader reader(100);
    std::vector<WebSocketMessage> messages;
    EXPECT_FALSE(reader.take(bytes, messages).ok()) << bytes;
    EXPECT_EQ(reader.close_code(), code) << bytes;
  }
}

}  // namespace
}  // namespace prescene::interfaces::websocket_laws_test
