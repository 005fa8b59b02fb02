// SPDX-License-Identifier: Apache-2.0
// A client of services of ROS 2, as rmw_cyclonedds_cpp makes one, on Cyclone's own interface: it shares no code with
// DdsNode but the descriptions of the types.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

struct dds_topic_descriptor;

namespace prescene::tests {

class ServiceClient {
 public:
  /// Of any type of service, whose C structs begin with the client and the request's number.
  ServiceClient(int domain, const std::string& name, const dds_topic_descriptor& request,
                const dds_topic_descriptor& response);
  /// Of `name` ("/prescene/where") in a domain; `asks_text` for prescene_msgs/srv/Ask, else std_srvs/srv/Trigger.
  ServiceClient(int domain, const std::string& name, bool asks_text = false);
  ~ServiceClient();
  ServiceClient(const ServiceClient&) = delete;
  ServiceClient& operator=(const ServiceClient&) = delete;

  /// Whether both of the server's endpoints are found within half a minute; rmw calls a service available then.
  bool wait_for_service();
  /// User data of the server's two endpoints: that of its reader of requests, then of its writer of replies.
  std::vector<std::string> user_data();
  /// Their identities, in the same order.
  std::vector<std::vector<std::uint8_t>> guids();
  /// Sends a request, and returns its number.
  std::int64_t send(const std::string& text = "");
  /// The same of a C struct of the request's type, whose first two fields are filled here.
  std::int64_t send_sample(void* sample);
  /// The bytes of the reply to this request of this client, those of others passed over; nothing within half a minute.
  std::optional<std::vector<std::uint8_t>> take_reply(std::int64_t sequence);

  struct Reply {
    bool success = false;
    std::string text;
  };
  /// send() and take_reply(), with the reply's fields read.
  std::optional<Reply> call(const std::string& text = "");
  std::uint64_t guid() const { return guid_; }
  /// Reads no replies from now on.
  void stop_reading();

 private:
  bool asks_text_ = false;
  int participant_ = 0, writer_ = 0, reader_ = 0, waitset_ = 0;
  std::uint64_t guid_ = 0;
  std::int64_t sequence_ = 0;
};

/// Bytes of what a participant says of its nodes, in the form of ROS 2 Jazzy, once it says what is `wanted`; empty if
/// it does not within half a minute.
std::vector<std::uint8_t> newest_announcement(int domain,
                                              const std::function<bool(const std::vector<std::uint8_t>&)>& wanted);

}  // namespace prescene::tests
