// SPDX-License-Identifier: Apache-2.0
// What the service tells the manager that started it, such as systemd, by the protocol of sd_notify(3): that it is
// ready, how it is, that it is alive, that it stops. Where no manager listens, nothing is told.
//
//   ServiceManager manager(manager_of_environment());
//   manager.note_turn();  // in each turn of the loop that must not stand still
//   manager.tell_stopping();
#pragma once

#include <optional>
#include <string>

#include "prescene/core/clock.h"

namespace prescene::service {

struct ServiceManagerSettings {
  /// Path of a datagram socket (AF_UNIX), or its abstract name with an '@' before it; empty = nobody listens.
  std::string socket;
  /// The manager ends a service that says nothing for so long, s; empty = it waits for ever.
  std::optional<double> watchdog_seconds;
};

/// Of NOTIFY_SOCKET and, where it is meant for this process (WATCHDOG_PID), WATCHDOG_USEC.
ServiceManagerSettings manager_of_environment();

/// For one thread. Never blocks: what the socket does not take is left out, but "ready" is told again with the next
/// turn.
class ServiceManager {
 public:
  explicit ServiceManager(ServiceManagerSettings settings);
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// The first one says that the service is ready; later ones that it is alive, three times in the watchdog's time at
  /// most.
  void note_turn();
  /// One line on how the service is, as `systemctl status` shows it.
  void tell_status(std::string text);
  void tell_stopping();

 private:
  bool tell(const std::string& message) const;

  ServiceManagerSettings settings_;
  int socket_ = -1;
  bool is_ready_ = false;
  std::optional<core::Stopwatch> since_alive_;
};

}  // namespace prescene::service
