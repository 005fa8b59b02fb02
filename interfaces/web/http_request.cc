// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/web/http_request.h"

#include <algorithm>

namespace prescene::interfaces {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string lower_text(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), lower);
  return result;
}

/// A character of a token, of which methods and the names of headers are made [RFC 9110, section 5.6.2].
bool is_token(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
}

bool is_token(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return is_token(c); });
}

/// Printable ASCII without blanks.
bool is_visible(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7f'; });
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// The piece before `separator`, which `rest` then no longer has.
std::string_view take_until(std::string_view& rest, char separator) {
  const std::size_t at = rest.find(separator);
  const std::string_view piece = rest.substr(0, at);
  rest = at == std::string_view::npos ? std::string_view() : rest.substr(at + 1);
  return piece;
}

std::optional<std::string> value_of(std::string_view list, char separator, std::string_view key) {
  while (!list.empty()) {
    std::string_view value = trimmed(take_until(list, separator));
    const std::string_view name = take_until(value, '=');
    if (name == key) return std::string(value);
  }
  return std::nullopt;
}

core::Status read_request_line(std::string_view line, HttpRequest& request) {
  core::Status bad = core::invalid_input("the request line is not 'METHOD /PATH HTTP/1.1'");
  const std::string_view method = take_until(line, ' ');
  std::string_view target = take_until(line, ' ');
  if (!is_token(method) || !is_visible(target) || target.front() != '/') return bad;
  if (line != "HTTP/1.1" && line != "HTTP/1.0") return bad;
  request.method = std::string(method);
  request.path = std::string(take_until(target, '?'));
  request.query = std::string(take_until(target, '#'));
  return core::ok_status();
}

core::Status read_header(std::string_view line, HttpRequest& request) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
    return core::invalid_input("a header is not 'NAME: VALUE'");
  const std::string_view value = trimmed(line.substr(colon + 1));
  const auto is_control = [](char c) { return (static_cast<unsigned char>(c) < 0x20U && c != '\t') || c == '\x7f'; };
  if (std::any_of(value.begin(), value.end(), is_control))
    return core::invalid_input("a header holds a control character");
  std::string name = lower_text(line.substr(0, colon));
  if (name == "host" && request.header(name) != nullptr) return core::invalid_input("there are two Host headers");
  request.headers.emplace_back(std::move(name), value);
  return core::ok_status();
}

}  // namespace

const std::string* HttpRequest::header(std::string_view name) const {
  const auto found = std::find_if(headers.begin(), headers.end(), [&](const auto& h) { return h.first == name; });
  return found == headers.end() ? nullptr : &found->second;
}

std::optional<std::string> HttpRequest::query_value(std::string_view key) const { return value_of(query, '&', key); }

std::optional<std::string> HttpRequest::cookie(std::string_view name) const {
  const std::string* cookies = header("cookie");
  return cookies == nullptr ? std::nullopt : value_of(*cookies, ';', name);
}

bool lists_word(std::string_view header, std::string_view word) {
  while (!header.empty())
    if (lower_text(trimmed(take_until(header, ','))) == word) return true;
  return false;
}

core::Result<std::optional<HttpHead>> read_http_head(std::string_view bytes, const HttpLimits& limits) {
  const std::size_t end = bytes.substr(0, limits.head_bytes).find("\r\n\r\n");
  if (end == std::string_view::npos) {
    if (bytes.size() < limits.head_bytes) return std::optional<HttpHead>();
    return core::resource_exhausted("the head of the request is longer than " + std::to_string(limits.head_bytes) +
                                    " bytes");
  }
  HttpHead head;
  head.bytes = end + 4;
  std::string_view rest = bytes.substr(0, end + 2);
  bool is_first = true;
  while (!rest.empty()) {
    const std::size_t line_end = rest.find("\r\n");
    const std::string_view line = rest.substr(0, line_end);
    rest = rest.substr(line_end + 2);
    if (is_first) {
      PRESCENE_RETURN_IF_ERROR(read_request_line(line, head.request));
    } else if (head.request.headers.size() >= limits.headers) {
      return core::resource_exhausted("the request has more than " + std::to_string(limits.headers) + " headers");
    } else {
      PRESCENE_RETURN_IF_ERROR(read_header(line, head.request));
    }
    is_first = false;
  }
  return std::optional<HttpHead>(std::move(head));
}

}  // namespace prescene::interfaces
