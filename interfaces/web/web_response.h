// SPDX-License-Identifier: Apache-2.0
// What the server answers to a request's head.
#pragma once

#include <string>
#include <vector>

#include "prescene/interfaces/web/web_server.h"

namespace prescene::interfaces {

struct WebResponse {
  int status = 200;
  std::string head;                   ///< Status line and headers with the empty line.
  const std::string* body = nullptr;  ///< Of a file that is to be sent; else `head` holds all.
  std::string subprotocol;            ///< Of a WebSocket: status is 101.
  std::string refusal;                ///< Why not, for the log; "" = served.
};

/// `files`, `options` as given to WebServer::create; the port is the one that is listened on.
WebResponse respond(const HttpRequest& request, const WebServerOptions& options, bool loopback, int port,
                    const std::vector<WebFile>& files);
/// An error without a request that could be read.
WebResponse error_response(int status, const std::string& why);

}  // namespace prescene::interfaces
