// SPDX-License-Identifier: Apache-2.0
// Any bytes as what a web client sends: a request's head, then WebSocket frames. They are read or refused, with the
// same result in one piece as in two.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/web/http_request.h"
#include "prescene/interfaces/web/websocket.h"

namespace {

using namespace prescene;              // NOLINT(google-build-using-namespace)
using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

constexpr std::size_t kMostBytes = 1000;

void check_frames(std::string_view bytes, std::size_t cut) {
  std::vector<WebSocketMessage> whole, pieces;
  WebSocketReader reader(kMostBytes), other(kMostBytes);
  const core::Status read = reader.take(bytes, whole);
  cut = std::min(cut, bytes.size());
  core::Status in_pieces = other.take(bytes.substr(0, cut), pieces);
  if (in_pieces.ok()) in_pieces = other.take(bytes.substr(cut), pieces);
  PRESCENE_CHECK(read == in_pieces && whole == pieces);
  PRESCENE_CHECK(read.ok() == (reader.close_code() == 1000));
  PRESCENE_CHECK(read.ok() || !read.message().empty());
  for (const WebSocketMessage& message : whole) {
    PRESCENE_CHECK(message.payload.size() <= kMostBytes);
    PRESCENE_CHECK(message.kind != WebSocketKind::kText || core::is_utf8(message.payload));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto head = read_http_head(bytes, {.head_bytes = kMostBytes, .headers = 20});
  std::string_view frames = bytes;
  if (head && *head) {
    const HttpRequest& request = (*head)->request;
    PRESCENE_CHECK((*head)->bytes <= bytes.size() && request.path.starts_with('/'));
    PRESCENE_CHECK(request.headers.size() <= 20U);
    static_cast<void>(request.query_value("token"));
    static_cast<void>(request.cookie("prescene_token"));
    if (const auto* list = request.header("upgrade")) static_cast<void>(lists_word(*list, "websocket"));
    frames = bytes.substr((*head)->bytes);
  } else {
    PRESCENE_CHECK(head.ok() || !head.status().message().empty());
  }
  check_frames(frames, data[0]);
  return 0;
}
