// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/dds/service_client.h"

#include <array>
#include <chrono>
#include <cstring>
#include <iterator>
#include <utility>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

// What idlc makes of the types; their fields are known from ROS's own definitions, and written down anew below.
// NOLINTBEGIN(readability-identifier-naming): idlc's names
extern "C" {
extern const dds_topic_descriptor_t std_srvs_srv_dds__Trigger_Request__desc;
extern const dds_topic_descriptor_t std_srvs_srv_dds__Trigger_Response__desc;
extern const dds_topic_descriptor_t prescene_msgs_srv_dds__Ask_Request__desc;
extern const dds_topic_descriptor_t prescene_msgs_srv_dds__Ask_Response__desc;
extern const dds_topic_descriptor_t rmw_dds_common_jazzy_msg_dds__ParticipantEntitiesInfo__desc;
}
// NOLINTEND(readability-identifier-naming)

namespace prescene::tests {
namespace {

struct TriggerRequest {
  std::uint64_t guid;
  std::int64_t sequence;
  std::uint8_t dummy;
};
struct AskRequest {
  std::uint64_t guid;
  std::int64_t sequence;
  char* question;
};

constexpr std::chrono::seconds kLimit(30);

std::uint64_t number_at(const std::vector<std::uint8_t>& bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = size; i-- > 0;) number = number << 8 | bytes.at(at + i);
  return number;
}

dds_qos_t* service_qos() {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &xcdr1);
  return qos;
}

/// What `read` makes of an endpoint that was found.
template <class Read>
auto read_of(dds_builtintopic_endpoint_t* endpoint, Read read) {
  decltype(read(*endpoint)) what;
  if (endpoint == nullptr) return what;
  what = read(*endpoint);
  dds_builtintopic_free_endpoint(endpoint);
  return what;
}

std::string user_data_of(const dds_builtintopic_endpoint_t& endpoint) {
  void* data = nullptr;
  std::size_t size = 0;
  dds_qget_userdata(endpoint.qos, &data, &size);
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

/// Of the server's reader of requests, then of its writer of replies.
template <class Read>
auto read_both(dds_entity_t writer, dds_entity_t reader, Read read) {
  std::vector<decltype(read(std::declval<const dds_builtintopic_endpoint_t&>()))> both;
  dds_instance_handle_t server_reader = 0;
  dds_instance_handle_t server_writer = 0;
  if (dds_get_matched_subscriptions(writer, &server_reader, 1) < 1 ||
      dds_get_matched_publications(reader, &server_writer, 1) < 1)
    return both;
  both.push_back(read_of(dds_get_matched_subscription_data(writer, server_reader), read));
  both.push_back(read_of(dds_get_matched_publication_data(reader, server_writer), read));
  return both;
}

}  // namespace

ServiceClient::ServiceClient(int domain, const std::string& name, bool asks_text)
    : ServiceClient(domain, name,
                    asks_text ? prescene_msgs_srv_dds__Ask_Request__desc : std_srvs_srv_dds__Trigger_Request__desc,
                    asks_text ? prescene_msgs_srv_dds__Ask_Response__desc : std_srvs_srv_dds__Trigger_Response__desc) {
  asks_text_ = asks_text;
}

ServiceClient::ServiceClient(int domain, const std::string& name, const dds_topic_descriptor& request,
                             const dds_topic_descriptor& response) {
  participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  dds_qos_t* qos = service_qos();
  reader_ = dds_create_reader(
      participant_, dds_create_topic(participant_, &response, ("rr" + name + "Reply").c_str(), nullptr, nullptr), qos,
      nullptr);
  writer_ = dds_create_writer(
      participant_, dds_create_topic(participant_, &request, ("rq" + name + "Request").c_str(), nullptr, nullptr), qos,
      nullptr);
  dds_delete_qos(qos);
  dds_instance_handle_t handle = 0;
  dds_get_instance_handle(writer_, &handle);
  guid_ = handle;
  waitset_ = dds_create_waitset(participant_);
  dds_set_status_mask(writer_, DDS_PUBLICATION_MATCHED_STATUS);
  dds_set_status_mask(reader_, DDS_SUBSCRIPTION_MATCHED_STATUS | DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(waitset_, writer_, 1);
  dds_waitset_attach(waitset_, reader_, 2);
}

ServiceClient::~ServiceClient() { dds_delete(participant_); }

bool ServiceClient::wait_for_service() {
  const auto until = std::chrono::steady_clock::now() + kLimit;
  while (std::chrono::steady_clock::now() < until) {
    dds_publication_matched_status_t requests{};
    dds_subscription_matched_status_t replies{};
    dds_get_publication_matched_status(writer_, &requests);
    dds_get_subscription_matched_status(reader_, &replies);
    if (requests.current_count > 0 && replies.current_count > 0) return true;
    std::array<dds_attach_t, 2> triggered{};
    dds_waitset_wait(waitset_, triggered.data(), triggered.size(), DDS_MSECS(1000));
  }
  return false;
}

std::vector<std::string> ServiceClient::user_data() { return read_both(writer_, reader_, user_data_of); }

std::vector<std::vector<std::uint8_t>> ServiceClient::guids() {
  return read_both(writer_, reader_, [](const dds_builtintopic_endpoint_t& endpoint) {
    return std::vector<std::uint8_t>(std::begin(endpoint.key.v), std::end(endpoint.key.v));
  });
}

std::int64_t ServiceClient::send_sample(void* sample) {
  ++sequence_;
  std::memcpy(sample, &guid_, sizeof guid_);
  std::memcpy(static_cast<char*>(sample) + sizeof guid_, &sequence_, sizeof sequence_);
  dds_write(writer_, sample);
  return sequence_;
}

void ServiceClient::stop_reading() { dds_delete(reader_); }

std::int64_t ServiceClient::send(const std::string& text) {
  std::string copy = text;
  AskRequest ask{0, 0, copy.data()};
  TriggerRequest trigger{};
  return send_sample(asks_text_ ? static_cast<void*>(&ask) : &trigger);
}

std::optional<std::vector<std::uint8_t>> ServiceClient::take_reply(std::int64_t sequence) {
  const auto until = std::chrono::steady_clock::now() + kLimit;
  while (std::chrono::steady_clock::now() < until) {
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info{};
    if (dds_takecdr(reader_, &sample, 1, &info, DDS_ANY_STATE) < 1) {
      std::array<dds_attach_t, 2> triggered{};
      dds_waitset_wait(waitset_, triggered.data(), triggered.size(), DDS_MSECS(1000));
      continue;
    }
    std::vector<std::uint8_t> bytes(info.valid_data ? ddsi_serdata_size(sample) : 0);
    if (info.valid_data) ddsi_serdata_to_ser(sample, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(sample);
    const bool is_mine = bytes.size() >= 20 && number_at(bytes, 4, 8) == guid_ &&
                         number_at(bytes, 12, 8) == static_cast<std::uint64_t>(sequence);
    if (is_mine) return bytes;
  }
  return std::nullopt;
}

std::optional<ServiceClient::Reply> ServiceClient::call(const std::string& text) {
  const auto bytes = take_reply(send(text));
  if (!bytes || bytes->size() < 29) return std::nullopt;
  const std::size_t length = number_at(*bytes, 24, 4);
  if (bytes->size() < 28 + length || length == 0) return std::nullopt;
  return Reply{bytes->at(20) == 1, std::string(reinterpret_cast<const char*>(bytes->data() + 28), length - 1)};
}

std::vector<std::uint8_t> newest_announcement(int domain,
                                              const std::function<bool(const std::vector<std::uint8_t>&)>& wanted) {
  const dds_entity_t participant = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  dds_topic_descriptor_t type = rmw_dds_common_jazzy_msg_dds__ParticipantEntitiesInfo__desc;
  type.m_typename = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  dds_qos_t* qos = service_qos();
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t reader = dds_create_reader(
      participant, dds_create_topic(participant, &type, "ros_discovery_info", nullptr, nullptr), qos, nullptr);
  dds_delete_qos(qos);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(waitset, reader, 1);
  std::vector<std::uint8_t> found;
  const auto until = std::chrono::steady_clock::now() + kLimit;
  while (found.empty() && std::chrono::steady_clock::now() < until) {
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info{};
    if (dds_takecdr(reader, &sample, 1, &info, DDS_ANY_STATE) < 1) {
      dds_attach_t triggered = 0;
      dds_waitset_wait(waitset, &triggered, 1, DDS_MSECS(1000));
      continue;
    }
    std::vector<std::uint8_t> bytes(info.valid_data ? ddsi_serdata_size(sample) : 0);
    if (info.valid_data) ddsi_serdata_to_ser(sample, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(sample);
    if (wanted(bytes)) found = bytes;
  }
  dds_delete(participant);
  return found;
}

}  // namespace prescene::tests
