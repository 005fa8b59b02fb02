// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace prescene::service {
namespace {

std::string variable_text(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::optional<std::uint64_t> whole_number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Of a socket's path or abstract name; empty where it is none.
std::optional<std::pair<sockaddr_un, socklen_t>> socket_address(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() < 2 || name.size() >= sizeof(address.sun_path) || (name[0] != '/' && name[0] != '@'))
    return std::nullopt;
  std::memcpy(address.sun_path, name.data(), name.size());
  if (name[0] == '@') address.sun_path[0] = '\0';
  return std::pair{address, static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())};
}

}  // namespace

ServiceManagerSettings manager_of_environment() {
  ServiceManagerSettings settings;
  settings.socket = variable_text("NOTIFY_SOCKET");
  const std::string pid = variable_text("WATCHDOG_PID");
  if (!pid.empty() && whole_number(pid) != static_cast<std::uint64_t>(getpid())) return settings;
  if (const auto microseconds = whole_number(variable_text("WATCHDOG_USEC")); microseconds && *microseconds > 0)
    settings.watchdog_seconds = 1e-6 * static_cast<double>(*microseconds);
  return settings;
}

ServiceManager::ServiceManager(ServiceManagerSettings settings) : settings_(std::move(settings)) {
  if (socket_address(settings_.socket)) socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) close(socket_);
}

void ServiceManager::note_turn() {
  if (!is_ready_) is_ready_ = tell("READY=1");
  if (!settings_.watchdog_seconds) return;
  if (since_alive_ && since_alive_->seconds() < *settings_.watchdog_seconds / 3.0) return;
  if (tell("WATCHDOG=1")) since_alive_.emplace();
}

void ServiceManager::tell_status(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  tell("STATUS=" + text);
}

void ServiceManager::tell_stopping() { tell("STOPPING=1"); }

bool ServiceManager::tell(const std::string& message) const {
  if (socket_ < 0) return false;
  const auto address = socket_address(settings_.socket);
  const auto sent = sendto(socket_, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                           reinterpret_cast<const sockaddr*>(&address->first), address->second);
  return sent == static_cast<ssize_t>(message.size());
}

}  // namespace prescene::service
