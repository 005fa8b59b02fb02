// SPDX-License-Identifier: Apache-2.0
// What a service manager does with the socket that services notify (sd_notify(3)).
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace prescene::tests {

class ListeningManager {
 public:
  /// A path, or an abstract name with an '@' before it.
  explicit ListeningManager(const std::string& name) {
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name[0] == '@') address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), size), 0) << name;
  }
  ~ListeningManager() { close(socket_); }
  ListeningManager(const ListeningManager&) = delete;
  ListeningManager& operator=(const ListeningManager&) = delete;

  /// The messages that came since the last call.
  std::vector<std::string> heard() const {
    std::vector<std::string> messages;
    char text[4096];
    for (ssize_t size = 0; (size = recv(socket_, text, sizeof(text), MSG_DONTWAIT)) >= 0;)
      messages.emplace_back(text, static_cast<std::size_t>(size));
    return messages;
  }

 private:
  int socket_ = -1;
};

}  // namespace prescene::tests
