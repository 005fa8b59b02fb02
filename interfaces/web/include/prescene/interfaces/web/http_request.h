// SPDX-License-Identifier: Apache-2.0
// The head of an HTTP/1.1 request [RFC 9112], as a browser sends it, from bytes that anybody may have sent.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

struct HttpRequest {
  std::string method;  ///< "GET"
  std::string path;    ///< "/view.js", as sent: without the query, not decoded.
  std::string query;   ///< "token=0123&x=1"; empty where there is none.
  /// Names in lower case, in the order in which they came; values without blanks around them.
  std::vector<std::pair<std::string, std::string>> headers;

  /// The value of the first header with this name (in lower case), or null.
  const std::string* header(std::string_view name) const;
  /// The value of a key of the query, or of a cookie; percent signs are not decoded.
  std::optional<std::string> query_value(std::string_view key) const;
  std::optional<std::string> cookie(std::string_view name) const;
};

struct HttpLimits {
  std::size_t head_bytes = std::size_t{16} << 10;  ///< Of request line and headers together.
  std::size_t headers = 100;
};

struct HttpHead {
  HttpRequest request;
  std::size_t bytes = 0;  ///< That it takes; what follows is the body.
};

/// The head at the start of `bytes`; empty while its end, an empty line, has not come. kInvalidInput for what is not
/// HTTP/1.1: a malformed line, a control character, a repeated Host. kResourceExhausted above a limit.
core::Result<std::optional<HttpHead>> read_http_head(std::string_view bytes, const HttpLimits& limits = {});

/// Whether one of the values of a header like "keep-alive, Upgrade" is `word` (in lower case), whatever its case.
bool lists_word(std::string_view header, std::string_view word);

}  // namespace prescene::interfaces
