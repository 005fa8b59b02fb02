// SPDX-License-Identifier: Apache-2.0
#include "web_response.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "listening_socket.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

constexpr const char* kCookie = "prescene_token";

struct StatusText {
  int status;
  const char* text;
};
constexpr std::array<StatusText, 12> kStatusTexts{{{200, "OK"},
                                                   {101, "Switching Protocols"},
                                                   {400, "Bad Request"},
                                                   {401, "Unauthorized"},
                                                   {403, "Forbidden"},
                                                   {404, "Not Found"},
                                                   {405, "Method Not Allowed"},
                                                   {408, "Request Timeout"},
                                                   {421, "Misdirected Request"},
                                                   {426, "Upgrade Required"},
                                                   {431, "Request Header Fields Too Large"},
                                                   {503, "Service Unavailable"}}};

std::string status_line(int status) {
  const auto* found =
      std::find_if(kStatusTexts.begin(), kStatusTexts.end(), [&](const StatusText& s) { return s.status == status; });
  return "HTTP/1.1 " + std::to_string(status) + " " + (found == kStatusTexts.end() ? "" : found->text) + "\r\n";
}

/// Takes as long for a wrong token as for a right one.
bool is_same_secret(std::string_view given, std::string_view secret) {
  unsigned difference = given.size() == secret.size() ? 0U : 1U;
  for (std::size_t i = 0; i < given.size(); ++i)
    difference |= static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(secret[i % secret.size()]);
  return difference == 0;
}

bool has_token(const HttpRequest& request, const std::string& token) {
  if (token.empty()) return true;
  if (const auto given = request.query_value("token")) return is_same_secret(*given, token);
  if (const auto given = request.cookie(kCookie)) return is_same_secret(*given, token);
  constexpr std::string_view kBearer = "Bearer ";
  const std::string* header = request.header("authorization");
  return header != nullptr && header->starts_with(kBearer) &&
         is_same_secret(std::string_view(*header).substr(kBearer.size()), token);
}

/// The host of a Host header without its port.
std::string host_name(const std::string& host) {
  const std::size_t colon = host.rfind(':');
  std::string name =
      colon != std::string::npos && host.find(']', colon) == std::string::npos ? host.substr(0, colon) : host;
  if (name.size() > 2 && name.front() == '[' && name.back() == ']') name = name.substr(1, name.size() - 2);
  return name;
}

bool is_host(const std::string& host) {
  return !host.empty() && host.size() < 256 && std::all_of(host.begin(), host.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == ':' || c == '[' || c == ']' || c == '_';
  });
}

/// Nothing but what this server itself sends may be loaded or talked to; no page may frame ours.
std::string page_headers(const std::string& host) {
  return "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
         "connect-src 'self' ws://" +
         host +
         "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
         "Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n"
         "Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n"
         "Cache-Control: no-store\r\n";
}

bool is_websocket(const HttpRequest& request) {
  const std::string* upgrade = request.header("upgrade");
  return upgrade != nullptr && lists_word(*upgrade, "websocket");
}

/// The first subprotocol of the client's that the server speaks.
std::string chosen_subprotocol(const HttpRequest& request, const std::vector<std::string>& spoken) {
  std::string wanted;
  for (const auto& [name, value] : request.headers)
    if (name == "sec-websocket-protocol") wanted += (wanted.empty() ? "" : ",") + value;
  for (std::string_view rest = wanted; !rest.empty();) {
    const std::size_t comma = rest.find(',');
    std::string_view word = rest.substr(0, comma);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
    if (std::find(spoken.begin(), spoken.end(), word) != spoken.end()) return std::string(word);
  }
  return "";
}

WebResponse open_websocket(const HttpRequest& request, const WebServerOptions& options, const std::string& host) {
  const std::string* connection = request.header("connection");
  const std::string* key = request.header("sec-websocket-key");
  const std::string* version = request.header("sec-websocket-version");
  if (connection == nullptr || !lists_word(*connection, "upgrade") || key == nullptr || !is_websocket_key(*key))
    return error_response(400, "the WebSocket's handshake lacks 'Connection: Upgrade' or a key");
  if (version == nullptr || *version != "13") {
    WebResponse response = error_response(426, "only version 13 of the WebSocket protocol is spoken");
    response.head.insert(response.head.find("\r\n") + 2, "Sec-WebSocket-Version: 13\r\n");
    return response;
  }
  // A page of another site could otherwise read along in the user's own browser.
  if (const std::string* origin = request.header("origin")) {
    const auto& allowed = options.allowed_origins;
    if (*origin != "http://" + host && *origin != "https://" + host &&
        std::find(allowed.begin(), allowed.end(), *origin) == allowed.end())
      return error_response(403, "pages of the origin " + quote(*origin) +
                                     " may not read this: start the program with that origin among those allowed");
  }
  WebResponse response;
  response.status = 101;
  response.subprotocol = chosen_subprotocol(request, options.subprotocols);
  if (response.subprotocol.empty()) {
    std::string spoken;
    for (const std::string& name : options.subprotocols) spoken += (spoken.empty() ? "" : ", ") + name;
    return error_response(400, "none of the client's subprotocols is spoken here: " + spoken);
  }
  response.head = status_line(101) +
                  "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " + websocket_accept(*key) +
                  "\r\nSec-WebSocket-Protocol: " + response.subprotocol + "\r\n\r\n";
  return response;
}

}  // namespace

WebResponse error_response(int status, const std::string& why) {
  WebResponse response;
  response.status = status;
  response.refusal = why;
  // What the client sent may be among it: it is text, never a page.
  const std::string body = why + "\n";
  response.head = status_line(status) +
                  "Content-Type: text/plain; charset=utf-8\r\nContent-Length: " + std::to_string(body.size()) +
                  "\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n"
                  "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n";
  if (status == 401) response.head += "WWW-Authenticate: Bearer\r\n";
  if (status == 405) response.head += "Allow: GET, HEAD\r\n";
  response.head += "Connection: close\r\n\r\n" + body;
  return response;
}

WebResponse respond(const HttpRequest& request, const WebServerOptions& options, bool loopback, int port,
                    const std::vector<WebFile>& files) {
  if (request.method != "GET" && request.method != "HEAD") return error_response(405, "only GET and HEAD are answered");
  const std::string* named = request.header("host");
  if (named != nullptr && !is_host(*named)) return error_response(400, "the Host header names no host");
  const std::string host = named != nullptr ? *named : "localhost:" + std::to_string(port);
  // A name of somebody's domain that was made to point at this machine: its page would count as ours.
  const std::string name = host_name(host);
  if (loopback && name != "localhost" && !is_loopback(name))
    return error_response(421, "this server is for this machine only: open it as localhost");
  if (!has_token(request, options.token))
    return error_response(401, "a token is needed: open the address that the program printed, with ?token=...");
  if (request.path == "/" && is_websocket(request)) return open_websocket(request, options, host);
  const auto file =
      std::find_if(files.begin(), files.end(), [&](const WebFile& of) { return of.path == request.path; });
  if (file == files.end()) return error_response(404, "there is no such page here");
  WebResponse response;
  response.head = status_line(200) + "Content-Type: " + file->media_type +
                  "\r\nContent-Length: " + std::to_string(file->body.size()) + "\r\n" + page_headers(host);
  if (!options.token.empty() && request.path == "/")
    response.head +=
        std::string("Set-Cookie: ") + kCookie + "=" + options.token + "; HttpOnly; SameSite=Strict; Path=/\r\n";
  response.head += "Connection: close\r\n\r\n";
  if (request.method == "GET") response.body = &file->body;
  return response;
}

}  // namespace prescene::interfaces
