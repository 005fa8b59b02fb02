// SPDX-License-Identifier: Apache-2.0
#include "dds_configuration.h"

#include <ifaddrs.h>
#include <net/if.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <vector>

namespace prescene::interfaces {
namespace {

constexpr std::size_t kLongestName = 255;  // of a host

// With peers, participants of a machine are looked for at so many ports.
constexpr int kMostParticipants = 32;

/// What names of interfaces, names of hosts and addresses are made of; nothing of it means anything in XML.
bool is_network_name(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || c == ':';
  });
}

/// Linux sends multicast over the loopback interface, too, but does not flag it as able to.
bool is_loopback(const std::string& name) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return false;
  bool found = false;
  for (const ifaddrs* one = all; one; one = one->ifa_next)
    found = found || (name == one->ifa_name && (one->ifa_flags & IFF_LOOPBACK) != 0);
  ::freeifaddrs(all);
  return found;
}

std::string interfaces_xml(const DdsOptions& options) {
  if (options.interfaces.empty()) return "";
  std::string xml = "<Interfaces>";
  for (const std::string& name : options.interfaces)
    xml += "<NetworkInterface name=\"" + name + "\"" + (is_loopback(name) ? " multicast=\"true\"" : "") + "/>";
  return xml + "</Interfaces>";
}

/// On the loopback interface others may have switched multicast off: they are looked for at their ports, too.
std::string discovery_xml(const DdsOptions& options) {
  std::vector<std::string> peers = options.peers;
  if (std::any_of(options.interfaces.begin(), options.interfaces.end(), is_loopback)) peers.emplace_back("127.0.0.1");
  if (peers.empty()) return "";
  std::string xml = "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
                    std::to_string(kMostParticipants - 1) + "</MaxAutoParticipantIndex><Peers>";
  for (const std::string& address : peers) xml += "<Peer address=\"" + address + "\"/>";
  return xml + "</Peers></Discovery>";
}

std::string uri() {
  const char* variable = std::getenv("CYCLONEDDS_URI");
  return variable ? variable : "";
}

}  // namespace

core::Status check_network(const DdsOptions& options) {
  for (const std::string& name : options.interfaces)
    if (!is_network_name(name))
      return core::invalid_input("'" + name +
                                 "' is no network interface: give a name that `ip link` shows, such as eth0");
  for (const std::string& address : options.peers)
    if (!is_network_name(address))
      return core::invalid_input("'" + address + "' is no peer: give the address or the name of a machine");
  // Interfaces of several places add up, and one that is named twice ends in an error that names none.
  if (!options.interfaces.empty() && uri().find("NetworkInterface") != std::string::npos)
    return core::invalid_input(
        "the environment's CYCLONEDDS_URI names network interfaces, and --interface does: leave them out in one place");
  return core::ok_status();
}

std::string configuration_of(const DdsOptions& options) {
  std::string xml = "<General><MaxMessageSize>65500B</MaxMessageSize>" + interfaces_xml(options) + "</General>" +
                    discovery_xml(options) + "<Internal><SocketReceiveBufferSize max=\"" +
                    std::to_string(options.receive_buffer_bytes) + "B\"/><MaxSampleSize>" +
                    // Beyond our own limit, so that what exceeds it comes here and is counted.
                    std::to_string(2 * options.max_message_bytes) + "B</MaxSampleSize></Internal>";
  if (options.find_interfaces)
    xml += "<Tracing><Category>config</Category><OutputFile>/dev/null</OutputFile></Tracing>";
  if (const std::string users = uri(); !users.empty()) xml += "," + users;
  return xml;
}

}  // namespace prescene::interfaces
