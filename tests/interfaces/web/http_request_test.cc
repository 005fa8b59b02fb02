// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/web/http_request.h"

#include <gtest/gtest.h>

namespace prescene::interfaces::http_request_test {
namespace {

using core::StatusCode;

StatusCode code_of(std::string_view bytes, const HttpLimits& limits = {}) {
  return read_http_head(bytes, limits).status().code();
}

TEST(HttpRequest, ReadsHeadQueryAndCookies) {
  const std::string text =
      "GET /view.js?token=ab%20c&x=1#part HTTP/1.1\r\nHost: localhost:8765\r\nCookie: a=1; prescene_token=ab\r\n"
      "Upgrade:  websocket \r\n\r\nwhat follows";
  const auto head = read_http_head(text);
  ASSERT_TRUE(head.ok() && *head) << head.status().message();
  const HttpRequest& request = (*head)->request;
  EXPECT_EQ(request.method, "GET");
  EXPECT_EQ(request.path, "/view.js");
  EXPECT_EQ(request.query_value("token"), "ab%20c");
  EXPECT_EQ(request.query_value("x"), "1");
  EXPECT_EQ(request.query_value("y"), std::nullopt);
  EXPECT_EQ(request.cookie("prescene_token"), "ab");
  ASSERT_NE(request.header("upgrade"), nullptr);
  EXPECT_EQ(*request.header("upgrade"), "websocket");
  EXPECT_EQ(text.substr((*head)->bytes), "what follows");
}

TEST(HttpRequest, WaitsForTheEndOfTheHead) {
  const std::string text = "GET / HTTP/1.1\r\nHost: x\r\n\r\n";
  for (std::size_t cut = 0; cut < text.size(); ++cut) {
    const auto head = read_http_head(std::string_view(text).substr(0, cut));
    ASSERT_TRUE(head.ok()) << cut;
    EXPECT_FALSE(*head) << cut;
  }
  EXPECT_TRUE(*read_http_head(text));
}

TEST(HttpRequest, RefusesWhatIsNoHttp) {
  for (const char* text : {"GET / HTTP/2.0\r\n\r\n", "GET /\r\n\r\n", "/ HTTP/1.1\r\n\r\n", "GET x HTTP/1.1\r\n\r\n",
                           "GET / HTTP/1.1\r\nHost : x\r\n\r\n", "GET / HTTP/1.1\r\n: x\r\n\r\n",
                           "GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", "GET / HTTP/1.1\r\nA: \x01\r\n\r\n",
                           "GET / HTTP/1.1\r\n folded\r\n\r\n", "G\x80T / HTTP/1.1\r\n\r\n", "\r\n\r\n"})
    EXPECT_EQ(code_of(text), StatusCode::kInvalidInput) << text;
}

TEST(HttpRequest, BoundsItsHead) {
  const std::string long_header = "GET / HTTP/1.1\r\nA: " + std::string(20'000, 'a') + "\r\n\r\n";
  EXPECT_EQ(code_of(long_header), StatusCode::kResourceExhausted);
  EXPECT_EQ(code_of(long_header, {.head_bytes = 30'000}), StatusCode::kOk);
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 101; ++i) many += "A: b\r\n";
  EXPECT_EQ(code_of(many + "\r\n"), StatusCode::kResourceExhausted);
}

TEST(HttpRequest, FindsWordsInLists) {
  EXPECT_TRUE(lists_word("keep-alive, Upgrade", "upgrade"));
  EXPECT_TRUE(lists_word("UPGRADE", "upgrade"));
  EXPECT_FALSE(lists_word("upgrades", "upgrade"));
  EXPECT_FALSE(lists_word("", "upgrade"));
}

}  // namespace
}  // namespace prescene::interfaces::http_request_test
