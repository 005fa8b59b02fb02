// SPDX-License-Identifier: Apache-2.0
// File descriptors of the server.
#pragma once

#include <string>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// Closes its descriptor at its end.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int number() const { return number_; }

 private:
  int number_ = -1;
};

struct ListeningSocket {
  Descriptor descriptor;  ///< Does not block.
  int port = 0;
  std::string host;  ///< As in a URL: IPv6 addresses in brackets.
};
core::Result<ListeningSocket> listen_on(const std::string& address, int port);

}  // namespace prescene::interfaces
