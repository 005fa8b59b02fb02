// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/web take for granted.
#pragma once

#include <string>
#include <string_view>

#include "prescene/core/log.h"
#include "prescene/interfaces/web/web_server.h"

namespace prescene::interfaces::given_interfaces_web {

extern const core::LogSink log;
extern const std::vector<WebFile> files;
extern const WebHandlers handlers;
extern const std::string text;
extern const std::string_view bytes;

}  // namespace prescene::interfaces::given_interfaces_web
