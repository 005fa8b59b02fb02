// SPDX-License-Identifier: Apache-2.0
#include "listening_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "prescene/interfaces/web/web_server.h"

namespace prescene::interfaces {
namespace {

struct NumericAddress {
  sockaddr_storage bytes{};
  socklen_t size = 0;
  bool is_loopback = false;
  std::string host;
};

/// What others call this machine: all addresses of it have no name of their own.
std::string this_host() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

std::optional<NumericAddress> numeric_address(const std::string& text, int port) {
  const std::string numbers = text == "localhost" ? "127.0.0.1" : text;
  NumericAddress address;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET, numbers.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(static_cast<std::uint16_t>(port));
    std::memcpy(&address.bytes, &v4, sizeof v4);
    address.size = sizeof v4;
    address.is_loopback = (ntohl(v4.sin_addr.s_addr) >> 24U) == 127;
    address.host = v4.sin_addr.s_addr == htonl(INADDR_ANY) ? this_host() : numbers;
    return address;
  }
  if (inet_pton(AF_INET6, numbers.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(static_cast<std::uint16_t>(port));
    std::memcpy(&address.bytes, &v6, sizeof v6);
    address.size = sizeof v6;
    address.is_loopback = IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr) != 0;
    address.host = IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr) != 0 ? this_host() : "[" + numbers + "]";
    return address;
  }
  return std::nullopt;
}

core::Status not_listening(const std::string& address, int port) {
  const std::string at = "port " + std::to_string(port) + " of " + address;
  switch (errno) {
    case EADDRINUSE:
      return core::unavailable(at + " is in use: give another port, or 0 for any that is free");
    case EACCES:
      return core::unavailable(at + " may not be taken by this user: give one from 1024 on, or 0 for any that is free");
    case EADDRNOTAVAIL:
      return core::unavailable(address + " is no address of this machine: give one of those that `ip address` lists");
    default:
      return core::unavailable(at + ": " + std::strerror(errno));
  }
}

}  // namespace

bool is_loopback(const std::string& address) {
  const auto numeric = numeric_address(address, 0);
  return numeric && numeric->is_loopback;
}

core::Result<std::string> random_web_token() {
  std::array<std::uint8_t, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return core::unavailable("the system gives no random numbers for a token: give a token");
  std::string token;
  constexpr const char* kDigits = "0123456789abcdef";
  for (const unsigned byte : bytes) {
    token += kDigits[byte >> 4U];
    token += kDigits[byte & 15U];
  }
  return token;
}

core::Result<ListeningSocket> listen_on(const std::string& address, int port) {
  const auto numeric = numeric_address(address, port);
  if (!numeric || port < 0 || port > 65535)
    return core::invalid_input(
        "'" + address + "', port " + std::to_string(port) +
        ": a numeric address such as 127.0.0.1 or 0.0.0.0 and a port from 0 to 65535 are needed");
  ListeningSocket made;
  made.host = numeric->host;
  made.descriptor =
      core::FileDescriptor(socket(numeric->bytes.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int number = made.descriptor.number();
  if (number < 0) return not_listening(address, port);
  const int yes = 1;
  // What a program before us left half closed keeps nobody from the port; who listens on it still does.
  setsockopt(number, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_storage bytes = numeric->bytes;
  if (bind(number, reinterpret_cast<const sockaddr*>(&bytes), numeric->size) != 0 || listen(number, 64) != 0)
    return not_listening(address, port);
  socklen_t size = sizeof bytes;
  if (getsockname(number, reinterpret_cast<sockaddr*>(&bytes), &size) != 0) return not_listening(address, port);
  sockaddr_in v4{};
  std::memcpy(&v4, &bytes, sizeof v4);  // the port is at the same place for IPv6
  made.port = ntohs(v4.sin_port);
  return made;
}

}  // namespace prescene::interfaces
