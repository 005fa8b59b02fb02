// SPDX-License-Identifier: Apache-2.0
// The services of ROS 2 that a node offers.
#include <algorithm>
#include <array>
#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <dds/dds.h>
#include "dds_node_impl.h"
#include "idl_messages.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/dds/service_request.h"
#include "topic_table.h"

namespace prescene::interfaces {
core::Status DdsNode::offer_service(const std::string& name, const std::string& type,
                                    std::function<void(ServiceRequest&&)> on_request) {
  PRESCENE_TRY(const std::string dds_name, dds_topic_name(name));
  const std::string rest = dds_name.substr(2);  // behind "rt"
  const ServiceType* service_type = find_service_type(type);
  if (service_type == nullptr)
    return core::unsupported("service " + name + ": the type '" + type + "' is not one that this program speaks");
  const auto topic_of = [&](const dds_topic_descriptor_t* descriptor, const std::string& topic) {
    return dds_create_topic(impl_->participant, descriptor, topic.c_str(), nullptr, nullptr);
  };
  const dds_entity_t requests = topic_of(service_type->request, "rq" + rest + "Request");
  PRESCENE_RETURN_IF_ERROR(dds_status(requests, "service " + name));
  const dds_entity_t replies = topic_of(service_type->response, "rr" + rest + "Reply");
  PRESCENE_RETURN_IF_ERROR(dds_status(replies, "service " + name));
  const std::lock_guard lock(impl_->mutex);
  // As rmw_cyclonedds_cpp numbers them: the participant's part of its GUID, and a count.
  std::array<std::uint8_t, 16> id{};
  dds_guid_t guid;
  PRESCENE_RETURN_IF_ERROR(dds_status(dds_get_guid(impl_->participant, &guid), "service " + name));
  std::copy_n(std::begin(guid.v), 12, id.begin());
  const int index = static_cast<int>(impl_->services.size());
  id[15] = static_cast<std::uint8_t>(index + 1);
  const dds_entity_t writer =
      dds_create_writer(impl_->participant, replies, make_service_qos(id, response_hash(*service_type)).get(), nullptr);
  PRESCENE_RETURN_IF_ERROR(dds_status(writer, "writer of " + name));
  Impl::Service& service = impl_->services.emplace_back();
  service.name = name;
  service.type = service_type;
  service.replies = writer;
  core::Status listens = impl_->listen(
      name, type, requests, make_service_qos(id, request_hash(*service_type)),
      [impl = impl_.get(), index, form = service_type->form, on_request = std::move(on_request)](auto&& message) {
        std::optional<ServiceRequest> request = parse_request(message.cdr, form);
        if (!request) {
          impl->dropped.fetch_add(1, std::memory_order_relaxed);
          return;
        }
        request->service = index;
        on_request(*std::move(request));
      });
  if (!listens.ok()) {
    impl_->services.pop_back();
    dds_delete(writer);
    return listens;
  }
  service.requests = impl_->subscriptions.back().reader;
  return core::ok_status();
}

const DdsNode::Impl::Service& DdsNode::Impl::service_for(const ServiceRequest& request) {
  Service* found = nullptr;
  {
    const std::lock_guard lock(mutex);
    PRESCENE_CHECK(request.service >= 0 && request.service < static_cast<int>(services.size()));
    found = &services[static_cast<std::size_t>(request.service)];
  }
  Service& service = *found;
  // Each client writes requests and reads replies. Whoever's writer was found first has a reader soon, or never.
  const auto without_reader = [&service] {
    dds_subscription_matched_status_t clients{};
    dds_publication_matched_status_t readers{};
    if (dds_get_subscription_matched_status(service.requests, &clients) != DDS_RETCODE_OK ||
        dds_get_publication_matched_status(service.replies, &readers) != DDS_RETCODE_OK)
      return 0;
    return std::max(0, static_cast<int>(clients.current_count) - static_cast<int>(readers.current_count));
  };
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kLook(2), kLongestWait(100);
  int missing = without_reader();
  if (missing < service.silent) service.silent = missing;  // some have left
  const auto begin = Clock::now();
  if (missing <= service.silent || begin < waits_from.load()) return service;
  while (missing > service.silent && Clock::now() < begin + kLongestWait) {
    std::this_thread::sleep_for(kLook);
    missing = without_reader();
  }
  if (missing > service.silent) service.silent = missing;
  waits_from = Clock::now() + std::chrono::milliseconds(200);
  return service;
}

template <class CType, class Message>
core::Status DdsNode::Impl::reply(const ServiceRequest& request, std::string_view type, const Message& message) {
  const Service& service = service_for(request);
  PRESCENE_CHECK(service.type->name == type);
  SampleArena arena;
  CType response{};
  response.client_guid = request.client;
  response.sequence_number = request.sequence;
  fill(response, message, arena);
  return dds_status(dds_write(service.replies, &response), "reply of " + service.name);
}

core::Status DdsNode::reply(const ServiceRequest& request, const RosListParametersResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__ListParameters_Response_>(request, "rcl_interfaces/srv/ListParameters",
                                                                        response);
}
core::Status DdsNode::reply(const ServiceRequest& request, const RosGetParametersResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__GetParameters_Response_>(request, "rcl_interfaces/srv/GetParameters",
                                                                       response);
}
core::Status DdsNode::reply(const ServiceRequest& request, const RosGetParameterTypesResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__GetParameterTypes_Response_>(
      request, "rcl_interfaces/srv/GetParameterTypes", response);
}
core::Status DdsNode::reply(const ServiceRequest& request, const RosDescribeParametersResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__DescribeParameters_Response_>(
      request, "rcl_interfaces/srv/DescribeParameters", response);
}
core::Status DdsNode::reply(const ServiceRequest& request, const RosSetParametersResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__SetParameters_Response_>(request, "rcl_interfaces/srv/SetParameters",
                                                                       response);
}
core::Status DdsNode::reply(const ServiceRequest& request, const RosSetParametersAtomicallyResponse& response) {
  return impl_->reply<rcl_interfaces_srv_dds__SetParametersAtomically_Response_>(
      request, "rcl_interfaces/srv/SetParametersAtomically", response);
}

core::Status DdsNode::reply(const ServiceRequest& request, bool success, const std::string& text) {
  const Impl::Service& service = impl_->service_for(request);
  // A C struct borrows its texts.
  char* borrowed = const_cast<char*>(text.c_str());
  const std::string writing = "reply of " + service.name;
  PRESCENE_CHECK(service.type->form != ServiceForm::kFields);
  if (service.type->form == ServiceForm::kText) {
    const prescene_msgs_srv_dds__Ask_Response_ response{request.client, request.sequence, success, borrowed};
    return dds_status(dds_write(service.replies, &response), writing);
  }
  const std_srvs_srv_dds__Trigger_Response_ response{request.client, request.sequence, success, borrowed};
  return dds_status(dds_write(service.replies, &response), writing);
}

}  // namespace prescene::interfaces
