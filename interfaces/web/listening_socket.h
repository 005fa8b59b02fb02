// SPDX-License-Identifier: Apache-2.0
// The socket that the server listens on.
#pragma once

#include <string>

#include "prescene/core/file_descriptor.h"
#include "prescene/core/status.h"

namespace prescene::interfaces {

struct ListeningSocket {
  core::FileDescriptor descriptor;  ///< Does not block.
  int port = 0;
  std::string host;  ///< As in a URL: IPv6 addresses in brackets.
};
core::Result<ListeningSocket> listen_on(const std::string& address, int port);

}  // namespace prescene::interfaces
